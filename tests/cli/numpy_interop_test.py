#!/usr/bin/env python3
"""What numpy and mote make of each other's NPY files: numpy_interop_test.py MOTE."""
import os
import subprocess
import sys
import tempfile

import numpy

TYPES = ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2", "f4", "f8"]


def every_type(count):
    """A structured array with any bits in each type and arity; floats without NaNs, which equal nothing."""
    fields = [("Position", "<f4", (3,))]
    for name in TYPES:
        fields += [(name + "_one", "<" + name), (name + "_four", "<" + name, (4,))]
    table = numpy.zeros(count, dtype=fields)
    random = numpy.random.default_rng(1)
    for name in table.dtype.names:
        kind = table[name].dtype
        raw = random.integers(0, 256, size=table[name].nbytes, dtype="u1").tobytes()
        values = numpy.frombuffer(raw, dtype=kind).reshape(table[name].shape)
        table[name] = numpy.nan_to_num(values, posinf=1, neginf=-1) if kind.kind == "f" else values
    return table


def same(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def main():
    mote = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        first, second, prt, third = (os.path.join(folder, name) for name in ("a.npy", "b.npy", "c.prt", "d.npy"))

        def convert(*arguments):
            subprocess.run([mote, "convert", "--keep-names", *arguments], check=True, stdout=subprocess.DEVNULL)

        table = every_type(3000)
        numpy.save(first, table)
        convert(first, second)
        assert same(numpy.load(second), table), "NPY to NPY"
        convert(first, prt)
        convert(prt, third)
        assert same(numpy.load(third), table), "by way of PRT"
        mapped = numpy.load(second, mmap_mode="r")
        assert same(numpy.asarray(mapped), table), "mapped"
        plain = numpy.arange(12, dtype=">f8").reshape(4, 3)
        numpy.save(first, plain)
        convert(first, second)
        loaded = numpy.load(second)
        assert loaded.dtype.names == ("Position",) and (loaded["Position"] == plain).all(), "a plain array"
        big = every_type(5)
        numpy.save(first, big[:0])
        convert(first, second)
        assert numpy.load(second).shape == (0,), "no particles"


if __name__ == "__main__":
    main()
