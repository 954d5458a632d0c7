// PLY: what the reader accepts and refuses. Files are put together here byte by byte.
#include "host/particles/formats/ply_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "host/core/log.h"
#include "host/particles/particle_loader.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

using namespace test;

std::string ply(const std::string& format, const std::string& elements, const std::string& data) {
  std::string file = "ply\nformat ";
  file += format, file += " 1.0\ncomment made by a test\n";
  file += elements, file += "end_header\n", file += data;
  return file;
}

const std::string kVertices =
    "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty double radius\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n";
const std::string kFaces = "element face 2\nproperty list uchar int vertex_indices\n";

std::string vertices(bool big) {
  return rawNumbers<float>({1, 2, 3}, big) + rawNumbers<double>({0.5}, big) + std::string("\xff\x00\x33", 3) +
         rawNumbers<float>({4, 5, 6}, big) + rawNumbers<double>({0.25}, big) + std::string("\x00\xff\x00", 3);
}
std::string faces(bool big) {
  std::string lists(1, '\3');
  lists += rawNumbers<std::int32_t>({0, 1, 1}, big), lists += '\1', lists += rawNumbers<std::int32_t>({0}, big);
  return lists;
}

void expectTheTwo(const OpenedFile& opened) {
  EXPECT_EQ(describeChannels(opened.file->channels()), "Position (3 × float32), radius (float64), Color (3 × uint8)");
  EXPECT_EQ(opened.read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(opened.read<float>("radius"), (std::vector<float>{0.5, 0.25}));
  EXPECT_EQ(opened.read<vec3>("Color"), (std::vector<vec3>{{1, 0, 0.2f}, {0, 1, 0}}));
}

TEST(PlyReader, ReadsTextAndBothByteOrdersBehindAnyElement) {
  for (const bool facesFirst : {false, true}) {
    const std::string elements = facesFirst ? kFaces + kVertices : kVertices + kFaces;
    for (const bool big : {false, true}) {
      const std::string data = facesFirst ? faces(big) + vertices(big) : vertices(big) + faces(big);
      const OpenedFile opened(ply(big ? "binary_big_endian" : "binary_little_endian", elements, data));
      EXPECT_EQ(opened.file->format(), big ? "PLY binary_big_endian" : "PLY binary_little_endian");
      expectTheTwo(opened);
    }
    const std::string rows = "1 2 3.0 5e-1 255 0 51\n+4 5 6 .25 0 255 0\n", lists = "3 0 1 1\n1 0\n";
    const std::string data = facesFirst ? lists + rows : rows + lists;
    expectTheTwo(OpenedFile(ply("ascii", elements, data)));
    std::string windows;
    for (const char c : ply("ascii", elements, data)) {
      if (c == '\n') windows += '\r';
      windows += c;
    }
    expectTheTwo(OpenedFile(windows));
  }
}

TEST(PlyReader, ReadsRealFilesThroughTheLoader) {
  ParticleSource source;
  source.file = sharedFile("ply/horse.ply");
  const ParticleSet set = loadParticles({source}, 1);
  ASSERT_EQ(set.size(), 48485u);
  EXPECT_EQ(set.color.size(), set.size());
  const Bounds bounds = set.bounds();  // as its PROVENANCE has them
  EXPECT_NEAR(bounds.lo.x, -0.042003, 1e-6);
  EXPECT_NEAR(bounds.lo.y, -0.09167, 1e-5);
  EXPECT_NEAR(bounds.hi.y, 0.091671, 1e-6);
  EXPECT_NEAR(bounds.hi.z, 0.076418, 1e-6);
}

TEST(PlyReader, GivesGaussianSplatsARadiusADensityAndAColour) {
  const OpenedFile opened(ply("ascii",
                              "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
                              "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n"
                              "property float opacity\nproperty float scale_0\nproperty float scale_1\n"
                              "property float scale_2\n",
                              "0 0 0 1 0 -9 0 -1 -2 -3\n1 0 0 0 0 0 50 0 0 0\n"));
  const std::vector<float> radius = opened.read<float>("Radius"), density = opened.read<float>("Density");
  const std::vector<vec3> color = opened.read<vec3>("Color");
  const double r = std::sqrt(8.0) * std::exp(-2.0);
  EXPECT_NEAR(radius[0], r, 1e-6);
  EXPECT_NEAR(radius[1], std::sqrt(8.0), 1e-6);
  // What a ray through the middle is left with is 1 − α, and the kernel's total is π r² / 3 of its peak.
  EXPECT_NEAR(std::exp(-density[0] / (std::numbers::pi * r * r / 3)), 0.5, 1e-6);
  EXPECT_NEAR(density[1] / (std::numbers::pi * 8 / 3), 50, 1e-4);
  EXPECT_NEAR(color[0].x, 0.5 + 0.28209479, 1e-6);
  EXPECT_EQ(color[0].y, 0.5f);
  EXPECT_EQ(color[0].z, 0.0f);

  ParticleSource source;
  source.file = sharedFile("ply/train-1000.ply");
  const ParticleSet set = loadParticles({source}, 1);
  ASSERT_EQ(set.size(), 1000u);
  EXPECT_EQ(set.color.size(), 1000u);
}

TEST(PlyReader, RefusesTruncationAtEveryByteOfTheVertices) {
  for (const bool text : {false, true}) {
    const std::string whole = text ? ply("ascii", kVertices, "1 2 3 0.5 255 0 51\n4 5 6 0.25 0 255 0")
                                   : ply("binary_little_endian", kVertices, vertices(false));
    // A text's last number may lose digits and still be one.
    const std::size_t end = whole.size();
    for (std::size_t size = 0; size < end; ++size) expectFileRefused(whole.substr(0, size), {"particles"});
  }
  const std::string behind = ply("binary_little_endian", kFaces + kVertices, faces(false) + vertices(false));
  for (std::size_t size = 0; size < behind.size(); ++size) expectFileRefused(behind.substr(0, size), {"particles"});
}

TEST(PlyReader, SurvivesEveryFlippedBit) {
  expectEveryFlippedBitSurvived(ply("binary_little_endian", kFaces + kVertices, faces(false) + vertices(false)), 46);
  expectEveryFlippedBitSurvived(ply("ascii", kVertices, "1 2 3 0.5 255 0 51\n4 5 6 0.25 0 255 0\n"), 46);
}

TEST(PlyReader, RefusesHostileCountsWithoutAllocating) {
  for (const char* count : {"18446744073709551615", "4611686018427387904", "1000000000"}) {
    std::string many("element vertex ");
    many += count, many += "\nproperty float x\nproperty float y\n";
    expectFileRefused(ply("binary_little_endian", many, vertices(false)), {"at most", count, "cut off"});
    expectFileRefused(ply("ascii", many, "1 2\n"), {"at most", count, "cut off"});
    std::string before("element face ");
    before += count, before += "\nproperty list uint float x\n";
    expectFileRefused(ply("binary_little_endian", before + kVertices, vertices(false)), {"element face", count});
  }
  const std::string list = "element face 1\nproperty list uint double x\n";
  expectFileRefused(ply("binary_little_endian", list + kVertices, std::string("\xff\xff\xff\xff") + vertices(false)),
                    {"element face"});
  // A list's length that is more than any integer.
  const std::string floats = "element face 1\nproperty list float uchar x\n";
  for (const float length : {1e30f, std::numeric_limits<float>::infinity()})
    expectFileRefused(ply("binary_little_endian", floats + kVertices, rawNumbers<float>({length}) + vertices(false)),
                      {"element face", "cut off"});
  std::string many = "element vertex 0\n";
  for (int k = 0; k < 5000; ++k) many += fmt::format("property uchar a{}\n", k);
  expectFileRefused(ply("ascii", many, ""), {"channels", "at most 1024", "5000"});
  std::string endless(2 << 20, 'x');
  endless.replace(0, 4, "ply\n");
  expectFileRefused(endless, {"end_header within"});
}

TEST(PlyReader, SaysWhatItDoesNotRead) {
  expectFileRefused(ply("binary_middle_endian", kVertices, ""), {"line 2", "binary_little_endian"});
  expectFileRefused("ply\nformat ascii 2.0\nend_header\n", {"line 2", "1.0"});
  expectFileRefused("ply\nelement vertex 1\nproperty float x\nend_header\n1\n", {"a line 'format"});
  expectFileRefused(ply("ascii", "element vertex two\n", ""), {"line 4", "element NAME COUNT"});
  expectFileRefused(ply("ascii", "element vertex 1\nproperty half x\n", "1\n"), {"line 5", "property TYPE NAME"});
  expectFileRefused(ply("ascii", "property float x\n", ""), {"line 4", "behind an element"});
  expectFileRefused(ply("ascii", "elephant vertex 1\n", ""), {"line 4", "elephant"});
  expectFileRefused(ply("ascii", kFaces, ""), {"an element vertex, point or particle"});
  expectFileRefused(ply("ascii", "element vertex 1\nproperty list uchar int x\n", "0\n"), {"numbers", "a list"});
  expectFileRefused(ply("ascii", "element vertex 1\nproperty int x\nproperty int x\n", "0 0\n"), {"'x' twice"});
  expectFileRefused(ply("ascii", "element vertex 1\nproperty int x\nproperty int y\n", "0 z\n"),
                    {"particle 0 of 1, y", "'z'"});
}

}  // namespace
}  // namespace mote
