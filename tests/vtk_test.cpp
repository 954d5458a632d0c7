// Legacy VTK: what the reader accepts and refuses. Files are put together here byte by byte.
#include "host/particles/formats/vtk_reader.h"

#include <gtest/gtest.h>

#include "host/particles/particle_loader.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

using namespace test;

std::string vtk(const std::string& encoding, const std::string& body, const std::string& version = "3.0") {
  std::string file = "# vtk DataFile Version ";
  file += version, file += "\na title\n", file += encoding, file += "\nDATASET UNSTRUCTURED_GRID\n", file += body;
  return file;
}

const std::string kText =
    "POINTS 2 float\n1 2 3 4 5 6\nCELLS 2 4\n1 0 1 1\nCELL_TYPES 2\n1\n1\nCELL_DATA 2\nSCALARS c int 1\n"
    "LOOKUP_TABLE default\n7 8\nPOINT_DATA 2\nSCALARS id unsigned_int\nLOOKUP_TABLE default\n10 20\n"
    "VECTORS velocity double\n1 0 0 0 1.5 0\nFIELD FieldData 2\npscale 1 2 float\n0.5 0.25\n"
    "METADATA\nINFORMATION 0\n\nmy%20own 2 2 short\n1 2 3 -4\n";

std::string binary() {
  std::string body = "POINTS 2 float\n";
  const auto add = [&](const std::string& more) { body += more; };
  add(rawNumbers<float>({1, 2, 3, 4, 5, 6}, true)), add("\nCELLS 2 4\n");
  add(rawNumbers<std::int32_t>({1, 0, 1, 1}, true)), add("\nCELL_TYPES 2\n");
  add(rawNumbers<std::int32_t>({1, 1}, true)), add("\nPOINT_DATA 2\nSCALARS id unsigned_int 1\nLOOKUP_TABLE t\n");
  add(rawNumbers<std::uint32_t>({10, 20}, true)), add("\nVECTORS velocity double\n");
  add(rawNumbers<double>({1, 0, 0, 0, 1.5, 0}, true)), add("\nFIELD FieldData 2\npscale 1 2 float\n");
  add(rawNumbers<float>({0.5, 0.25}, true)), add("\nmy%20own 2 2 short\n");
  add(rawNumbers<std::int16_t>({1, 2, 3, -4}, true)), add("\nCOLOR_SCALARS tint 3\n");
  add(std::string("\xff\x00\x33\x00\xff\x00", 6));
  return vtk("BINARY", body);
}

void expectTheTwo(const OpenedFile& opened) {
  EXPECT_EQ(opened.file->count(), 2u);
  EXPECT_EQ(opened.read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(opened.read<std::uint64_t>("id"), (std::vector<std::uint64_t>{10, 20}));
  EXPECT_EQ(opened.read<vec3>("velocity"), (std::vector<vec3>{{1, 0, 0}, {0, 1.5f, 0}}));
  EXPECT_EQ(opened.read<float>("pscale"), (std::vector<float>{0.5, 0.25}));
  EXPECT_EQ(opened.read<std::byte>("my own").size(), 8u);
  EXPECT_EQ(opened.file->channel("c"), nullptr);  // of the cells
}

TEST(VtkReader, ReadsPointsAndTheirDataInTextAndBinary) {
  const OpenedFile text(vtk("ASCII", kText));
  EXPECT_EQ(text.file->format(), "VTK 3 (text)");
  expectTheTwo(text);
  const OpenedFile raw(binary());
  EXPECT_EQ(raw.file->format(), "VTK 3 (binary)");
  expectTheTwo(raw);
  EXPECT_EQ(raw.read<vec3>("tint"), (std::vector<vec3>{{1, 0, 0.2f}, {0, 1, 0}}));
}

TEST(VtkReader, StepsOverTheCellsOfVersion5) {
  const OpenedFile opened(
      vtk("ASCII",
          "POINTS 2 double\n1 2 3\n4 5 6\n\nCELLS 3 2\nOFFSETS vtktypeint64\n0 1 2\n"
          "CONNECTIVITY vtktypeint64\n0 1\nCELL_TYPES 2\n1\n1\nPOINT_DATA 2\nSCALARS m float\n7 8\n",
          "5.1"));
  EXPECT_EQ(describeChannels(opened.file->channels()), "Position (3 × float64), m (float32)");
  EXPECT_EQ(opened.read<float>("m"), (std::vector<float>{7, 8}));
}

TEST(VtkReader, ReadsFilesOfSimulationsThroughTheLoader) {
  ParticleSource source;
  source.file = sharedFile("sph/cube_8_particles.vtk");
  const ParticleSet cube = loadParticles({source}, 1);
  ASSERT_EQ(cube.size(), 8u);
  EXPECT_NEAR(cube.bounds().lo.y, 0.4995095, 1e-7);
  source.file = sharedFile("sph/bunny_frame_14_7705_particles.vtk");
  const ParticleSet bunny = loadParticles({source}, 1);
  ASSERT_EQ(bunny.size(), 7706u);  // bounds as its PROVENANCE has them
  EXPECT_NEAR(bunny.bounds().lo.x, -0.60871, 1e-5);
  EXPECT_NEAR(bunny.bounds().hi.y, 2.0316, 1e-4);
  EXPECT_EQ(bunny.velocity.size(), 7706u);
  EXPECT_EQ(bunny.id.size(), 7706u);
}

TEST(VtkReader, RefusesTruncation) {
  const std::string whole = binary(), text = vtk("ASCII", kText);
  // Cut behind a whole array a file is shorter, and whole.
  const std::size_t points = whole.find("\nCELLS");
  for (std::size_t size = 0; size < points; ++size) expectFileRefused(whole.substr(0, size), {"particles"});
  for (std::size_t size = 0; size < text.find("5 6"); ++size) expectFileRefused(text.substr(0, size), {"particles"});
  std::size_t refused = 0;
  for (std::size_t size = points; size < whole.size(); ++size) try {
      OpenedFile(whole.substr(0, size)).readAll();
    } catch (const InputError&) {
      ++refused;
    }
  EXPECT_GT(refused, (whole.size() - points) * 9 / 10);
}

TEST(VtkReader, SurvivesEveryFlippedBit) {
  expectEveryFlippedBitSurvived(binary(), 100);
  expectEveryFlippedBitSurvived(vtk("ASCII", kText), 100);
}

TEST(VtkReader, RefusesMoreArraysThanAnybodyLooksThrough) {
  std::string arrays = "POINTS 0 float\nPOINT_DATA 0\nFIELD f 5000\n";
  for (int k = 0; k < 5000; ++k) arrays += fmt::format("a{} 1 0 char\n", k);
  expectFileRefused(vtk("ASCII", arrays), {"channels", "at most 1024"});
}

TEST(VtkReader, SaysWhatIsWrong) {
  expectFileRefused(vtk("ASCII", "", "6.0"), {"version 1 to 5", "6.0"});
  expectFileRefused(vtk("Ascii", ""), {"ASCII or BINARY", "'Ascii'"});
  expectFileRefused("# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\n",
                    {"no particles", "STRUCTURED_POINTS"});
  expectFileRefused(vtk("ASCII", "POINTS 18446744073709551615 float\n1 2 3\n"), {"18446744073709551615"});
  expectFileRefused(vtk("BINARY", "POINTS 6148914691236517205 float\n"), {"numbers of type float", "cut off"});
  expectFileRefused(vtk("ASCII", "POINTS 1 half\n1 2 3\n"), {"a type like float", "'half'"});
  expectFileRefused(vtk("ASCII", "POINTS 1 float\n1 two 3\n"), {"Position of point 0", "'two'"});
  expectFileRefused(vtk("ASCII", "POINTS 1 float\n1 2 3\nPOINT_DATA 2\n"), {"POINT_DATA 1", "'2'"});
  expectFileRefused(vtk("ASCII", "POINTS 1 float\n1 2 3\nSCALARS a float\n"), {"POINT_DATA or CELL_DATA"});
  expectFileRefused(vtk("ASCII", "POINTS 1 float\n1 2 3\nPOINT_DATA 1\nVECTORS Position float\n1 2 3\n"),
                    {"different names", "'Position'"});
  expectFileRefused(vtk("ASCII", "POINTS 1 float\n1 2 3\nWHATEVER\n"), {"a keyword", "'WHATEVER'"});
  expectFileRefused(vtk("ASCII", "CELL_TYPES 1\n1\n"), {"POINTS"});
}

}  // namespace
}  // namespace mote
