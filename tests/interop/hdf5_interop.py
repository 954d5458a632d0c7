"""h5py writes snapshots in every storage; h5dump and Mote must read the same numbers of them.

hdf5_interop.py DUMP_PARTICLES H5DUMP
"""
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy

COUNT = 5000
STORAGES = [{}, {"chunks": True}, {"chunks": True, "compression": "gzip"},
            {"chunks": True, "compression": "gzip", "shuffle": True, "fletcher32": True},
            {"chunks": True, "shuffle": True}, {"chunks": True, "fletcher32": True},
            {"chunks": True, "scaleoffset": True, "compression": "gzip"}]
TYPES = ["<f4", ">f4", "<f8", ">f8", "i1", "u1", "<i2", ">u2", "<i4", ">i4", "<u8", ">i8"]


def filled(path, storage, random, **options):
    with h5py.File(path, "w", **options) as file:
        header = file.create_group("Header")
        header.attrs["NumPart_ThisFile"] = numpy.array([COUNT, 0, 0, 0, 0, 0], dtype="u4")
        header.attrs["MassTable"] = numpy.zeros(6)
        gas = file.create_group("PartType0")
        for kind in TYPES:
            for arity in (1, 3):
                shape = (COUNT, arity) if arity > 1 else (COUNT,)
                if kind[-2] == "f":
                    values = random.normal(size=shape).astype(kind)
                else:
                    facts = numpy.iinfo(kind)
                    values = random.integers(facts.min // 2, facts.max // 2, size=shape, dtype=kind[-2:]).astype(kind)
                own = dict(storage)
                if "scaleoffset" in own:  # exact for integers alone
                    own.pop("scaleoffset")
                    if kind[-2] != "f":
                        own["scaleoffset"] = 0
                gas.create_dataset(f"{kind[-2:]}{'big' if kind[0] == '>' else ''}x{arity}", data=values, **own)
        whole = {key: value for key, value in storage.items() if key != "scaleoffset"}
        gas.create_dataset("Coordinates", data=random.random((COUNT, 3)), **whole)
        return [name for name in gas]


def dumped(h5dump, path, name, like):
    """The numbers as h5dump has them."""
    with tempfile.NamedTemporaryFile() as out:
        subprocess.run([h5dump, "-d", "/PartType0/" + name, "-b", "LE", "-o", out.name, str(path)], check=True,
                       stdout=subprocess.DEVNULL)
        raw = pathlib.Path(out.name).read_bytes()
        return numpy.frombuffer(raw, dtype=like.dtype.newbyteorder("<")).reshape(like.shape)


def main():
    sys.path.insert(0, str(pathlib.Path(__file__).parent))
    import mote_reads

    random = numpy.random.default_rng(1)
    done = 0
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "snapshot.hdf5"
        for storage in STORAGES:
            for libver in ("earliest", "latest"):
                names = filled(path, storage, random, libver=libver)
                ours = mote_reads.read(sys.argv[1], path)
                if set(ours) != set(names):
                    raise SystemExit(f"{storage}: Mote has {sorted(ours)}, the file {sorted(names)}")
                with h5py.File(path) as file:
                    for name in names:
                        what = f"{storage} {libver} {name}"
                        mote_reads.require_same(what + " (h5py)", ours[name], file["PartType0"][name][()])
                        theirs = dumped(sys.argv[2], path, name, ours[name])
                        mote_reads.require_same(what + " (h5dump)", ours[name], theirs)
                done += 1
        with h5py.File(path, "w") as file:  # h5py's own filter, which libhdf5 lacks
            file.create_dataset("Coordinates", data=random.random((COUNT, 3)), compression="lzf")
        refused = subprocess.run([sys.argv[1], str(path), folder], capture_output=True, text=True)
        if refused.returncode != 1 or "LZF" not in refused.stderr or "h5repack" not in refused.stderr:
            raise SystemExit(f"LZF was not refused as it should be: {refused.stderr}")
    print(f"{done} files: the same")


main()
