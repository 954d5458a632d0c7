"""tools/bench/plot_scaling.py on a report whose times are known."""
import csv
import io
import os
import unittest
import xml.etree.ElementTree

from plot_case import SVG, PlotCase
import plot_scaling


def run(series, count, seconds_a, ratio, passed=True):
    return {"name": "%s, %d" % (series, count), "count": count, "count_a": 1000, "a": "on 1000 particles", "b": series,
            "seconds_a": seconds_a, "core_seconds_a": [2e-3, 2e-3], "core_seconds_b": [8e-3, 8e-3],
            "ratio_median": ratio, "ratio_min": ratio / 2, "ratio_max": 2 * ratio,
            "check": {"text": "", "passed": passed}}


# 100 ns a particle at 1000; at 2000 as much, at 4000 one and a half times as much.
REPORT = {"benchmark": "scaling", "runs": [run("grid", 2000, [9e-5, 1e-4], 2), run("grid & co", 2000, [1e-3], 2),
                                           run("grid", 4000, [1e-4, 2e-4], 6)]}


class PlotScalingTest(PlotCase):
    script = plot_scaling

    def test_TableHasTheTimePerParticleOfEachCloud(self):
        code, out, err = self.plot(REPORT)
        self.assertEqual((code, err), (0, ""))
        rows = list(csv.DictReader(io.StringIO(out)))
        self.assertEqual([(row["series"], int(row["particles"])) for row in rows],
                         [("grid", 1000), ("grid", 2000), ("grid", 4000), ("grid & co", 1000), ("grid & co", 2000)])
        self.assertEqual([float(row["ns_per_particle"]) for row in rows], [100, 100, 150, 1000, 1000])
        self.assertEqual([float(row["relative"]) for row in rows], [1, 1, 1.5, 1, 1])
        self.assertEqual([float(row["cpu_ns_per_particle"]) for row in rows], [2000, 4000, 2000, 2000, 4000])
        self.assertEqual([float(row["relative_cpu"]) for row in rows], [1, 2, 1, 1, 2])
        self.assertEqual((float(rows[2]["relative_min"]), float(rows[2]["relative_max"])), (0.75, 3))

    def test_PlotHasALineOfEachSeriesThatRisesWithTheTime(self):
        code, out, _ = self.plot(REPORT, "--svg", self.path("plot.svg"), "--csv", self.path("plot.csv"))
        self.assertEqual((code, out), (0, ""))
        self.assertTrue(os.path.getsize(self.path("plot.csv")) > 0)
        root = xml.etree.ElementTree.parse(self.path("plot.svg")).getroot()
        lines = root.findall(SVG + "polyline")
        self.assertEqual(len(lines), 2)
        points = [tuple(map(float, point.split(","))) for point in lines[0].get("points").split()]
        self.assertEqual(len(points), 3)
        self.assertAlmostEqual(points[1][0] - points[0][0], points[2][0] - points[1][0], delta=0.2)  # doublings
        self.assertEqual(points[0][1], points[1][1])
        self.assertLess(points[2][1], points[1][1])
        self.assertIn("ns per particle", [text.text for text in root.iter(SVG + "text")])
        self.assertIn("grid & co", [text.text for text in root.iter(SVG + "text")])

    def test_PlotsCpuTimeWhereThatIsAskedFor(self):
        self.plot(REPORT, "--svg", self.path("plot.svg"), "--csv", self.path("plot.csv"), "--cpu")
        root = xml.etree.ElementTree.parse(self.path("plot.svg")).getroot()
        self.assertIn("CPU ns per particle", [text.text for text in root.iter(SVG + "text")])
        points = root.find(SVG + "polyline").get("points").split()
        heights = [float(point.split(",")[1]) for point in points]
        self.assertLess(heights[1], heights[0])
        self.assertEqual(heights[2], heights[0])

    def test_LeavesOutWhatFailedItsCheck(self):
        failed = {"benchmark": "scaling",
                  "runs": [run("grid", 2000, [1e-4], 2), run("grid", 4000, [], 0, passed=False)]}
        _, out, _ = self.plot(failed)
        self.assertEqual([row["particles"] for row in csv.DictReader(io.StringIO(out))], ["1000", "2000"])

    def test_RejectsWhatIsNoReportOfScaling(self):
        nothing = {"benchmark": "scaling", "runs": []}
        for report, words in (({"benchmark": "sort", "runs": []}, "mote bench sort"), ({"runs": 3}, "benchmark"),
                              ([], "not a report"), ("{", "report.json"), (nothing, "nothing was timed")):
            code, out, err = self.plot(report)
            self.assertEqual((code, out), (2, ""))
            self.assertIn(words, err)


if __name__ == "__main__":
    unittest.main()
