#!/usr/bin/env python3
"""Tables and plots of a report of `mote bench figures`: the thesis' figures 22 to 25 and 31 with Mote's seconds.

  tools/bench/plot_figures.py REPORT.json [--csv OUT.csv] [--markdown OUT.md] [--svg FOLDER] [--cpu]

One row for each figure, point, backend and stage: median, least and greatest seconds, and their ratio to the same at
the figure's first point, which was timed in turn with it (median of the ratios run by run). Without a flag the CSV is
printed. The stage total is the whole frame, cpu its CPU time over all threads, which others on the machine disturb
least.
--svg writes FOLDER/figure22.svg and so on, with the whole frame and the lighting of each backend, or with --cpu the CPU
time. A point whose pictures differed was not timed and is left out. Standard library only.
Exit code: 0, 2 where the report is not one of `mote bench figures` or has not been timed.
"""
import os
import statistics
import sys

import plot

COLUMNS = ["figure", "axis", "x", "backend", "stage", "seconds", "seconds_min", "seconds_max", "ratio"]
STAGES = ["octree", "lighting", "sort", "splat"]  # and "total" and "cpu", of the whole frame


def times_of(run):
    """{(backend, stage): seconds of each run} of one point."""
    times = {}
    for side in ("a", "b"):
        if run["seconds_" + side]:
            for stage in STAGES:
                times[run[side], stage] = run["stages_" + side][stage]
            times[run[side], "total"] = run["seconds_" + side]
            times[run[side], "cpu"] = run["core_seconds_" + side]
    return times


def figures_of(report):
    """{figure: (title, axis, rows as COLUMNS has them)}, points in the report's order."""
    try:
        if report["benchmark"] != "figures":
            raise plot.ReportError("a report of bench figures is wanted, this is one of mote bench "
                                   + report["benchmark"])
        figures, first = {}, {}
        for run in report["runs"]:
            if not run["check"]["passed"]:
                continue
            number, axis, x = (run["figure"][key] for key in ("number", "axis", "x"))
            times = times_of(run)
            start = first.setdefault(number, times)
            rows = figures.setdefault(number, (run["figure"]["title"], axis, []))[2]
            for (backend, stage), seconds in times.items():
                ratio = statistics.median(s / base for s, base in zip(seconds, start[backend, stage]))
                rows.append([number, axis, x, backend, stage, statistics.median(seconds), min(seconds), max(seconds),
                             ratio])
    except (KeyError, TypeError, ZeroDivisionError, statistics.StatisticsError) as error:
        raise plot.ReportError("not a report of mote bench figures: %s %s" % (type(error).__name__, error)) from error
    if not figures:
        raise plot.ReportError("nothing was timed")
    return figures


def to_csv(figures):
    return plot.to_csv(COLUMNS, (row[:2] + ["%.10g" % row[2]] + row[3:5] + ["%.4g" % value for value in row[5:]]
                                 for _, _, rows in figures.values() for row in rows))


def to_markdown(figures):
    """A table a figure: one line a point and backend."""
    lines = []
    for number, (title, axis, rows) in figures.items():
        lines += ["**Figure %d**, %s; seconds:" % (number, title), "",
                  "| %s | | %s | whole frame (min .. max) | to the first | lighting to the first | CPU time "
                  "| to the first |" % (axis, " | ".join(STAGES)), "|" + "---|" * (len(STAGES) + 7)]
        points = {}
        for row in rows:
            points.setdefault((row[2], row[3]), {})[row[4]] = row
        for (x, backend), stages in points.items():
            total, cpu = stages["total"], stages["cpu"]
            cells = ["{:,.10g}".format(x), backend] + ["%.3g" % stages[stage][5] for stage in STAGES]
            cells += ["%.3g (%.3g .. %.3g)" % tuple(total[5:8])]
            cells += ["%.3g" % value for value in (total[8], stages["lighting"][8], cpu[5], cpu[8])]
            lines.append("| " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


def plot_of(axis, rows, plotted, title):
    """`plotted`: {stage: what the legend calls it}."""
    series, seconds = {}, []
    for _, _, x, backend, stage, median, *_ in rows:
        if stage in plotted:
            series.setdefault("%s, %s" % (backend, plotted[stage]), []).append((x, median))
            seconds.append(median)
    x_axis = plot.Axis(axis, [row[2] for row in rows], ticks=True)
    return plot.to_svg(x_axis, plot.Axis(title, seconds), {name: sorted(series[name]) for name in sorted(series)})


def files_of(report, options):
    figures = figures_of(report)
    files = {options.csv: to_csv(figures), options.markdown: to_markdown(figures)}
    what = {"total": "whole frame", "lighting": "lighting"}, "seconds"
    if options.cpu:
        what = {"cpu": "whole frame"}, "CPU seconds over all threads"
    if options.svg is not None:
        os.makedirs(options.svg, exist_ok=True)
        for number, (_, axis, rows) in figures.items():
            files[os.path.join(options.svg, "figure%d.svg" % number)] = plot_of(axis, rows, *what)
    files.pop(None, None)
    return files or {None: to_csv(figures)}


def main(*arguments):
    outputs = [("--csv", "OUT.csv", "write all rows there"),
               ("--markdown", "OUT.md", "write tables for a document there"),
               ("--svg", "FOLDER", "write a plot of each figure there")]
    return plot.run("plot_figures.py", __doc__, outputs, files_of, arguments)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
