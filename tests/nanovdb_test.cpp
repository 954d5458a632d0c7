// NanoVDB files: what the reader accepts and refuses. NanoVDB itself writes them, from grids of OpenVDB.
#include "host/particles/formats/nanovdb_reader.h"

#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/Primitives.h>
#include <openvdb/openvdb.h>

#include <cstring>

#include "tests/support/opened_file.h"
#include "tests/support/volume_facts.h"

namespace mote {
namespace {

using namespace test;
namespace io = nanovdb::io;

std::string written(const nanovdb::GridHandle<>& handle, io::Codec codec) {
  const TempFolder folder;
  io::writeGrid(folder.file("grid.nvdb"), handle, codec);
  return readBytes(folder.file("grid.nvdb"));
}

/// Voxels, tiles of 8³ and 128³ and, above them all, one of 4096³.
std::string fog(io::Codec codec, bool rootTile = true) {
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(
      openvdb::math::Mat4d(0., 0.5, 0., 0., /**/ -0.25, 0., 0., 0., /**/ 0., 0.125, 2., 0., /**/ 10., 20., 30., 1.)));
  grid->sparseFill(openvdb::CoordBBox({-8, 0, 0}, {15, 7, 7}), 0.5f);
  for (int x = 16; x < 24; ++x) grid->tree().setValue({x, 3, 4}, 0.125f * static_cast<float>(x - 15));
  grid->tree().addTile(2, {128, 0, 0}, 1e-3f, true);
  if (rootTile) grid->tree().addTile(3, {-4096, 4096, -8192}, 1e-6f, true);
  return written(nanovdb::openToNanoVDB(*grid), codec);
}
double fogIntegral(bool rootTile = true) {
  const double voxels = 3 * 512 * 0.5 + 0.125 * 36 + 128.0 * 128 * 128 * static_cast<double>(1e-3f);
  return (voxels + (rootTile ? 4096.0 * 4096 * 4096 * static_cast<double>(1e-6f) : 0)) * 0.25;
}

constexpr io::Codec kCodecs[] = {io::Codec::NONE, io::Codec::ZIP, io::Codec::BLOSC};
const VolumeSampling kFew{.count = 1000, .seed = 4, .grid = ""};

TEST(NanoVdbReader, DrawsVoxelsAndTilesOfEveryLevelInEveryCodec) {
  for (const io::Codec codec : kCodecs) {
    const OpenedFile drawn(fog(codec), kFew);
    EXPECT_EQ(drawn.file->format(), "NanoVDB 32.4.2 (fog volume)");
    EXPECT_EQ(drawn.file->count(), 1000u);
    EXPECT_NEAR(densitySum(drawn) / fogIntegral(), 1, 1e-7);
    std::size_t inTile = 0;
    for (const dvec3& p : drawn.read<dvec3>("Position")) {
      const double j = (p.x - 10) / -0.25, k = (p.z - 30) / 2, i = (p.y - 20 - 0.125 * k) / 0.5;
      const bool root = j > 1000;
      inTile += root;
      if (root) {
        ASSERT_TRUE(i > -4097 && i < -0.4 && j > 4095 && j < 8192 && k > -8193 && k < -4096)
            << i << " " << j << " " << k;
      }
      if (!root) {
        ASSERT_TRUE(i > -8.6 && i < 255.6 && j > -0.6 && j < 127.6 && k > -0.6 && k < 127.6)
            << i << " " << j << " " << k;
      }
    }
    EXPECT_GT(inTile, 900u);  // by √value the great tile has nearly all of them
  }
}

TEST(NanoVdbReader, ChoosesAGridByNameOverSeveralSegments) {
  const std::string two = fog(io::Codec::ZIP, false) + fog(io::Codec::NONE);
  EXPECT_NEAR(densitySum(OpenedFile(two, kFew)) / fogIntegral(false), 1, 1e-7);  // the first of the name
  expectFileRefused(two, {"grid: expected", "'density'", "got 'smoke'"}, {.count = {}, .seed = 0, .grid = "smoke"});
}

TEST(NanoVdbReader, SaysWhatItDoesNotRead) {
  const std::string surface = written(nanovdb::createLevelSetSphere<float>(), io::Codec::NONE);
  expectFileRefused(surface, {"a fog volume of float", "a level set of float"});
  expectFileRefused(written(nanovdb::createFogVolumeSphere<double>(), io::Codec::NONE), {"(double)"});
  std::string version = fog(io::Codec::NONE);
  version[11] = 2;
  expectFileRefused(version, {"NanoVDB version: expected 32.3 or later", "got 16."});
  std::string codec = fog(io::Codec::NONE);
  codec[14] = 7;
  expectFileRefused(codec, {"NanoVDB codec", "got 7"});
  std::string inMemory = fog(io::Codec::NONE);
  inMemory[7] = '1';
  expectFileRefused(inMemory, {"a grid as it stands in memory"});
  expectFileRefused("NanoVDB", {"magic number", "only 7"});
}

TEST(NanoVdbReader, RefusesTruncationAtEveryByteOfItsHeadsAndOfAPackedGrid) {
  const std::string plain = fog(io::Codec::NONE);
  for (std::size_t size = 0; size < plain.size(); size += size < 2000 ? 1 : 997)
    expectFileRefused(plain.substr(0, size), {}, kFew);
  for (const io::Codec codec : {io::Codec::ZIP, io::Codec::BLOSC}) {
    const std::string packed = fog(codec);
    for (std::size_t size = 0; size < packed.size(); size += size < 400 ? 1 : 7)
      expectFileRefused(packed.substr(0, size), {}, kFew);
  }
}

TEST(NanoVdbReader, SurvivesFlippedBits) {
  std::vector<std::string> warnings;
  const WarningsKept kept(warnings);
  std::size_t refused = 0;
  const auto flip = [&](const std::string& whole, std::size_t byte) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string bytes = whole;
      bytes[byte] = static_cast<char>(bytes[byte] ^ 1 << bit);
      try {
        const OpenedFile opened(bytes, {.count = 16, .seed = 0, .grid = ""});
        EXPECT_EQ(opened.file->count(), 16u);
        opened.readAll();
      } catch (const InputError&) {
        ++refused;
      }
    }
  };
  // Heads, the grid's, the tree's and the root's; then here and there among the nodes.
  const std::string plain = fog(io::Codec::NONE);
  for (std::size_t byte = 0; byte < plain.size(); byte += byte < 1400 ? 1 : 1009) flip(plain, byte);
  const std::string packed = fog(io::Codec::ZIP), blosc = fog(io::Codec::BLOSC);
  for (std::size_t byte = 0; byte < packed.size(); byte += byte < 300 ? 1 : 13) flip(packed, byte);
  for (std::size_t byte = 0; byte < blosc.size(); byte += byte < 300 ? 1 : 29) flip(blosc, byte);
  EXPECT_GT(refused, 1000u);
}

TEST(NanoVdbReader, RefusesHostileNumbersWithoutAllocating) {
  const std::string plain = fog(io::Codec::NONE), packed = fog(io::Codec::ZIP);
  const auto with = [](std::string bytes, std::size_t at, std::uint64_t value, std::size_t size = 8) {
    std::memcpy(&bytes[at], &value, size);
    return bytes;
  };
  for (const std::uint64_t hostile : {~std::uint64_t{0}, std::uint64_t{1} << 62, std::uint64_t{1} << 40}) {
    expectFileRefused(with(packed, 16, hostile), {"what", "can hold"}, kFew);     // unpacked
    expectFileRefused(with(packed, 24, hostile), {"the file is cut off"}, kFew);  // in the file
    expectFileRefused(with(plain, 40, hostile), {"active voxels, as its head says"}, kFew);
    const std::size_t tree = 16 + 176 + 8 + 672;  // behind the heads, a name of 8 bytes and the grid's own
    for (std::size_t node = 0; node < 4; ++node)
      expectFileRefused(with(plain, tree + 8 * node, hostile), {"within"}, kFew);
  }
  for (std::size_t level = 0; level < 3; ++level)
    expectFileRefused(with(plain, 16 + 176 + 8 + 672 + 32 + 4 * level, 0xffffffff, 4), {"within"}, kFew);
  expectFileRefused(with(plain, 16 + 136, 0xffffffff, 4), {"name", "only"}, kFew);  // of the name
}

}  // namespace
}  // namespace mote
