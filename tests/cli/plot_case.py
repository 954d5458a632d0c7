"""What the tests of tools/bench/plot_*.py share. Imported first, as it makes those scripts importable."""
import contextlib
import io
import json
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "bench"))

SVG = "{http://www.w3.org/2000/svg}"


class PlotCase(unittest.TestCase):
    """`script`: the module under test. Its files lie in a folder of their own, gone with the test."""
    script = None

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def plot(self, report, *flags):
        """Exit code, stdout and stderr of the script for a report (a string as it is, else as JSON) and flags."""
        with open(self.path("report.json"), "w", encoding="utf-8") as file:
            file.write(report if isinstance(report, str) else json.dumps(report))
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = self.script.main(self.path("report.json"), *flags)
        return code, out.getvalue(), err.getvalue()
