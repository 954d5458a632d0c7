// Bitonic sort and depth keys on the device against std::stable_sort and the formula of layout/sort.h on the host.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/passes/depth_key_pass.h"
#include "engine/passes/sort_pass.h"
#include "host/core/random.h"
#include "host/splat/splat.h"
#include "shaders/glsl/layout/sort.h"
#include "shaders/glsl/layout/splat.h"
#include "tests/gpu/gpu_fixture.h"

namespace mote {
namespace {

using layout::SortPair;
using layout::SplatParticle;

std::uint64_t wide(const SortPair& pair) { return std::uint64_t{pair.key} << 32 | pair.index; }

std::vector<SortPair> pairsWithKeys(std::size_t count, auto&& key) {
  std::vector<SortPair> pairs(count);
  for (std::size_t i = 0; i < count; ++i) pairs[i] = {static_cast<std::uint32_t>(i), key(i)};
  return pairs;
}

std::vector<SortPair> randomPairs(std::size_t count, std::uint32_t differentKeys) {
  return pairsWithKeys(
      count, [&](std::size_t i) { return static_cast<std::uint32_t>(hashBits(count, i) >> 33) % differentKeys; });
}

std::vector<std::uint32_t> stableOrder(const std::vector<SortPair>& pairs) {
  std::vector<std::uint32_t> order(pairs.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return pairs[a].key < pairs[b].key; });
  return order;
}

class SortTest : public GpuTest {
 protected:
  /// Sorts on the device and expects the order of std::stable_sort, from the pairs and from the extracted indices.
  void expectSortsLikeTheHost(const std::vector<SortPair>& pairs, std::uint32_t log2Elements = 0) {
    const auto count = static_cast<std::uint32_t>(pairs.size());
    SCOPED_TRACE(::testing::Message() << count << " pairs, 2^" << log2Elements << " an invocation");
    const SortPass sort(device(), log2Elements);
    const Buffer buffer = device().createBuffer(SortPass::pairBytes(count));
    const Buffer indices = device().createBuffer(std::uint64_t{count} * 4);
    device().upload(buffer, std::span(pairs));
    device().run([&](CommandBuffer& commands) {
      sort.record(commands, buffer, count);
      sort.recordExtract(commands, buffer, count, indices);
    });
    const std::vector<SortPair> sorted = device().download<SortPair>(buffer, count);
    const std::vector<std::uint32_t> expected = stableOrder(pairs);
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(sorted[i].index, expected[i]) << "at " << i;
      ASSERT_EQ(sorted[i].key, pairs[expected[i]].key) << "at " << i;
    }
    EXPECT_EQ(device().download<std::uint32_t>(indices, count), expected);
  }
};

TEST_F(SortTest, SortsEverySizeUpTo300) {
  // Every remainder modulo every block of the network up to 256 is among them.
  const SortPass sort(device());
  for (std::uint32_t count = 0; count <= 300; ++count) {
    std::vector<SortPair> pairs = randomPairs(count, 50);
    const Buffer buffer = device().createBuffer(SortPass::pairBytes(count));
    device().upload(buffer, std::span<const SortPair>(pairs));
    device().run([&](CommandBuffer& commands) { sort.record(commands, buffer, count); });
    const std::vector<SortPair> sorted = device().download<SortPair>(buffer, count);
    const std::vector<std::uint32_t> expected = stableOrder(pairs);
    for (std::uint32_t i = 0; i < count; ++i) ASSERT_EQ(sorted[i].index, expected[i]) << "at " << i << " of " << count;
  }
}

TEST_F(SortTest, SortsSizesAroundPowersOfTwo) {
  for (std::size_t count : {0, 1, 2, 3, 1023, 1024, 1025, 4095, 4096, 4097, 65535, 65537})
    expectSortsLikeTheHost(randomPairs(count, ~0u));
}

TEST_F(SortTest, SortsAMillionAndOne) { expectSortsLikeTheHost(randomPairs(1'000'001, ~0u)); }

TEST_F(SortTest, SortsSixteenMillion) {
  const std::uint32_t count = 1u << 24;
  const std::vector<SortPair> pairs = randomPairs(count, ~0u);
  const SortPass sort(device());
  const Buffer buffer = device().createBuffer(SortPass::pairBytes(count));
  device().upload(buffer, std::span(pairs));
  device().run([&](CommandBuffer& commands) { sort.record(commands, buffer, count); });
  const std::vector<SortPair> sorted = device().download<SortPair>(buffer, count);
  // Strictly ascending numbers of which each was there: the one order.
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < count; ++i)
    wrong += sorted[i].index >= count || sorted[i].key != pairs[sorted[i].index].key ||
             (i > 0 && wide(sorted[i - 1]) >= wide(sorted[i]));
  EXPECT_EQ(wrong, 0u);
}

TEST_F(SortTest, SortsRandomSizes) {
  for (std::uint64_t trial = 0; trial < 12; ++trial)
    expectSortsLikeTheHost(randomPairs(hashBits(7, trial) % 50'000, 1000));
}

TEST_F(SortTest, SortsWithAnyNumberOfPairsAnInvocation) {
  for (std::uint32_t log2Elements = 1; log2Elements <= 5; ++log2Elements)
    expectSortsLikeTheHost(randomPairs(5'003, 300), log2Elements);
}

TEST_F(SortTest, KeepsEqualKeysInIndexOrder) {
  expectSortsLikeTheHost(pairsWithKeys(10'000, [](std::size_t) { return 5u; }));
  expectSortsLikeTheHost(pairsWithKeys(10'000, [](std::size_t) { return ~0u; }));  // the key of the end marker
}

TEST_F(SortTest, LeavesSortedPairsAndTurnsReversedOnes) {
  expectSortsLikeTheHost(pairsWithKeys(10'001, [](std::size_t i) { return static_cast<std::uint32_t>(i); }));
  expectSortsLikeTheHost(pairsWithKeys(10'001, [](std::size_t i) { return static_cast<std::uint32_t>(10'001 - i); }));
}

TEST_F(SortTest, LeavesWhatStandsBehindTheEndMarker) {
  const std::uint32_t count = 1000;
  std::vector<SortPair> pairs = randomPairs(3000, ~0u);
  const Buffer buffer = device().createBufferWith(std::span<const SortPair>(pairs));
  const SortPass sort(device());
  device().run([&](CommandBuffer& commands) { sort.record(commands, buffer, count); });
  const std::vector<SortPair> after = device().download<SortPair>(buffer, pairs.size());
  for (std::size_t i = count + 1; i < pairs.size(); ++i) ASSERT_EQ(wide(after[i]), wide(pairs[i])) << "at " << i;
}

float flushed(float x) { return std::abs(x) < std::numeric_limits<float>::min() ? 0.0f : x; }

std::uint32_t referenceKey(const vec3& particle, const vec3& camera, float scale) {
  float squares[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float difference = flushed(flushed(particle[axis]) - flushed(camera[axis]));
    const float scaled = difference * scale;
    squares[axis] = flushed(scaled * scaled);
  }
  const float sum = (squares[0] + squares[1]) + squares[2];
  return ~std::bit_cast<std::uint32_t>(std::min(sum, std::numeric_limits<float>::max()));
}

class DepthKeyTest : public GpuTest {
 protected:
  void expectKeys(const std::vector<SplatParticle>& particles, const vec3& camera, float scale) {
    const auto count = static_cast<std::uint32_t>(particles.size());
    const Buffer in = device().createBufferWith(std::span(particles));
    const Buffer out = device().createBuffer(SortPass::pairBytes(count));
    const DepthKeyPass keys(device());
    device().run([&](CommandBuffer& commands) { keys.record(commands, in, count, camera, scale, out); });
    const std::vector<SortPair> pairs = device().download<SortPair>(out, count);
    for (std::uint32_t i = 0; i < count; ++i) {
      ASSERT_EQ(pairs[i].index, i);
      const vec3& p = particles[i].position;
      ASSERT_EQ(pairs[i].key, depthKey(p, camera, scale)) << "particle " << i;
      ASSERT_EQ(pairs[i].key, referenceKey(p, camera, scale))
          << "particle " << i << " at " << p.x << " " << p.y << " " << p.z;
    }
  }
};

// Powers of ten over the whole range of float, both zeros, denormals and the ends of the range.
std::vector<float> extremeNumbers() {
  std::vector<float> numbers{
      0.0f, -0.0f, 1e-45f, -1e-45f, 1e-39f, std::numeric_limits<float>::min(), 3.40282347e+38f, -3.40282347e+38f};
  for (int exponent = -38; exponent <= 38; ++exponent)
    numbers.push_back(std::pow(10.0f, static_cast<float>(exponent)) * (exponent % 2 ? 1.0f : -1.0f));
  return numbers;
}

std::vector<SplatParticle> extremeParticles() {
  std::vector<SplatParticle> particles;
  const std::vector<float> numbers = extremeNumbers();
  for (std::size_t i = 0; i < 20'000; ++i) {
    SplatParticle particle{};
    for (int axis = 0; axis < 3; ++axis)
      particle.position[axis] = numbers[hashBits(3, i, static_cast<std::uint64_t>(axis)) % numbers.size()];
    particles.push_back(particle);
  }
  return particles;
}

TEST_F(DepthKeyTest, KeysAreBitEqualToTheHostOnARandomCloud) {
  std::vector<SplatParticle> particles(100'000);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    Random random(11, i);
    for (int axis = 0; axis < 3; ++axis) particles[i].position[axis] = static_cast<float>(random.uniform(-30, 50));
  }
  expectKeys(particles, {3.25f, -17.125f, 80.3f}, 0x1p-7f);
}

TEST_F(DepthKeyTest, KeysAreBitEqualToTheHostAtTheEndsOfFloat) {
  for (const vec3& camera : {vec3(0), vec3(-0.0f, 1e-40f, 2e-38f), vec3(1, -2, 3), vec3(1e38f, -3e38f, 0)})
    for (float scale : {1.0f, 0x1p-126f, 0x1p-64f, 0x1p64f, 0x1p120f}) expectKeys(extremeParticles(), camera, scale);
}

TEST_F(DepthKeyTest, OrderFromDistancesIsThatOfStableSort) {
  const std::vector<SplatParticle> particles = extremeParticles();
  const auto count = static_cast<std::uint32_t>(particles.size());
  const vec3 camera(0, -0.0f, 1e-39f);
  const float scale = 0x1p-40f;  // tiny distances vanish, huge ones saturate: many equal keys at both ends
  const Buffer in = device().createBufferWith(std::span<const SplatParticle>(particles));
  const Buffer pairs = device().createBuffer(SortPass::pairBytes(count));
  const Buffer indices = device().createBuffer(std::uint64_t{count} * 4);
  const DepthKeyPass keys(device());
  const SortPass sort(device());
  TimestampQueries times = device().createTimestampQueries(2);
  device().run([&](CommandBuffer& commands) {
    const std::uint32_t keySpan = times.begin(commands, "depth keys");
    keys.record(commands, in, count, camera, scale, pairs);
    times.end(commands, keySpan);
    const std::uint32_t sortSpan = times.begin(commands, "sort");
    sort.record(commands, pairs, count);
    sort.recordExtract(commands, pairs, count, indices);
    times.end(commands, sortSpan);
  });
  std::vector<std::uint32_t> expected(count);
  std::iota(expected.begin(), expected.end(), 0u);
  const auto key = [&](std::uint32_t i) { return referenceKey(particles[i].position, camera, scale); };
  std::stable_sort(expected.begin(), expected.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  EXPECT_EQ(device().download<std::uint32_t>(indices, count), expected);
  // Back to front: the keys at the ends are those of the greatest and of no distance.
  EXPECT_EQ(key(expected.front()), ~std::bit_cast<std::uint32_t>(std::numeric_limits<float>::max()));
  EXPECT_EQ(key(expected.back()), ~0u);

  const std::vector<StageTime> stages = times.results();
  ASSERT_EQ(stages.size(), 2u);
  EXPECT_EQ(stages[0].stage, "depth keys");
  EXPECT_EQ(stages[1].stage, "sort");
  for (const StageTime& stage : stages) {
    EXPECT_GT(stage.seconds, 0) << stage.stage;
    EXPECT_LT(stage.seconds, 60) << stage.stage;  // a wrong unit would be off by 10³ or more
  }
}

}  // namespace
}  // namespace mote
