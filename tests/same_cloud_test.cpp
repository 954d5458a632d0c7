// One cloud in the formats that are only read, as other programs would write it: the same particles to the last bit.
// (Those that Mote writes, too: writer_test.cpp.)
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <zlib.h>

#ifdef MOTE_HAS_HDF5
#include <hdf5.h>
#endif
#ifdef MOTE_HAS_OPENVDB
#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>
#endif

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

#include "tests/support/npy_bytes.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

using namespace test;

/// Particles of real smoke, with numbers of their own.
struct Cloud {
  std::vector<vec3> position;
  std::vector<float> density;
  std::vector<std::int32_t> id;  ///< the type of whole numbers that all formats have

  Cloud() {
    const auto smoke = openParticleFile(sharedFile("smoke1/smoke1_350k_power05.prt"));
    const ChannelRequest requests[] = {{"Position", &position}, {"Density", &density}};
    smoke->read(requests);
    constexpr std::size_t kCount = 3000;
    position.resize(kCount), density.resize(kCount), id.resize(kCount);
    for (std::size_t i = 0; i < kCount; ++i) id[i] = static_cast<std::int32_t>(i * 715827 % 2147483647);
  }
  std::size_t size() const { return position.size(); }
};
const Cloud& cloud() {
  static const Cloud made;
  return made;
}

template <class T>
std::string bytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}
/// Of numbers of four bytes.
std::string bigEndian(std::string bytes) {
  for (std::size_t k = 0; k + 4 <= bytes.size(); k += 4) std::reverse(bytes.begin() + k, bytes.begin() + k + 4);
  return bytes;
}

void expectTheCloud(const OpenedFile& opened, const char* format) {
  SCOPED_TRACE(format);
  EXPECT_TRUE(opened.file->format().starts_with(format)) << opened.file->format();
  ASSERT_EQ(opened.file->count(), cloud().size());
  const auto has = [&](const char* name) { return opened.file->channel(name) != nullptr; };
  const char* places = has("Position") ? "Position" : has("P") ? "P" : "Coordinates";
  EXPECT_TRUE(opened.read<vec3>(places) == cloud().position);
  EXPECT_TRUE(opened.read<float>(has("Density") ? "Density" : "Masses") == cloud().density);
  const std::vector<std::uint64_t> ids(cloud().id.begin(), cloud().id.end());
  EXPECT_TRUE(opened.read<std::uint64_t>(has("ID") ? "ID" : "ParticleIDs") == ids);
}

TEST(SameCloud, InNpz) {
  const auto little = [](std::uint64_t value, std::size_t bytes) {
    std::string text(reinterpret_cast<const char*>(&value), std::min(bytes, sizeof value));
    text.resize(bytes, '\0');
    return text;
  };
  const std::string rows = std::to_string(cloud().size());
  std::string file, directory;
  const auto add = [&](const std::string& name, const std::string& array) {
    const auto crc = crc32(0, reinterpret_cast<const Bytef*>(array.data()), static_cast<uInt>(array.size()));
    const std::string common = little(20, 2) + little(0, 2) + little(0, 2) + little(0x210000, 4) + little(crc, 4) +
                               little(array.size(), 4) + little(array.size(), 4) + little(name.size(), 2) +
                               little(0, 2);
    directory += "PK\1\2" + little(20, 2) + common + little(0, 10) + little(file.size(), 4) + name;
    file += "PK\3\4" + common + name + array;
  };
  add("Position.npy", npy(dictionary("'<f4'", "(" + rows + ", 3)"), bytesOf(cloud().position)));
  add("Density.npy", npy(dictionary("'<f4'", "(" + rows + ",)"), bytesOf(cloud().density)));
  add("ID.npy", npy(dictionary("'<i4'", "(" + rows + ",)"), bytesOf(cloud().id)));
  const std::string end = "PK\5\6" + little(0, 4) + little(3, 2) + little(3, 2) + little(directory.size(), 4) +
                          little(file.size(), 4) + little(0, 2);
  expectTheCloud(OpenedFile(file + directory + end), "NPZ");
}

TEST(SameCloud, InLegacyVtk) {
  const std::string head = "# vtk DataFile Version 3.0\ncloud\n", data = "DATASET POLYDATA\nPOINTS ";
  const std::string rows = std::to_string(cloud().size());
  std::string binary = head + "BINARY\n" + data + rows + " float\n" + bigEndian(bytesOf(cloud().position));
  binary += "\nPOINT_DATA " + rows + "\nSCALARS Density float 1\nLOOKUP_TABLE default\n";
  binary += bigEndian(bytesOf(cloud().density)) + "\nSCALARS ID int 1\nLOOKUP_TABLE default\n";
  expectTheCloud(OpenedFile(binary + bigEndian(bytesOf(cloud().id))), "VTK");

  std::string text = head + "ASCII\n" + data + rows + " float\n";
  for (const vec3& p : cloud().position) text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
  text += "POINT_DATA " + rows + "\nSCALARS Density float 1\nLOOKUP_TABLE default\n";
  for (const float d : cloud().density) text += fmt::format("{}\n", d);
  text += "SCALARS ID int 1\nLOOKUP_TABLE default\n";
  for (const std::int32_t id : cloud().id) text += fmt::format("{}\n", id);
  expectTheCloud(OpenedFile(text), "VTK");
}

TEST(SameCloud, InVtkXml) {
  std::string appended, arrays[3];
  const auto array = [&](const std::string& type, const std::string& bytes) {
    const std::string text =
        fmt::format(R"(<DataArray type="{}" format="appended" offset="{}")", type, appended.size());
    const std::uint64_t size = bytes.size();
    appended += std::string(reinterpret_cast<const char*>(&size), sizeof size) + bytes;
    return text;
  };
  arrays[0] = array("Float32", bytesOf(cloud().position)) + R"( NumberOfComponents="3"/>)";
  arrays[1] = array("Float32", bytesOf(cloud().density)) + R"( Name="Density"/>)";
  arrays[2] = array("Int32", bytesOf(cloud().id)) + R"( Name="ID"/>)";
  const std::string file =
      fmt::format(R"(<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64"><PolyData>)"
                  R"(<Piece NumberOfPoints="{}"><Points>{}</Points><PointData>{}{}</PointData></Piece></PolyData>)"
                  R"(<AppendedData encoding="raw">_{}</AppendedData></VTKFile>)",
                  cloud().size(), arrays[0], arrays[1], arrays[2], appended);
  expectTheCloud(OpenedFile(file), "VTK XML");
}

TEST(SameCloud, InClassicBgeo) {
  const auto numbers = [](std::initializer_list<std::int32_t> values) {
    return rawNumbers<std::int32_t>(values, true);
  };
  const auto attribute = [&](const std::string& name, std::int32_t type) {
    return std::string(1, '\0') + static_cast<char>(name.size()) + name + std::string("\0\1", 2) + numbers({type, 0});
  };
  std::string file = "BgeoV" + numbers({5, static_cast<std::int32_t>(cloud().size()), 0, 0, 0, 2, 0, 0, 0}) +
                     attribute("Density", 0) + attribute("ID", 1);
  for (std::size_t i = 0; i < cloud().size(); ++i) {
    const vec3& p = cloud().position[i];
    file += rawNumbers<float>({p.x, p.y, p.z, 1, cloud().density[i]}, true) + numbers({cloud().id[i]});
  }
  expectTheCloud(OpenedFile(file), "BGEO 5");
}

TEST(SameCloud, InHoudinisJson) {
  std::string places, densities, ids;
  for (std::size_t i = 0; i < cloud().size(); ++i) {
    const vec3& p = cloud().position[i];
    const char* comma = i == 0 ? "" : ",";
    places += fmt::format("{}[{},{},{}]", comma, p.x, p.y, p.z);
    densities += fmt::format("{}{}", comma, cloud().density[i]);
    ids += fmt::format("{}{}", comma, cloud().id[i]);
  }
  const auto attribute = [](const char* name, int size, const char* storage, const std::string& kind,
                            const std::string& values) {
    return fmt::format(R"([["type","numeric","name","{}"],["values",["size",{},"storage","{}","{}",{}]]])", name, size,
                       storage, kind, values);
  };
  const std::string file =
      fmt::format(R"(["fileversion","18.5.1","pointcount",{},"attributes",["pointattributes",[{},{},{}]]])",
                  cloud().size(), attribute("P", 3, "fpreal32", "tuples", "[" + places + "]"),
                  attribute("Density", 1, "fpreal32", "arrays", "[[" + densities + "]]"),
                  attribute("ID", 1, "int32", "arrays", "[[" + ids + "]]"));
  expectTheCloud(OpenedFile(file), "Houdini");
}

#ifdef MOTE_HAS_HDF5
TEST(SameCloud, InHdf5) {
  const TempFolder folder;
  const std::string path = folder.file("cloud.hdf5");
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  for (const char* group : {"Header", "PartType0"})
    H5Gclose(H5Gcreate2(file, group, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  const auto attribute = [&](const char* name, const auto& values, hid_t type) {
    const hsize_t count = values.size();
    const hid_t header = H5Gopen2(file, "Header", H5P_DEFAULT), space = H5Screate_simple(1, &count, nullptr);
    const hid_t own = H5Acreate2(header, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(own, type, values.data()), 0);
    H5Aclose(own), H5Sclose(space), H5Gclose(header);
  };
  const auto array = [&](const char* name, std::vector<hsize_t> shape, const void* values, hid_t type) {
    const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t own = H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite(own, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), 0);
    H5Dclose(own), H5Sclose(space);
  };
  std::vector<std::int32_t> counts(6, 0);
  counts[0] = static_cast<std::int32_t>(cloud().size());
  attribute("NumPart_ThisFile", counts, H5T_NATIVE_INT32), attribute("NumPart_Total", counts, H5T_NATIVE_INT32);
  attribute("MassTable", std::vector<double>(6, 0), H5T_NATIVE_DOUBLE);
  array("PartType0/Coordinates", {cloud().size(), 3}, cloud().position.data(), H5T_NATIVE_FLOAT);
  array("PartType0/Masses", {cloud().size()}, cloud().density.data(), H5T_NATIVE_FLOAT);
  array("PartType0/ParticleIDs", {cloud().size()}, cloud().id.data(), H5T_NATIVE_INT32);
  H5Fclose(file);
  expectTheCloud(OpenedFile(readBytes(path)), "HDF5");
}
#endif

#ifdef MOTE_HAS_OPENVDB
/// Points stand by their leaves, and their places in voxels, as floats: a part in 2²³ of a voxel is what is lost.
TEST(SameCloud, InOpenVdb) {
  namespace points = openvdb::points;
  openvdb::initialize();
  std::vector<openvdb::Vec3f> places;
  for (const vec3& p : cloud().position) places.emplace_back(p.x, p.y, p.z);
  constexpr double kVoxel = 0.5;
  const auto transform = openvdb::math::Transform::createLinearTransform(kVoxel);
  const points::PointAttributeVector<openvdb::Vec3f> where(places);
  const auto index = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(where, *transform);
  const auto grid = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(*index, where, *transform);
  grid->setName("points");
  const auto add = [&]<class T>(const char* name, const std::vector<T>& values) {
    points::appendAttribute<T>(grid->tree(), name);
    points::populateAttribute<points::PointDataTree, openvdb::tools::PointIndexTree, points::PointAttributeVector<T>>(
        grid->tree(), index->tree(), name, points::PointAttributeVector<T>(values));
  };
  add("Density", cloud().density), add("ID", cloud().id);
  const TempFolder folder;
  openvdb::io::File file(folder.file("cloud.vdb"));
  file.write({grid});
  file.close();

  const OpenedFile opened(readBytes(folder.file("cloud.vdb")));
  ASSERT_EQ(opened.file->count(), cloud().size());
  const std::vector<std::uint64_t> ids = opened.read<std::uint64_t>("ID");
  std::vector<std::size_t> found(ids.size()), meant(ids.size());
  std::iota(found.begin(), found.end(), 0u), std::iota(meant.begin(), meant.end(), 0u);
  std::sort(found.begin(), found.end(), [&](std::size_t a, std::size_t b) { return ids[a] < ids[b]; });
  std::sort(meant.begin(), meant.end(), [&](std::size_t a, std::size_t b) { return cloud().id[a] < cloud().id[b]; });
  const std::vector<float> density = opened.read<float>("Density");
  const std::vector<dvec3> position = opened.read<dvec3>("Position");
  for (std::size_t k = 0; k < ids.size(); ++k) {
    EXPECT_EQ(ids[found[k]], static_cast<std::uint64_t>(cloud().id[meant[k]]));
    EXPECT_EQ(density[found[k]], cloud().density[meant[k]]);
    EXPECT_LE(glm::distance(position[found[k]], dvec3(cloud().position[meant[k]])), kVoxel / (1 << 23));
  }
}
#endif

}  // namespace
}  // namespace mote
