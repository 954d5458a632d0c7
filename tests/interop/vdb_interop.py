#!/usr/bin/env python3
"""OpenVDB's own Python reads the integrals, voxels and places that mote does.  usage: vdb_interop.py MOTE SMOKE.vdb"""
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest

import pyopenvdb as vdb

MOTE, SMOKE = sys.argv[1:3]


def integral(grid):
    """Sum over active voxels, tiles as all of theirs, times a voxel's volume."""
    total, voxels = 0.0, 0
    for item in grid.iterOnValues():
        size = math.prod(b - a + 1 for a, b in zip(item.min, item.max))
        total += item.value * size
        voxels += size
    x, y, z = grid.transform.voxelSize()
    return total * x * y * z, voxels


def info(path):
    answer = subprocess.run([MOTE, "info", "--json", path], check=True, capture_output=True, text=True).stdout
    parsed = json.loads(answer)
    return parsed[0] if isinstance(parsed, list) else parsed


def metadata(described, name):
    return next(m["value"][0] for m in described["metadata"] if m["name"] == name)


class Vdb(unittest.TestCase):
    def expect_same(self, path, grid):
        described = info(path)
        expected, voxels = integral(grid)
        self.assertEqual(metadata(described, "active_voxels"), voxels)
        self.assertAlmostEqual(metadata(described, "integral") / expected, 1, delta=1e-9)
        density = next(c for c in described["channels"] if c["name"] == "Density")
        self.assertAlmostEqual(density["mean"][0] * described["count"] / expected, 1, delta=1e-6)

    def test_integral_of_smoke(self):
        self.expect_same(SMOKE, vdb.read(SMOKE, "density"))

    def test_integral_of_a_grid_with_tiles(self):
        with tempfile.TemporaryDirectory() as folder:
            grid = vdb.FloatGrid()
            grid.name = "density"
            grid.fill((0, 0, 0), (63, 40, 17), 0.25)
            grid.fill((100, 0, 0), (103, 3, 3), 2.0)
            grid.prune()
            grid.transform = vdb.createLinearTransform(voxelSize=0.3)
            path = os.path.join(folder, "tiles.vdb")
            vdb.write(path, grids=[grid])
            self.expect_same(path, grid)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
