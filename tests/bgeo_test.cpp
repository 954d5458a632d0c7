// Classic BGEO: what the reader accepts and refuses. Files are put together here byte by byte.
#include "host/particles/formats/bgeo_reader.h"

#include <gtest/gtest.h>

#include "host/particles/particle_loader.h"
#include "tests/support/gzipped.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

using namespace test;

std::string text(const std::string& value) {
  std::string bytes = rawNumbers<std::uint16_t>({static_cast<std::uint16_t>(value.size())}, true);
  bytes += value;
  return bytes;
}
template <class T>
std::string attribute(const std::string& name, std::int32_t type, std::initializer_list<T> defaults) {
  std::string bytes = text(name);
  bytes += rawNumbers<std::uint16_t>({static_cast<std::uint16_t>(defaults.size())}, true);
  bytes += rawNumbers<std::int32_t>({type}, true), bytes += rawNumbers<T>(defaults, true);
  return bytes;
}

/// Two points with an id, a colour and a text.
std::string bgeo(std::int32_t points = 2, std::int32_t attributes = 3, std::int32_t version = 5) {
  std::string bytes = "BgeoV";
  bytes += rawNumbers<std::int32_t>({version, points, 0, 0, 0, attributes, 0, 0, 0}, true);
  bytes += attribute<std::int32_t>("id", 1, {0});
  bytes += text("name"), bytes += rawNumbers<std::uint16_t>({1}, true);
  bytes += rawNumbers<std::int32_t>({4, 2}, true), bytes += text("smoke"), bytes += text("");
  bytes += attribute<float>("Cd", 0, {1, 1, 1});
  for (const float x : {1.0f, 4.0f}) {
    bytes += rawNumbers<float>({x, x + 1, x + 2, 1}, true);
    bytes += rawNumbers<std::int32_t>({static_cast<std::int32_t>(10 * x), 1}, true);
    bytes += rawNumbers<float>({0.5f, 0.25f, x}, true);
  }
  return bytes;
}

TEST(BgeoReader, ReadsPointsAndTheirAttributesPlainAndPacked) {
  for (const bool packed : {false, true}) {
    std::string file = bgeo();
    file += "primitives and whatever follows";
    const OpenedFile opened(packed ? gzipped(file) : file);
    EXPECT_EQ(opened.file->format(), packed ? "BGEO 5 (gzip)" : "BGEO 5");
    EXPECT_EQ(describeChannels(opened.file->channels()), "Position (3 × float32), id (int32), Cd (3 × float32)");
    for (int again = 0; again < 2; ++again) {
      EXPECT_EQ(opened.read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
      EXPECT_EQ(opened.read<std::uint64_t>("id"), (std::vector<std::uint64_t>{10, 40}));
      EXPECT_EQ(opened.read<vec3>("Cd"), (std::vector<vec3>{{0.5f, 0.25f, 1}, {0.5f, 0.25f, 4}}));
    }
  }
}

TEST(BgeoReader, ReadsFilesOfASimulationThroughTheLoader) {
  ParticleSource source;
  source.file = sharedFile("bgeo/particle_grid.bgeo");
  const ParticleSet grid = loadParticles({source}, 1);
  ASSERT_EQ(grid.size(), 400u);  // bounds as its PROVENANCE has them
  EXPECT_NEAR(grid.bounds().lo.x, -7.15, 1e-6);
  EXPECT_NEAR(grid.bounds().hi.z, 7.1, 1e-6);
  EXPECT_EQ(grid.velocity.size(), 400u);
  EXPECT_EQ(grid.id[1], 1u);

  source.file = sharedFile("sph/dam_break_frame_9_6859_particles.bgeo");
  const ParticleSet dam = loadParticles({source}, 1);
  EXPECT_EQ(dam.size(), 6859u);
  EXPECT_EQ(dam.velocity.size(), 6859u);
  EXPECT_NEAR(dam.density[0], 1000.1286, 1e-3);
}

TEST(BgeoReader, RefusesTruncationAtEveryByte) {
  const std::string whole = bgeo(), packed = gzipped(whole);
  for (std::size_t size = 0; size < whole.size(); ++size) expectFileRefused(whole.substr(0, size), {"particles"});
  // Of a packed file the last eight bytes are a checksum, which is not waited for.
  for (std::size_t size = 0; size + 10 < packed.size(); ++size)
    expectFileRefused(packed.substr(0, size), {"particles"});
}

TEST(BgeoReader, SurvivesEveryFlippedBit) {
  expectEveryFlippedBitSurvived(bgeo(), 100);
  expectEveryFlippedBitSurvived(gzipped(bgeo()), 100000);
}

TEST(BgeoReader, SaysWhatIsWrong) {
  expectFileRefused(bgeo(2, 3, 6), {"BGEO version", "6"});
  expectFileRefused(bgeo(-1), {"number of points", "-1"});
  expectFileRefused(bgeo(2147483647), {"number of points", "2147483647 of 36 bytes"});
  expectFileRefused(bgeo(2, 2147483647), {"number of point attributes", "2147483647"});
  expectFileRefused(bgeo(3), {"number of points", "3 of 36 bytes", "cut off"});
  expectFileRefused(gzipped(bgeo(3)), {"the file's end at point 2"});
  std::string damaged = gzipped(bgeo());
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] + 1);
  expectFileRefused(damaged, {"particles"});
}

TEST(ParticleFile, AsksForOtherFormatsToBeUnpacked) {
  expectFileRefused(gzipped("1,2,3\n4,5,6\n"), {"packed with gzip", "gunzip"});
}

}  // namespace
}  // namespace mote
