"""What Mote reads of a particle file, through dump_particles, as NumPy arrays."""
import pathlib
import subprocess
import tempfile

import numpy


def read(program, path):
    """{channel: array of shape (N) or (N, arity)}; subprocess.CalledProcessError (stderr has why) where it refuses."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([program, str(path), folder], check=True, capture_output=True, text=True)
        channels = {}
        for index, line in enumerate(done.stdout.splitlines()):
            kind, arity, count, name = line.split(" ", 3)
            raw = (pathlib.Path(folder) / f"{index}.raw").read_bytes()
            values = numpy.frombuffer(raw, dtype=numpy.dtype(kind).newbyteorder("<"))
            channels[name] = values.reshape(int(count), int(arity)) if int(arity) > 1 else values
    return channels


def require_same(what, got, expected):
    """The same type, shape and bits."""
    expected = numpy.asarray(expected)
    if (got.shape, got.dtype.kind, got.itemsize) != (expected.shape, expected.dtype.kind, expected.itemsize):
        raise SystemExit(f"{what}: Mote has {got.dtype} {got.shape}, the other {expected.dtype} {expected.shape}")
    if not numpy.array_equal(got, expected.astype(got.dtype), equal_nan=expected.dtype.kind == "f"):
        index = numpy.argwhere(got != expected)[0]
        at = tuple(index)
        raise SystemExit(f"{what}: number {at}: Mote has {got[at]!r}, the other {expected[at]!r}")
