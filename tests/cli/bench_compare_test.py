"""tools/bench/compare.py on reports whose noise is known."""
import contextlib
import importlib.util
import io
import itertools
import json
import math
import os
import random
import stat
import sys
import tempfile
import unittest

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
spec = importlib.util.spec_from_file_location("compare", os.path.join(ROOT, "tools", "bench", "compare.py"))
compare = importlib.util.module_from_spec(spec)
spec.loader.exec_module(compare)


def report(seconds_a, seconds_b=(), **changes):
    run = {"name": "lighting", "unit": "rays", "count": 1000, "a": "on TBB", "b": "on the device" if seconds_b else None,
           "seconds_a": list(seconds_a), "seconds_b": list(seconds_b),
           "core_seconds_a": [2 * s for s in seconds_a], "core_seconds_b": list(seconds_b),
           "check": {"text": "equal", "passed": True}}
    run.update(changes)
    return {"benchmark": "lighting", "threads": 2, "simd": "AVX3", "device": "none", "runs": [run]}


def noisy(count, middle, seed, spread=0.1):
    source = random.Random(seed)
    return [middle * math.exp(source.uniform(-spread, spread)) for _ in range(count)]


class CompareTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def write(self, name, value):
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(value if isinstance(value, str) else json.dumps(value))
        return path

    def run_main(self, *arguments):
        """(exit code, stdout, stderr)"""
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = compare.main(list(arguments))
            except SystemExit as stop:
                code = stop.code
        return code, out.getvalue(), err.getvalue()

    def of_reports(self, a, b, *flags):
        return self.run_main(self.write("a.json", a), self.write("b.json", b), *flags)

    def test_SaysSlowerFasterAndNoDifference(self):
        usual, same, slow = noisy(9, 1, 1), noisy(9, 1, 2), noisy(9, 1.4, 3)
        self.assertEqual(self.of_reports(report(usual), report(same))[0], 0)
        code, out, _ = self.of_reports(report(usual), report(slow))
        self.assertEqual((code, out.split()[-1]), (1, "slower"))
        code, out, _ = self.of_reports(report(slow), report(usual))
        self.assertEqual((code, out.split()[-1]), (0, "faster"))

    def test_LooksAtBothContenders(self):
        code, out, _ = self.of_reports(report(noisy(9, 1, 1), noisy(9, 3, 2)), report(noisy(9, 1, 3), noisy(9, 9, 4)))
        self.assertEqual(code, 1)
        self.assertRegex(out, "on TBB .* no difference\n.*on the device .* slower")

    def test_ADifferenceBelowTheToleranceIsNone(self):
        a, b = noisy(20, 1, 1, 0.001), noisy(20, 1.015, 2, 0.001)
        self.assertEqual(self.of_reports(report(a), report(b))[0], 0)
        self.assertEqual(self.of_reports(report(a), report(b), "--tolerance", "0")[0], 1)

    def test_ClaimsNothingOfTooFewRuns(self):
        code, out, _ = self.of_reports(report([1.0] * 3), report([9.0] * 3))
        self.assertEqual(code, 0)
        self.assertIn("too few runs", out)

    def test_TheRanksAreThoseOfTheTables(self):
        # 2 / 2⁷ > 1 % ≥ 2 / 2⁸; for 20 pairs tables give 4 (P(at most 3) = 0.0013, P(at most 4) = 0.0059).
        self.assertEqual([compare.sign_rank(n) for n in (7, 8, 20)], [0, 1, 4])
        # Of 252 orders of 5 and 5 two are extreme: 0.8 %; of 126 orders of 4 and 5: 1.6 %. Critical U of 8, 8 is 7.
        self.assertEqual([compare.rank_sum_rank(*n) for n in ((5, 5), (4, 5), (5, 4), (8, 8))], [1, 0, 0, 8])

    def test_TheRankSumIsCountedAsByHand(self):
        # Every order of 6 and 5: the share whose U is below the rank must stay within half a percent, one more not.
        n, m = 6, 5
        counts = [0] * (n * m + 1)
        for places in itertools.combinations(range(n + m), n):
            counts[sum(place - index for index, place in enumerate(places))] += 1
        k, total = compare.rank_sum_rank(n, m), math.comb(n + m, n)
        self.assertLessEqual(sum(counts[:k]) / total, 0.005)
        self.assertGreater(sum(counts[:k + 1]) / total, 0.005)

    def test_FalseAlarmsAreRare(self):
        # 1 % on both sides together is promised; 400 trials with at most 12 (3 %) leave chance 1 in 10,000 or less.
        alarms = 0
        for trial in range(400):
            _, bounds = compare.compare_pairs(noisy(10, 1, 2 * trial), noisy(10, 1, 2 * trial + 1))
            alarms += not bounds[0] <= 1 <= bounds[1]
        self.assertLessEqual(alarms, 12)

    def test_CoreSecondsOnRequest(self):
        a, b = report(noisy(9, 1, 1)), report(noisy(9, 1, 2), core_seconds_a=[30.0] * 9)
        self.assertEqual(self.of_reports(a, b)[0], 0)
        self.assertEqual(self.of_reports(a, b, "--core")[0], 1)

    def test_RefusesWhatItCannotCompare(self):
        good = report([1.0] * 5)
        for bad, hint in ((report([1.0] * 5, count=7), "same count"), (report([1.0] * 5, name="sort"), "in common"),
                          ({"runs": [{}]}, "expected a report"), ("{", "b.json"), (report([0.0] * 5), "> 0"),
                          (report([1.0] * 5, check={"text": "off", "passed": False}), "wrong")):
            code, _, err = self.of_reports(good, bad)
            self.assertEqual((code, hint in err), (2, True), err)
        path = self.write("a.json", good)
        for arguments in ((path,), (path, path, "--run"), (path, path, "--", "sort"), ("--run", path, path, "--pairs",
                          "7", "--", "sort"), (path, path, "--tolerance", "-1"), (path, "/nonexistent")):
            self.assertEqual(self.run_main(*arguments)[0], 2, arguments)

    def program(self, name, seconds):
        """A stand-in for mote: writes a report, and its own name to a log."""
        path = self.write(name, f"""#!{sys.executable}
import json, sys
with open({os.path.join(self.folder, "log")!r}, "a") as log: log.write({name!r})
if sys.argv[1:3] != ["bench", "sort"]: sys.exit(3)
report = {report([seconds])!r}
with open(sys.argv[sys.argv.index("--report") + 1], "w") as out: json.dump(report, out)
""")
        os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)
        return path

    def test_RunsTwoProgramsInTurn(self):
        a, b = self.program("A", 1.0), self.program("B", 1.5)
        code, out, _ = self.run_main("--run", a, b, "--pairs", "8", "--", "sort", "--count", "9")
        self.assertEqual((code, out.split()[-1]), (1, "slower"))
        with open(os.path.join(self.folder, "log"), encoding="utf-8") as log:
            self.assertEqual(log.read(), "ABBA" * 4)

    def test_AProgramThatFailsIsNoResult(self):
        a = self.program("A", 1.0)
        code, _, err = self.run_main("--run", a, a, "--", "lighting")
        self.assertEqual((code, "exit code 3" in err), (2, True), err)


if __name__ == "__main__":
    unittest.main()
