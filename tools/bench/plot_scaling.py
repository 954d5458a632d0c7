#!/usr/bin/env python3
"""Table and plot of a report of `mote bench scaling`: time per particle against the number of particles.

  tools/bench/plot_scaling.py REPORT.json [--csv OUT.csv] [--svg OUT.svg] [--cpu]

Every cloud was timed in turn with the smallest one, so its time per particle is the median of the ratios times that of
the smallest, which is the median over the whole report. The columns with cpu are of the CPU time over all threads,
which others on the machine disturb least; --cpu plots that. Standard library only.
Exit code: 0, 2 where the report is not one of `mote bench scaling` or has not been timed.
"""
import argparse
import csv
import io
import json
import math
import statistics
import sys
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 70, 190, 20, 50  # margins; the right one holds the legend
COLOURS = ["#1b6ca8", "#c0392b", "#2e7d32", "#7b1fa2"]
COLUMNS = ["series", "particles", "ns_per_particle", "relative", "relative_min", "relative_max",
           "cpu_ns_per_particle", "relative_cpu"]


class ReportError(Exception):
    pass


def rows_of(report):
    """Rows as COLUMNS has them, series by series, each from its smallest cloud on."""
    try:
        if report["benchmark"] != "scaling":
            raise ReportError("a report of bench scaling is wanted, this is one of mote bench " + report["benchmark"])
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
        raise ReportError("not a report of mote bench scaling: %s %s" % (type(error).__name__, error)) from error
    if not rows:
        raise ReportError("nothing was timed")
    return rows


def to_csv(rows):
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        writer.writerow(row[:2] + ["%.4g" % value for value in row[2:]])
    return out.getvalue()


def count_text(count):
    return "%g M" % (count / 1e6) if count >= 1e5 else "%g k" % (count / 1e3)


def to_svg(rows, column="ns_per_particle"):
    value = COLUMNS.index(column)
    counts = sorted({row[1] for row in rows})
    least, most = min(row[value] for row in rows), max(row[value] for row in rows)
    # Whole decades about the times.
    low, high = math.floor(math.log10(least)), max(math.ceil(math.log10(most)), math.floor(math.log10(least)) + 1)

    def x(count):
        span = math.log(counts[-1] / counts[0]) or 1
        return LEFT + (WIDTH - LEFT - RIGHT) * math.log(count / counts[0]) / span

    def y(nanoseconds):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (math.log10(nanoseconds) - low) / (high - low)

    parts = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" font-family="sans-serif" font-size="12">'
             % (WIDTH, HEIGHT), '<rect width="%d" height="%d" fill="white"/>' % (WIDTH, HEIGHT)]

    def line(x1, y1, x2, y2, colour):
        parts.append('<line x1="%.1f" y1="%.1f" x2="%.1f" y2="%.1f" stroke="%s"/>' % (x1, y1, x2, y2, colour))

    def text(at_x, at_y, words, anchor="middle"):
        parts.append('<text x="%.1f" y="%.1f" text-anchor="%s">%s</text>' % (at_x, at_y, anchor, escape(words)))

    for decade in range(low, high + 1):
        for digit in range(1, 10 if decade < high else 2):
            at = y(digit * 10.0 ** decade)
            line(LEFT, at, WIDTH - RIGHT, at, "#bbb" if digit == 1 else "#eee")
        text(LEFT - 8, y(10.0 ** decade) + 4, "%g" % 10.0 ** decade, "end")
    for count in counts:
        line(x(count), TOP, x(count), HEIGHT - BOTTOM, "#eee")
        text(x(count), HEIGHT - BOTTOM + 18, count_text(count))
    text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 12, "particles")
    parts.append('<text transform="translate(18 %.1f) rotate(-90)" text-anchor="middle">%s</text>'
                 % ((TOP + HEIGHT - BOTTOM) / 2, column.replace("cpu", "CPU").replace("_", " ")))
    names = list(dict.fromkeys(row[0] for row in rows))
    for index, name in enumerate(names):
        colour = COLOURS[index % len(COLOURS)]
        points = [(x(row[1]), y(row[value])) for row in rows if row[0] == name]
        parts.append('<polyline fill="none" stroke="%s" stroke-width="2" points="%s"/>'
                     % (colour, " ".join("%.1f,%.1f" % point for point in points)))
        parts += ['<circle cx="%.1f" cy="%.1f" r="3" fill="%s"/>' % (*point, colour) for point in points]
        at = TOP + 14 + 20 * index
        line(WIDTH - RIGHT + 12, at - 4, WIDTH - RIGHT + 32, at - 4, colour)
        text(WIDTH - RIGHT + 38, at, name, "start")
    return "\n".join(parts + ["</svg>"]) + "\n"


def main(*arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("report", metavar="REPORT.json")
    parser.add_argument("--csv", metavar="OUT.csv", help="write the table there; else it is printed")
    parser.add_argument("--svg", metavar="OUT.svg", help="write the plot there")
    parser.add_argument("--cpu", action="store_true", help="plot CPU time over all threads")
    options = parser.parse_args(arguments)
    try:
        with open(options.report, encoding="utf-8") as file:
            rows = rows_of(json.load(file))
        if options.csv is None:
            sys.stdout.write(to_csv(rows))
        plot = to_svg(rows, "cpu_ns_per_particle" if options.cpu else "ns_per_particle")
        for path, content in ((options.csv, to_csv(rows)), (options.svg, plot)):
            if path is not None:
                with open(path, "w", encoding="utf-8") as file:
                    file.write(content)
    except (OSError, ValueError, ReportError) as error:
        print("plot_scaling.py: %s: %s" % (options.report, error), file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
