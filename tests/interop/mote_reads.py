"""What Mote reads of a particle file, through dump_particles, as NumPy arrays."""
import pathlib
import subprocess
import tempfile

import numpy


def read(program, path):
    """{channel: array of shape (N) or (N, arity)}; subprocess.CalledProcessError (stderr has why) where it refuses."""
    with tempfile.TemporaryDirectory() as folder:
        lines = subprocess.run([program, str(path), folder], check=True, capture_output=True, text=True).stdout.splitlines()
        channels = {}
        for index, line in enumerate(lines):
            kind, arity, count, name = line.split(" ", 3)
            values = numpy.frombuffer((pathlib.Path(folder) / f"{index}.raw").read_bytes(), dtype=numpy.dtype(kind).newbyteorder("<"))
            channels[name] = values.reshape(int(count), int(arity)) if int(arity) > 1 else values
    return channels


def require_same(what, got, expected):
    """The same type, shape and bits."""
    expected = numpy.asarray(expected)
    if got.shape != expected.shape or got.dtype.kind != expected.dtype.kind or got.itemsize != expected.itemsize:
        raise SystemExit(f"{what}: Mote has {got.dtype} {got.shape}, the other {expected.dtype} {expected.shape}")
    if not numpy.array_equal(got, expected.astype(got.dtype), equal_nan=expected.dtype.kind == "f"):
        index = numpy.argwhere(got != expected)[0]
        raise SystemExit(f"{what}: number {index}: Mote has {got[tuple(index)]!r}, the other {expected[tuple(index)]!r}")
