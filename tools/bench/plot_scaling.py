#!/usr/bin/env python3
"""Table and plot of a report of `mote bench scaling`: time per particle against the number of particles.

  tools/bench/plot_scaling.py REPORT.json [--csv OUT.csv] [--svg OUT.svg] [--cpu]

Every cloud was timed in turn with the smallest one, so its time per particle is the median of the ratios times that of
the smallest, which is the median over the whole report. The columns with cpu are of the CPU time over all threads,
which others on the machine disturb least; --cpu plots that. Standard library only.
Exit code: 0, 2 where the report is not one of `mote bench scaling` or has not been timed.
"""
import math
import statistics
import sys

import plot

COLUMNS = ["series", "particles", "ns_per_particle", "relative", "relative_min", "relative_max",
           "cpu_ns_per_particle", "relative_cpu"]


def rows_of(report):
    """Rows as COLUMNS has them, series by series, each from its smallest cloud on."""
    try:
        if report["benchmark"] != "scaling":
            raise plot.ReportError("a report of bench scaling is wanted, this is one of mote bench "
                                   + report["benchmark"])
        series = {}
        for run in report["runs"]:
            if run["check"]["passed"]:
                series.setdefault(run["b"], []).append(run)
        rows = []
        for name, runs in series.items():
            smallest = runs[0]["count_a"]
            wall, cpu = (statistics.median(s for run in runs for s in run[key]) / smallest * 1e9
                         for key in ("seconds_a", "core_seconds_a"))
            rows.append([name, smallest, wall, 1.0, 1.0, 1.0, cpu, 1.0])
            for run in runs:
                scale = run["count_a"] / run["count"]
                ratio, least, most = (run[key] * scale for key in ("ratio_median", "ratio_min", "ratio_max"))
                core_a, core_b = (statistics.median(run[key]) for key in ("core_seconds_a", "core_seconds_b"))
                ratio_cpu = core_b / core_a * scale if core_a > 0 else math.nan
                rows.append([name, run["count"], ratio * wall, ratio, least, most, ratio_cpu * cpu, ratio_cpu])
    except (KeyError, TypeError, IndexError, statistics.StatisticsError) as error:
        raise plot.ReportError("not a report of mote bench scaling: %s %s" % (type(error).__name__, error)) from error
    if not rows:
        raise plot.ReportError("nothing was timed")
    return rows


def to_csv(rows):
    return plot.to_csv(COLUMNS, (row[:2] + ["%.4g" % value for value in row[2:]] for row in rows))


def plot_of(rows, column="ns_per_particle"):
    value = COLUMNS.index(column)
    series = {}
    for row in rows:
        series.setdefault(row[0], []).append((row[1], row[value]))
    x_axis = plot.Axis("particles", [row[1] for row in rows], ticks=True, log=True)
    title = column.replace("cpu", "CPU").replace("_", " ")
    return plot.to_svg(x_axis, plot.Axis(title, [row[value] for row in rows], log=True), series)


def files_of(report, options):
    rows = rows_of(report)
    files = {options.csv: to_csv(rows)}
    if options.svg is not None:
        files[options.svg] = plot_of(rows, "cpu_ns_per_particle" if options.cpu else "ns_per_particle")
    return files


def main(*arguments):
    outputs = [("--csv", "OUT.csv", "write the table there; else it is printed"),
               ("--svg", "OUT.svg", "write the plot there")]
    return plot.run("plot_scaling.py", __doc__, outputs, files_of, arguments)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
