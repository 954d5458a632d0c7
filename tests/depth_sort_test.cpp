// The depth key at the ends of float's range, and the order of particles against std::stable_sort.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

using layout::SplatCamera;
using layout::SplatParticle;
using layout::uint;

SplatCamera cameraAt(const vec3& position) {
  return makeSplatCamera(position, position - vec3(0, 0, 1), vec3(0, 1, 0), 40, 0.01f, 1000, 8, 8, 0);
}

std::vector<uint> identity(std::size_t count) {
  std::vector<uint> order(count);
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

// -------------------------------------------------------------------------------------------------------

TEST(DepthKey, FartherComesFirst) {
  const vec3 camera(1, 2, 3);
  uint last = depthKey(camera, camera, 1);
  EXPECT_EQ(last, 0xffffffffu);  // at the camera: distance 0, last of all
  for (float distance = 1e-15f; distance < 1e18f; distance *= 1.001f) {
    const uint key = depthKey(vec3(0, distance, 0), vec3(0), 1);
    EXPECT_LT(key, last) << distance;
    last = key;
  }
}

TEST(DepthKey, TinyAndHugeDistancesAndNegativeZeroHaveTheirPlace) {
  const uint here = depthKey(vec3(0), vec3(0), 1);
  EXPECT_EQ(depthKey(vec3(-0.0f), vec3(0.0f), 1), here);
  EXPECT_EQ(depthKey(vec3(1e-30f, 0, 0), vec3(0), 1), here);  // squared it would be denormal
  EXPECT_EQ(depthKey(vec3(1.0842022e-19f, 0, 0), vec3(0), 1),
            here - 0x00800000u);                                     // 2⁻⁶³: squared 2⁻¹²⁶, the least normal
  EXPECT_EQ(depthKey(vec3(0, 1e-39f, 0), vec3(0), 0x1p126f), here);  // a denormal position, whatever the scale
  // Beside a normal square a denormal one counts for nothing.
  EXPECT_EQ(depthKey(vec3(0x1p-60f, 0x1.8p-64f, 0x1.8p-64f), vec3(0), 1), depthKey(vec3(0x1p-60f, 0, 0), vec3(0), 1));
  const uint farthest = ~std::bit_cast<uint>(std::numeric_limits<float>::max());
  EXPECT_EQ(depthKey(vec3(1e30f, 0, 0), vec3(0), 1), farthest);
  EXPECT_EQ(depthKey(vec3(3e38f, 0, 0), vec3(-3e38f, 0, 0), 1), farthest);  // already the difference overflows
  EXPECT_LT(depthKey(vec3(1e30f, 0, 0), vec3(0), 0x1p-99f), depthKey(vec3(0.9e30f, 0, 0), vec3(0), 0x1p-99f));
}

TEST(DepthKey, ScaleIsThePowerOfTwoThatBringsTheFarthestCornerBelowOne) {
  for (double size = 1e-30; size < 1e38; size *= 13.7) {
    Bounds bounds;
    bounds.add(vec3(static_cast<float>(-0.4 * size)));
    bounds.add(vec3(static_cast<float>(0.3 * size), 0, static_cast<float>(0.5 * size)));
    const vec3 camera(0, 0, static_cast<float>(-0.7 * size));
    const float scale = depthKeyScale(bounds, camera);
    int exponent = 0;
    EXPECT_EQ(std::frexp(scale, &exponent), 0.5f) << size;  // a power of two
    const double farthest = std::sqrt(0.4 * 0.4 + 0.4 * 0.4 + 1.2 * 1.2) * size;
    EXPECT_GE(farthest * scale, 0.5 * (1 - 1e-6)) << size;
    EXPECT_LE(farthest * scale, 1 + 1e-6) << size;
  }
  EXPECT_EQ(depthKeyScale(Bounds{}, vec3(0)), 1.0f);
  Bounds point;
  point.add(vec3(2));
  EXPECT_EQ(depthKeyScale(point, vec3(2)), 1.0f);
}

TEST(SortByDepth, EqualsAStableSortByDistance) {
  const SplatCamera camera = cameraAt({0.5f, -1, 2});
  for (const std::size_t count : {0u, 1u, 2u, 3u, 1023u, 1024u, 1025u, 100000u}) {
    std::vector<SplatParticle> particles(count);
    for (std::size_t i = 0; i < count; ++i) {
      Random random(9, i / 3);  // threes at one position: ties
      particles[i].position = vec3(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
    }
    std::vector<uint> expected = identity(count);
    const auto distance = [&](uint i) {
      const vec3 e = particles[i].position - camera.position;
      return (e.x * e.x + e.y * e.y) + e.z * e.z;
    };
    std::stable_sort(expected.begin(), expected.end(), [&](uint a, uint b) { return distance(a) > distance(b); });
    // A power of two scales without rounding: the order is that of the unscaled distances.
    EXPECT_EQ(sortByDepth(particles, camera, 0x1p-4f), expected) << count;
    for (const unsigned threads : {1u, 2u}) {
      const ThreadLimit limit(threads);
      EXPECT_EQ(sortByDepth(particles, camera, 0x1p-4f), expected) << count;
    }
  }
}

TEST(SortByDepth, EqualDistancesKeepTheirOrder) {
  const SplatCamera camera = cameraAt(vec3(0));
  std::vector<SplatParticle> particles(5000);
  for (SplatParticle& p : particles) p.position = vec3(0, 0, -3);
  EXPECT_EQ(sortByDepth(particles, camera, 1), identity(5000));
}

}  // namespace
}  // namespace mote
