// Particles drawn from a volume: their sum, where they are, and that a seed gives them again.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <tuple>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/particles/formats/volume_particles.h"
#include "host/particles/formats/volume_sampler.h"
#include "host/particles/particle_loader.h"
#include "host/particles/spacing.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"
#include "tests/support/volume_facts.h"

namespace mote {
namespace {

using namespace test;

/// A ball of smoke, denser inside, in voxels of half a unit; a tile of 8³ and one of 128³ beside it.
Volume ballAndTiles() {
  Volume volume;
  volume.grid = "density";
  volume.linear = dmat3(0.5);
  volume.translate = dvec3(3, -2, 1);
  for (int x = -16; x < 16; x += 8)
    for (int y = -16; y < 16; y += 8)
      for (int z = -16; z < 16; z += 8) {
        const auto value = [&](std::size_t k) {
          const dvec3 p(x + static_cast<int>(k >> 6), y + static_cast<int>(k >> 3 & 7), z + static_cast<int>(k & 7));
          return 2 - glm::length(p) / 7;
        };
        volume.addLeaf(
            {x, y, z}, [&](std::size_t k) { return value(k) > 0; }, value);
      }
  volume.addTile({64, 0, 0}, 8, 0.25);
  volume.addTile({128, 0, 0}, 128, 1e-4);
  return volume;
}

std::vector<VolumeSample> drawn(const Volume& volume, std::uint64_t count, std::uint64_t seed) {
  std::vector<VolumeSample> samples(count);
  VolumeSampler(volume, count, seed).draw(0, samples);
  return samples;
}

double sumOf(const std::vector<VolumeSample>& samples) {
  double sum = 0;
  for (const VolumeSample& s : samples) sum += static_cast<double>(s.density);
  return sum;
}

TEST(Volume, IntegratesVoxelsAndTiles) {
  Volume volume;
  volume.linear = dmat3(2);
  volume.addLeaf(
      {0, 0, 0}, [](std::size_t k) { return k < 3; }, [](std::size_t k) { return 1.0 + static_cast<double>(k); });
  volume.addTile({8, 0, 0}, 8, 0.5);
  EXPECT_EQ(volume.voxels, 3u + 512u);
  EXPECT_EQ(volume.tileVoxels, 512u);
  EXPECT_DOUBLE_EQ(volume.integral(), 8 * (1 + 2 + 3 + 256.0));
}

TEST(Volume, CountsWhatIsNoDensity) {
  Volume volume;
  volume.addLeaf(
      {0, 0, 0}, [](std::size_t k) { return k < 4; },
      [](std::size_t k) {
        return k == 0 ? -1.0 : k == 1 ? std::nan("") : k == 2 ? HUGE_VAL : 1.0;
      });
  EXPECT_EQ(volume.dropped, 3u);
  EXPECT_DOUBLE_EQ(volume.integral(), 1);
}

TEST(VolumeSampler, KeepsTheIntegralForAnyCountAndSeed) {
  const Volume volume = ballAndTiles();
  const double integral = volume.integral();
  for (const std::uint64_t count : {1u, 2u, 7u, 1000u, 30001u, 200000u})
    for (const std::uint64_t seed : {0u, 1u, 99u})  // each number is rounded to 24 bits, and no worse
      EXPECT_NEAR(sumOf(drawn(volume, count, seed)) / integral, 1, 6e-8) << count << " seed " << seed;
}

/// What is in a leaf, or in 8³ voxels of a larger tile.
struct Block {
  double mass = 0;                        ///< drawn
  double count = 0;                       ///< …
  double sum = 0, roots = 0, powers = 0;  ///< of the volume: Σ value, Σ √value, Σ value^1.5
};
using Blocks = std::map<std::tuple<int, int, int>, Block>;

Blocks blocksOf(const Volume& volume) {
  Blocks blocks;
  const auto add = [&](const ivec3& at, double value, double voxels) {
    Block& block = blocks[{at.x / 8, at.y / 8, at.z / 8}];
    block.sum += value * voxels, block.roots += std::sqrt(value) * voxels,
        block.powers += std::pow(value, 1.5) * voxels;
  };
  for (std::size_t leaf = 0; leaf < volume.leaves.size(); ++leaf)
    for (std::size_t k = 0; k < kVolumeLeafVoxels; ++k)
      add(volume.leaves[leaf], static_cast<double>(volume.values[leaf * kVolumeLeafVoxels + k]), 1);
  for (const Volume::Tile& tile : volume.tiles)
    for (int x = 0; x < tile.edge; x += 8)
      for (int y = 0; y < tile.edge; y += 8)
        for (int z = 0; z < tile.edge; z += 8) add(tile.origin + ivec3(x, y, z), static_cast<double>(tile.value), 512);
  return blocks;
}

void addSamples(const Volume& volume, const std::vector<VolumeSample>& samples, Blocks& blocks) {
  const dmat3 toIndex = glm::inverse(volume.linear);
  for (const VolumeSample& s : samples) {
    const dvec3 voxel = glm::floor(toIndex * (s.position - volume.translate) + 0.5), at = glm::floor(voxel / 8.0);
    const auto found = blocks.find({static_cast<int>(at.x), static_cast<int>(at.y), static_cast<int>(at.z)});
    ASSERT_TRUE(found != blocks.end() && found->second.sum > 0) << at.x << " " << at.y << " " << at.z;
    found->second.mass += static_cast<double>(s.density), ++found->second.count;
  }
}

TEST(VolumeSampler, PutsIntoEveryBlockWhatTheVolumeHasThere) {
  const Volume volume = ballAndTiles();
  constexpr double kCount = 200000;
  Blocks blocks = blocksOf(volume);
  addSamples(volume, drawn(volume, static_cast<std::uint64_t>(kCount), 5), blocks);
  double allRoots = 0;
  for (const auto& [at, block] : blocks) allRoots += block.roots;
  const double voxel = volume.voxelVolume(), perRoot = kCount / allRoots;
  double chi = 0;
  int degrees = 0;
  for (const auto& [at, block] : blocks) {
    const double expected = block.roots * perRoot;
    // A leaf, and the tile of 8³, is one stretch of the running sum: whole strata, and two that it shares.
    if (std::get<0>(at) < 16) {
      EXPECT_LT(std::abs(block.count - expected), 2) << expected;
    }
    if (expected < 5) continue;  // too few for a normal distribution
    // Each particle weighs voxel · √value / perRoot; its count is at most Poisson's, as strata only take variance away.
    const double variance = voxel * voxel * block.powers / perRoot;
    chi += (block.mass - block.sum * voxel) * (block.mass - block.sum * voxel) / variance;
    ++degrees;
  }
  // χ² of so many degrees has a deviation of √(2 · 4153) = 91: five of them up is one in three million.
  EXPECT_GT(degrees, 4000);
  EXPECT_LT(chi, degrees + 5 * std::sqrt(2.0 * degrees));
}

TEST(VolumeSampler, SpreadsParticlesEvenlyWithinVoxelsAndTiles) {
  Volume volume;
  volume.addLeaf(
      {0, 0, 0}, [](std::size_t k) { return k == 73; }, [](std::size_t) { return 1.0; });  // (1, 1, 1)
  volume.addTile({8, 0, 0}, 8, 1.0);
  dvec3 sum(0), squares(0);
  const std::vector<VolumeSample> samples = drawn(volume, 100000, 3);
  std::size_t inVoxel = 0;
  for (const VolumeSample& s : samples) {
    if (s.position.x < 4) {
      ++inVoxel;
      EXPECT_TRUE(glm::all(glm::greaterThanEqual(s.position, dvec3(0.5))) &&
                  glm::all(glm::lessThan(s.position, dvec3(1.5))));
      continue;
    }
    sum += s.position - dvec3(11.5, 3.5, 3.5),
        squares += (s.position - dvec3(11.5, 3.5, 3.5)) * (s.position - dvec3(11.5, 3.5, 3.5));
  }
  EXPECT_NEAR(static_cast<double>(inVoxel), 100000 / 513.0, 1);  // a stratum more or less
  for (int axis = 0; axis < 3; ++axis) {
    const double n = static_cast<double>(samples.size() - inVoxel);
    EXPECT_NEAR(sum[axis] / n, 0, 5 * 8 / std::sqrt(12 * n));                       // five deviations
    EXPECT_NEAR(squares[axis] / n, 64 / 12.0, 5 * 64 / 12.0 * std::sqrt(0.8 / n));  // kurtosis of a uniform: 1.8
  }
}

TEST(VolumeSampler, GivesTheSameBitsForASeedOnAnyNumberOfThreadsAndInAnyPieces) {
  const Volume volume = ballAndTiles();
  constexpr std::uint64_t kCount = 70001;
  const std::vector<VolumeSample> whole = drawn(volume, kCount, 11);
  const auto same = [&](const std::vector<VolumeSample>& other) {
    for (std::size_t i = 0; i < whole.size(); ++i)
      if (whole[i].position != other[i].position || whole[i].density != other[i].density ||
          whole[i].radius != other[i].radius)
        return false;
    return true;
  };
  for (const unsigned threads : {1u, 2u, 7u}) {
    const ThreadLimit limit(threads);
    EXPECT_TRUE(same(drawn(volume, kCount, 11))) << threads;
  }
  std::vector<VolumeSample> pieces(kCount);
  const VolumeSampler sampler(volume, kCount, 11);
  for (std::size_t at = 0; at < kCount; at += 997)
    sampler.draw(at, std::span(pieces).subspan(at, std::min<std::size_t>(997, kCount - at)));
  EXPECT_TRUE(same(pieces));
  EXPECT_FALSE(same(drawn(volume, kCount, 12)));
}

TEST(VolumeSampler, MatchesRadiiToTheSpacing) {
  Volume volume;
  for (int x = 0; x < 64; x += 8) volume.addTile({x, 0, 0}, 8, 1.0);
  for (int x = 0; x < 64; x += 8) volume.addTile({x, 8, 0}, 8, 1.0);
  constexpr std::uint64_t kCount = 400;  // wider apart than voxels
  const std::vector<VolumeSample> samples = drawn(volume, kCount, 1);
  const double expected =
      1.5 * poissonNeighbourDistance(static_cast<double>(kCount) / static_cast<double>(volume.voxels));
  for (const VolumeSample& s : samples) ASSERT_NEAR(s.radius, expected, 1e-5);
  // Closer than voxels: a voxel's edge.
  for (const VolumeSample& s : drawn(volume, 1'000'000, 1)) ASSERT_EQ(s.radius, 1.0f);
}

TEST(VolumeParticles, SaysWhatCannotBeDrawn) {
  const auto messageOf = [](Volume volume, VolumeSampling sampling) -> std::string {
    volume.grid = "density";
    try {
      VolumeParticles("smoke.vdb", std::move(volume), {}, sampling);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  takeWarnings();
  Volume empty;
  EXPECT_NE(messageOf(empty, {}).find("grid 'density': expected a density somewhere, got 0 active voxels"),
            std::string::npos);
  Volume flat;
  flat.linear = dmat3(0);
  flat.addTile({0, 0, 0}, 8, 1);
  EXPECT_NE(messageOf(flat, {}).find("voxels with a volume"), std::string::npos);
  Volume huge;
  huge.addTile({0, 0, 0}, 4096, 3e38);
  EXPECT_NE(messageOf(huge, {}).find("an integral that float32 can say"), std::string::npos);
  Volume spoilt;
  spoilt.addTile({0, 0, 0}, 8, -1);
  spoilt.addTile({8, 0, 0}, 8, 1);
  EXPECT_NE(messageOf(spoilt, {.count = 0, .seed = 0, .grid = ""}).find("count: expected at least 1"),
            std::string::npos);
  const std::vector<std::string> warnings = takeWarnings();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0],
            "smoke.vdb: grid 'density': 512 of 1024 active voxels are negative or not finite, counted as 0");
}

TEST(VolumeParticles, TakesAMillionAtMostUnlessAsked) {
  Volume volume;
  volume.addTile({0, 0, 0}, 128, 1);
  EXPECT_EQ(VolumeParticles("a", volume, {}, {}).count(), 1'000'000u);
  EXPECT_EQ(VolumeParticles("a", volume, {}, {.count = 3'000'000, .seed = 0, .grid = ""}).count(), 3'000'000u);
  Volume small;
  small.addTile({0, 0, 0}, 8, 1);
  EXPECT_EQ(VolumeParticles("a", small, {}, {}).count(), 512u);
}

// ---- other people's volumes ----

/// Loads a file's particles, checks their sum against `integral` for several counts and seeds.
void expectIntegralKept(const std::string& file, double integral, double tolerance) {
  for (const std::uint64_t count : {1u, 10'000u, 350'000u})
    for (const std::uint64_t seed : {0u, 7u}) {
      ParticleSource source;
      source.file = sharedFile(file);
      source.count = count, source.seed = seed;
      source.radius.kind = RadiusRule::Kind::Auto;
      const ParticleSet set = loadParticles({source}, 1);
      ASSERT_EQ(set.size(), count);
      double sum = 0;
      for (const float d : set.density) sum += static_cast<double>(d);
      EXPECT_NEAR(sum / integral, 1, tolerance) << file << ", " << count << " of seed " << seed;
    }
}

TEST(VolumeParticles, KeepTheIntegralOfATeapotOfCloudWithItsTiles) {
  const auto file = openParticleFile(sharedFile("teapot_cloud/teapot_cloud-RENDER-0.85.nvdb"));
  EXPECT_EQ(file->format(), "NanoVDB 32.3.3 (fog volume)");
  EXPECT_EQ(metadataNumber(*file, "active_voxels"), 1963736);
  EXPECT_EQ(metadataNumber(*file, "tile_voxels"), 1963736 - 772824);  // its PROVENANCE
  // Summed up by a few lines of Python over the file's arrays; its leaves alone have 14.508.
  constexpr double kIntegral = 41.391925131086936;
  EXPECT_NEAR(metadataNumber(*file, "integral") / kIntegral, 1, 1e-12);
  expectIntegralKept("teapot_cloud/teapot_cloud-RENDER-0.85.nvdb", kIntegral, 1e-7);
}

}  // namespace
}  // namespace mote
