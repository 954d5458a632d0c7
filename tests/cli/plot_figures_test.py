"""tools/bench/plot_figures.py and plot.py on a report whose times are known."""
import csv
import io
import os
import unittest
import xml.etree.ElementTree

from plot_case import SVG, PlotCase
import plot
import plot_figures


def stages(seconds):
    """Half of it lighting; the device's own clock is no stage."""
    return {"octree": [s / 8 for s in seconds], "lighting": [s / 2 for s in seconds], "sort": [s / 16 for s in seconds],
            "splat": [s / 4 for s in seconds], "device_lighting": [s / 4 for s in seconds]}


def point(number, axis, x, cpu, device, passed=True):
    run = {"name": "figure %d, %g" % (number, x), "a": "CPU", "b": "device" if device else None, "seconds_a": cpu,
           "seconds_b": device, "core_seconds_a": [1.5 * x ** 0.5 for _ in cpu], "core_seconds_b": [x for _ in device],
           "check": {"text": "", "passed": passed},
           "figure": {"number": number, "title": "held & fast", "axis": axis, "x": x}}
    if passed:
        run["stages_a"] = stages(cpu)
    if device:
        run["stages_b"] = stages(device)
    return run


# The second run was on a machine at half its speed: ratios do not notice.
REPORT = {"benchmark": "figures", "runs": [
    point(22, "particles", 1000, [1, 2], [8, 16]), point(22, "particles", 10000, [3, 6], [24, 32]),
    point(22, "particles", 100000, [9, 18], [80, 160]),
    point(31, "share & more", 100, [5, 5], [20, 20]), point(31, "share & more", 50, [4, 3], [10, 10])]}


class PlotFiguresTest(PlotCase):
    script = plot_figures

    def rows(self, report):
        code, out, err = self.plot(report)
        self.assertEqual((code, err), (0, ""))
        return {(row["figure"], float(row["x"]), row["backend"], row["stage"]): row
                for row in csv.DictReader(io.StringIO(out))}

    def test_TableHasEveryStageOfEachPointOnBothBackends(self):
        rows = self.rows(REPORT)
        self.assertEqual(set(rows), {(figure, x, backend, stage)
                                     for figure, values in (("22", (1000, 10000, 100000)), ("31", (100, 50)))
                                     for x in values for backend in ("CPU", "device")
                                     for stage in ("octree", "lighting", "sort", "splat", "total", "cpu")})
        total, lighting = rows["22", 10000, "CPU", "total"], rows["22", 10000, "CPU", "lighting"]
        self.assertEqual([float(total[key]) for key in ("seconds", "seconds_min", "seconds_max", "ratio")],
                         [4.5, 3, 6, 3])
        self.assertEqual([float(lighting[key]) for key in ("seconds", "ratio")], [2.25, 3])
        self.assertEqual(float(rows["22", 10000, "device", "splat"]["ratio"]), 2.5)  # of 3 and 2
        self.assertEqual(float(rows["31", 50, "CPU", "total"]["ratio"]), 0.7)
        self.assertEqual([float(rows["22", 100000, "device", "cpu"][key]) for key in ("seconds", "ratio")],
                         [100000, 100])
        self.assertEqual({float(rows[key]["ratio"]) for key in rows if key[1] in (1000, 100)}, {1})

    def test_LeavesTheDeviceOutWhereThereWasNone(self):
        report = {"benchmark": "figures", "runs": [point(22, "particles", 1000, [1], []),
                                                   point(22, "particles", 2000, [2], [])]}
        self.assertEqual({key[2] for key in self.rows(report)}, {"CPU"})

    def test_LeavesOutAPointThatWasWrong(self):
        report = {"benchmark": "figures", "runs": [point(22, "particles", 1000, [], [], passed=False),
                                                   point(22, "particles", 2000, [2], []),
                                                   point(22, "particles", 4000, [3], [])]}
        rows = self.rows(report)
        self.assertEqual({key[1] for key in rows}, {2000, 4000})
        self.assertEqual(float(rows["22", 4000, "CPU", "total"]["ratio"]), 1.5)

    def test_PlotsEachFigureWithBothBackends(self):
        code, out, err = self.plot(REPORT, "--svg", self.path("plots"), "--csv", self.path("all.csv"))
        self.assertEqual((code, out, err), (0, "", ""))
        self.assertEqual(sorted(os.listdir(self.path("plots"))), ["figure22.svg", "figure31.svg"])
        self.assertTrue(os.path.getsize(self.path("all.csv")) > 0)
        for name, words, counts in (("figure22.svg", "particles", 3), ("figure31.svg", "share & more", 2)):
            root = xml.etree.ElementTree.parse(os.path.join(self.path("plots"), name)).getroot()
            texts = [text.text for text in root.iter(SVG + "text")]
            for wanted in (words, "seconds", "CPU, whole frame", "CPU, lighting", "device, whole frame",
                           "device, lighting"):
                self.assertIn(wanted, texts)
            lines = [[tuple(map(float, pair.split(","))) for pair in line.get("points").split()]
                     for line in root.findall(SVG + "polyline")]
            self.assertEqual([len(line) for line in lines], [counts] * 4)
            self.assertEqual(len(root.findall(SVG + "circle")), 4 * counts)
            for line in lines:
                self.assertEqual(line, sorted(line))  # from the left
                self.assertLess(line[-1][1], line[0][1])  # more takes longer
        root = xml.etree.ElementTree.parse(os.path.join(self.path("plots"), "figure22.svg")).getroot()
        points = [[tuple(map(float, pair.split(","))) for pair in line.get("points").split()]
                  for line in root.findall(SVG + "polyline")]
        lighting, frame = points[0], points[1]
        self.assertAlmostEqual(frame[1][0] - frame[0][0], frame[2][0] - frame[1][0], delta=0.2)  # decades
        for a, b in zip(lighting, frame):  # on a logarithmic axis a factor of two is the same length everywhere
            self.assertAlmostEqual(a[1] - b[1], lighting[0][1] - frame[0][1], delta=0.2)

    def test_PlotsCpuTimeWhereThatIsAskedFor(self):
        self.plot(REPORT, "--svg", self.path("plots"), "--cpu")
        root = xml.etree.ElementTree.parse(os.path.join(self.path("plots"), "figure22.svg")).getroot()
        self.assertIn("CPU seconds over all threads", [text.text for text in root.iter(SVG + "text")])
        cpu, device = [[float(pair.split(",")[1]) for pair in line.get("points").split()]
                       for line in root.findall(SVG + "polyline")]
        for heights, decades in ((cpu, 0.5), (device, 1)):  # a decade of particles each
            for low, high in zip(heights, heights[1:]):
                self.assertAlmostEqual((low - high) / (device[0] - device[1]), decades, delta=0.01)

    def test_WritesATableForEachFigure(self):
        code, _, _ = self.plot(REPORT, "--markdown", self.path("tables.md"))
        self.assertEqual(code, 0)
        with open(self.path("tables.md"), encoding="utf-8") as file:
            text = file.read()
        self.assertIn("**Figure 22**, held & fast; seconds:", text)
        lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()
                 if line.startswith("| 1")]
        self.assertEqual(len(lines), 8)  # three and one points that begin with 1, each on both
        self.assertEqual(lines[2], ["10,000", "CPU", "0.562", "2.25", "0.281", "1.12", "4.5 (3 .. 6)", "3", "3", "150",
                                    "3.16"])

    def test_RejectsWhatIsNoReportOfFigures(self):
        nothing = {"benchmark": "figures", "runs": []}
        stageless = {"benchmark": "figures", "runs": [point(22, "particles", 1000, [1], [])]}
        del stageless["runs"][0]["stages_a"]["sort"]
        for report, words in (({"benchmark": "sort", "runs": []}, "mote bench sort"), ({"runs": 3}, "benchmark"),
                              ([], "not a report"), ("{", "report.json"), (nothing, "nothing was timed"),
                              (stageless, "sort")):
            code, out, err = self.plot(report, "--svg", self.path("plots"))
            self.assertEqual((code, out), (2, ""))
            self.assertIn(words, err)
            self.assertFalse(os.path.exists(self.path("plots")))


class AxisTest(unittest.TestCase):
    def test_IsLogarithmicWhereADecadeIsSpanned(self):
        decade, less = plot.Axis("", [0.3, 3]), plot.Axis("", [0.3, 2.9])
        self.assertEqual((decade.log, decade.low, decade.high), (True, 0.1, 10))
        self.assertAlmostEqual(decade.place(1), 0.5)
        self.assertEqual((less.log, less.low, less.high), (False, 0, 3))
        self.assertAlmostEqual(less.place(1.5), 0.5)
        self.assertEqual([label for _, label in less.labels], ["0", "0.5", "1", "1.5", "2", "2.5", "3"])

    def test_EndsAtTheValuesWhereTheyAreMarked(self):
        axis = plot.Axis("", [4, 2, 8], ticks=True)
        self.assertEqual(([axis.place(value) for value in (2, 5, 8)], axis.labels),
                         ([0, 0.5, 1], [(2, "2"), (4, "4"), (8, "8")]))
        self.assertEqual(plot.Axis("", [3], ticks=True).place(3), 0)

    def test_WritesNumbersShort(self):
        self.assertEqual([plot.number_text(value) for value in (7, 12.5, 2000, 921600, 4e6)],
                         ["7", "12.5", "2 k", "0.922 M", "4 M"])


if __name__ == "__main__":
    unittest.main()
