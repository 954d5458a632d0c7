"""Writes what numpy.save and numpy.savez make of one cloud of particles: write_numpy.py FOLDER (for numpy_test.cpp)."""
import os
import sys

import numpy

N = 70000  # more than one block of rows, whatever the type

folder = sys.argv[1]
i = numpy.arange(N)
position = numpy.stack([i * 0.5, -i / 8, i % 7], axis=1)
radius = 1 / (1 + i)
velocity = numpy.stack([i % 3, i % 5, i % 11], axis=1)


def path(name):
    return os.path.join(folder, name)


def arrays(dtype, order):
    return {
        "P": numpy.asarray(position, dtype, order=order),
        "pscale": radius.astype(dtype),
        "v": numpy.asarray(velocity, dtype, order=order),
        "id": (2**40 + i).astype(dtype[0] + "i8"),
        "time": numpy.array(1.25, dtype),
        "units": numpy.array("m²"),
        "objects": numpy.array([{"a": 1}], dtype=object),
    }


for dtype in "<f4", ">f4", "<f8", ">f8":
    for order in "CF":
        name = {"<": "little", ">": "big"}[dtype[0]] + dtype[2] + order
        numpy.savez(path(f"stored_{name}.npz"), **arrays(dtype, order))
        numpy.savez_compressed(path(f"packed_{name}.npz"), **arrays(dtype, order))
        numpy.save(path(f"plain_{name}.npy"), numpy.asarray(numpy.hstack([position, velocity]), dtype, order=order))

with open(path("parts.npz"), "wb") as file:
    numpy.savez_compressed(file, x=position[:, 0], y=position[:, 1], z=position[:, 2], Radius=radius)
with open(path("unnamed.npz"), "wb") as file:
    numpy.savez(file, numpy.hstack([position, velocity]).astype("f4"))


class Pipe:
    """A file that cannot seek: sizes and checksums then stand behind the data."""

    def __init__(self, file):
        self.file = file

    def write(self, data):
        return self.file.write(data)

    def flush(self):
        self.file.flush()

    def read(self, *_):  # numpy takes what has it for a file
        raise OSError("for writing alone")


with open(path("piped.npz"), "wb") as file:
    numpy.savez_compressed(Pipe(file), **arrays("<f4", "C"))

table = numpy.zeros(N, dtype=[("Position", "f4", 3), ("flag", "?"), ("Radius", "f8"), ("half", "f2")])
table["Position"], table["flag"], table["Radius"], table["half"] = position, i % 2 == 0, radius, i % 2048
numpy.save(path("table.npy"), table)
numpy.savez_compressed(path("table.npz"), particles=table, box=numpy.array([[0, 1], [0, 2], [0, 3.0]]))
