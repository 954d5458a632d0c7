"""VTK writes VTU and VTP in every mode; VTK's reader and Mote's must give the same numbers.

vtk_xml_interop.py DUMP_PARTICLES
"""
import itertools
import pathlib
import sys
import tempfile

import numpy
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_VERTEX, vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkIOXML import (vtkXMLPolyDataReader, vtkXMLPolyDataWriter, vtkXMLUnstructuredGridReader,
                                 vtkXMLUnstructuredGridWriter)

COUNT = 5000  # more than a block of the compressors
TYPES = ["f4", "f8", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"]


def filled(data, random, double):
    points = vtkPoints()
    points.SetData(numpy_to_vtk(random.normal(size=(COUNT, 3)).astype("f8" if double else "f4"), deep=True))
    data.SetPoints(points)
    for kind in TYPES:
        for arity in (1, 3):
            shape = (COUNT, arity) if arity > 1 else COUNT
            if kind[0] == "f":
                values = (random.normal(size=shape) * 10.0 ** random.integers(-30, 30, size=shape)).astype(kind)
            else:
                facts = numpy.iinfo(kind)
                values = random.integers(facts.min, facts.max, size=shape, dtype=kind, endpoint=True)
            array = numpy_to_vtk(values, deep=True)
            array.SetName(f"{kind} x {arity}")
            data.GetPointData().AddArray(array)
    data.GetPointData().SetActiveScalars("f4 x 1")
    time = numpy_to_vtk(numpy.array([0.125]), deep=True)
    time.SetName("TimeValue")
    data.GetFieldData().AddArray(time)
    return data


def main():
    sys.path.insert(0, str(pathlib.Path(__file__).parent))
    import mote_reads

    random = numpy.random.default_rng(1)
    grid = filled(vtkUnstructuredGrid(), random, True)
    for k in range(COUNT):
        grid.InsertNextCell(VTK_VERTEX, 1, [k])
    poly = filled(vtkPolyData(), random, False)
    kinds = [("vtu", grid, vtkXMLUnstructuredGridWriter, vtkXMLUnstructuredGridReader),
             ("vtp", poly, vtkXMLPolyDataWriter, vtkXMLPolyDataReader)]
    compressors = ["None", "ZLib", "LZ4"]
    done = 0
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "particles"
        for (name, data, Writer, Reader), mode, compressor, head, order, pieces in itertools.product(
                kinds, ["Ascii", "Binary", "Appended", "AppendedBase64"], compressors, ["UInt32", "UInt64"],
                ["LittleEndian", "BigEndian"], [1, 3]):
            if mode == "Ascii" and (compressor, head, order) != ("None", "UInt32", "LittleEndian"):
                continue  # text has none of them
            writer = Writer()
            getattr(writer, "SetDataModeTo" + mode.removesuffix("Base64"))()
            writer.SetEncodeAppendedData(mode.endswith("Base64"))
            getattr(writer, "SetCompressorTypeTo" + compressor)()
            getattr(writer, "SetHeaderTypeTo" + head)()
            getattr(writer, "SetByteOrderTo" + order)()
            writer.SetNumberOfPieces(pieces)
            writer.SetFileName(str(path))
            writer.SetInputData(data)
            if writer.Write() != 1:
                raise SystemExit("VTK could not write")
            what = f"{name} {mode} {compressor} {head} {order} in {pieces}"
            reader = Reader()
            reader.SetFileName(str(path))
            reader.Update()
            theirs, ours = reader.GetOutput(), mote_reads.read(sys.argv[1], path)
            mote_reads.require_same(what + ": Position", ours["Position"], vtk_to_numpy(theirs.GetPoints().GetData()))
            arrays = theirs.GetPointData()
            names = [arrays.GetArrayName(k) for k in range(arrays.GetNumberOfArrays())]
            if set(ours) - {"Position"} != set(names) or len(names) != 2 * len(TYPES):
                raise SystemExit(f"{what}: Mote has {sorted(ours)}, VTK {sorted(names)}")
            for array in names:
                mote_reads.require_same(f"{what}: {array}", ours[array], vtk_to_numpy(arrays.GetArray(array)))
            done += 1
    print(f"{done} files: the same")


main()
