"""What the scripts that plot reports of `mote bench` share: plots of lines and points as SVG, tables as CSV, and the
way from a command line to the files it asks for. Standard library only."""
import argparse
import csv
import io
import json
import math
import sys
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 70, 190, 20, 50  # margins; the right one holds the legend
COLOURS = ["#1b6ca8", "#c0392b", "#2e7d32", "#7b1fa2"]
DECADE = 10  # from this range on an axis is logarithmic


class ReportError(Exception):
    """What is wrong with a report; run() prints it."""


def number_text(value):
    """640, 12.5 k, 0.92 M."""
    if value >= 1e5:
        return "%.3g M" % (value / 1e6)
    return "%.3g k" % (value / 1e3) if value >= 1e3 else "%.3g" % value


class Axis:
    """A title, and where each of `values` (> 0) lies between 0 and 1. Logarithmic where they span a decade, or `log`
    says so; else linear. With `ticks` it ends at the values and marks each of them; without, it runs over whole
    decades, or from 0 in round steps."""

    def __init__(self, title, values, ticks=False, log=None):
        self.title = title
        least, most = min(values), max(values)
        self.log = most >= DECADE * least if log is None else log
        if ticks:
            self.low, self.high = least, most
            self.labels = [(value, number_text(value)) for value in sorted(set(values))]
            self.lines = [(value, False) for value, _ in self.labels]
        elif self.log:
            low = math.floor(math.log10(least))
            high = max(math.ceil(math.log10(most)), low + 1)
            decades = range(low, high + 1)
            self.low, self.high = 10.0 ** low, 10.0 ** high
            self.labels = [(10.0 ** decade, "%g" % 10.0 ** decade) for decade in decades]
            self.lines = [(digit * 10.0 ** decade, digit == 1) for decade in decades
                          for digit in range(1, 10 if decade < high else 2)]
        else:
            # The least of 1, 2 and 5 times a power of ten of which six reach the greatest value.
            power = 10.0 ** math.floor(math.log10(most / 6))
            step = next(digit * power for digit in (1, 2, 5, 10) if 6 * digit * power >= most)
            steps = range(math.ceil(most / step) + 1)
            self.low, self.high = 0, step * steps[-1]
            self.labels = [(step * k, "%g" % (step * k)) for k in steps]
            self.lines = [(value, True) for value, _ in self.labels]

    def place(self, value):
        if self.high == self.low:
            return 0
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


def to_svg(x_axis, y_axis, series):
    """`series`: {name: [(x, y), …]}, each a line with a circle at every point."""
    parts = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" font-family="sans-serif" font-size="12">'
             % (WIDTH, HEIGHT), '<rect width="%d" height="%d" fill="white"/>' % (WIDTH, HEIGHT)]

    def at_x(value):
        return LEFT + (WIDTH - LEFT - RIGHT) * x_axis.place(value)

    def at_y(value):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * y_axis.place(value)

    def line(x1, y1, x2, y2, colour):
        parts.append('<line x1="%.1f" y1="%.1f" x2="%.1f" y2="%.1f" stroke="%s"/>' % (x1, y1, x2, y2, colour))

    def text(x, y, words, anchor="middle"):
        parts.append('<text x="%.1f" y="%.1f" text-anchor="%s">%s</text>' % (x, y, anchor, escape(words)))

    for value, strong in y_axis.lines:
        line(LEFT, at_y(value), WIDTH - RIGHT, at_y(value), "#bbb" if strong else "#eee")
    for value, label in y_axis.labels:
        text(LEFT - 8, at_y(value) + 4, label, "end")
    for value, strong in x_axis.lines:
        line(at_x(value), TOP, at_x(value), HEIGHT - BOTTOM, "#bbb" if strong else "#eee")
    for value, label in x_axis.labels:
        text(at_x(value), HEIGHT - BOTTOM + 18, label)
    text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 12, x_axis.title)
    parts.append('<text transform="translate(18 %.1f) rotate(-90)" text-anchor="middle">%s</text>'
                 % ((TOP + HEIGHT - BOTTOM) / 2, escape(y_axis.title)))
    for index, (name, values) in enumerate(series.items()):
        colour = COLOURS[index % len(COLOURS)]
        points = [(at_x(x), at_y(y)) for x, y in values]
        parts.append('<polyline fill="none" stroke="%s" stroke-width="2" points="%s"/>'
                     % (colour, " ".join("%.1f,%.1f" % point for point in points)))
        parts += ['<circle cx="%.1f" cy="%.1f" r="3" fill="%s"/>' % (*point, colour) for point in points]
        at = TOP + 14 + 20 * index
        line(WIDTH - RIGHT + 12, at - 4, WIDTH - RIGHT + 32, at - 4, colour)
        text(WIDTH - RIGHT + 38, at, name, "start")
    return "\n".join(parts + ["</svg>"]) + "\n"


def to_csv(columns, rows):
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([columns, *rows])
    return out.getvalue()


def run(script, description, outputs, files_of, arguments):
    """The main function of `script`. `outputs`: (flag, metavar, help) of each; `files_of(report, options)`:
    {path: text}, the text of None is printed. Returns the exit code: 0, 2 where a file cannot be read or written or is
    no such report."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("report", metavar="REPORT.json")
    for flag, metavar, words in outputs:
        parser.add_argument(flag, metavar=metavar, help=words)
    parser.add_argument("--cpu", action="store_true", help="plot CPU time over all threads")
    options = parser.parse_args(arguments)
    try:
        with open(options.report, encoding="utf-8") as file:
            files = files_of(json.load(file), options)
        for path, text in files.items():
            if path is None:
                sys.stdout.write(text)
                continue
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
    except (OSError, ValueError, ReportError) as error:
        print("%s: %s: %s" % (script, options.report, error), file=sys.stderr)
        return 2
    return 0
