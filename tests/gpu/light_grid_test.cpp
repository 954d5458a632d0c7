// The light grid in compute against the one on the host, receiver by receiver, in every case that either treats apart.
#include <cmath>

#include "engine/passes/light_grid_pass.h"
#include "host/core/error.h"
#include "host/core/random.h"
#include "host/lighting/medium.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/small_device.h"
#include "tests/support/lights.h"

namespace mote {
namespace {

constexpr layout::uint kFalloffs[] = {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere};
constexpr double kRounding = 2e-5;  // |ΔT|, as everywhere between host and device

/// Uniform in the unit ball with log-uniform radii, one at `light`; lines through the ball have an optical depth of
/// about twice the given one.
Octree ballTree(std::size_t count, double least, double greatest, double opticalDepth, layout::uint falloff,
                bool colours = false, const vec3& light = vec3(0)) {
  std::vector<vec3> position;
  std::vector<float> radius, density;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(41, i);
    position.emplace_back(random.direction() * std::cbrt(random.uniform()));
    radius.push_back(static_cast<float>(least * std::pow(greatest / least, random.uniform())));
    density.push_back(static_cast<float>(opticalDepth * 4.0 / 3.0 * kPi / static_cast<double>(count)));
  }
  if (count > 10) position[7] = light;
  Octree tree = buildOctree(position, radius, peakOpticalDepths(density, radius, falloff, true, 1));
  if (!colours) return tree;
  tree.peakGreen = tree.peakBlue = tree.peak;
  for (std::size_t slot = 0; slot < tree.particleCount(); ++slot) {
    Random random(42, slot);
    tree.peakGreen[slot] *= static_cast<float>(random.uniform(0, 2));
    tree.peakBlue[slot] *= static_cast<float>(random.uniform(0, 0.2));
  }
  return tree;
}

class LightGridPassTest : public GpuTest {
 protected:
  /// Of the transmittances; infinite where one is not a number, or where receivers out of reach are not left alone.
  double worst(const Octree& tree, const Receivers& receivers, const layout::Light& light, layout::uint falloff,
               const GridResolution& resolution, std::span<const std::uint8_t> reached = {}) {
    LightGridPass pass(device());
    const LightingOptions options{.falloff = falloff};
    const std::vector<float> onDevice = pass.opticalDepths(tree, receivers, light, options, resolution, reached);
    const std::vector<float> onHost = gridOpticalDepths(tree, receivers, light, options, resolution, reached);
    EXPECT_EQ(onDevice.size(), tree.channels() * receivers.size());
    EXPECT_EQ(onHost.size(), onDevice.size());
    double worst = 0, dark = 0;
    for (std::size_t i = 0; i < onHost.size(); ++i) {
      const double delta = std::abs(std::exp(-double(onDevice[i])) - std::exp(-double(onHost[i])));
      worst = std::isfinite(onDevice[i]) ? std::max(worst, delta) : INFINITY;
      dark += 1 - std::exp(-double(onHost[i]));
      if (!reached.empty() && reached[i % receivers.size()] == 0 && onDevice[i] != 0) worst = INFINITY;
    }
    EXPECT_GT(dark, 0.01 * static_cast<double>(onHost.size()));  // there is something to compare
    return worst;
  }
  double worst(const Octree& tree, const layout::Light& light, layout::uint falloff, const GridResolution& resolution) {
    return worst(tree, slotsOf(tree), light, falloff, resolution);
  }
};

TEST_F(LightGridPassTest, AgreesWithTheHostUnderADirectionalLight) {
  const Octree tree = ballTree(20000, 0.05, 0.05, 2, layout::kFalloffSmooth);
  for (const double radii : {1.0, 0.35, 0.15}) {
    const double found = worst(tree, directionalLight({0.3f, -1, 0.2f}), 0, {0.05 * radii, 0.1 * radii});
    std::printf("cells of %.2f radii: worst |dT| %.2e\n", radii, found);
    EXPECT_LE(found, kRounding);
  }
}

TEST_F(LightGridPassTest, AgreesWithTheHostForEveryLightAndFalloff) {
  const vec3 inside(0.2f, 0.1f, -0.3f);
  double found = 0;
  for (const bool colours : {false, true})
    for (const layout::uint falloff : kFalloffs) {
      const Octree tree = ballTree(10000, 0.04, 0.08, 2, falloff, colours, inside);
      for (const layout::Light& light : {pointLight(inside), pointLight({2, 3, 1}), directionalLight({0, -1, -0.3f})})
        for (const double radii : {1.2, 0.5}) {
          const double distance = light.type == layout::kLightDirectional ? 1 : 1.5;
          found = std::max(found, worst(tree, light, falloff, {0.06 * radii / distance, 0.12 * radii}));
        }
    }
  std::printf("worst |dT| in grey and RGB: %.2e\n", found);
  EXPECT_LE(found, kRounding);
}

TEST_F(LightGridPassTest, AgreesForRadiiOverTwoDecades) {
  double found = 0;
  for (const layout::uint falloff : kFalloffs) {
    const Octree tree = ballTree(10000, 0.005, 0.5, 0.1, falloff, false, {0, 0, 0});
    found = std::max(found, worst(tree, directionalLight({0, 0, 1}), falloff, {0.01, 0.02}));
    found = std::max(found, worst(tree, pointLight({0, 4, 0}), falloff, {0.01, 0.1}));
    found = std::max(found, worst(tree, pointLight({0, 0, 0}), falloff, {0.02, 0.02}));
  }
  std::printf("worst |dT| for radii 100:1: %.2e\n", found);
  EXPECT_LE(found, kRounding);
}

TEST_F(LightGridPassTest, LightsAnyPointsAndOnlyThoseReached) {
  double found = 0;
  for (const bool colours : {false, true}) {
    const Octree tree = ballTree(10000, 0.05, 0.1, 2, layout::kFalloffSmooth, colours);
    std::vector<float> x, y, z;
    std::vector<std::uint32_t> self;
    std::vector<std::uint8_t> reached;
    for (std::size_t slot = 0; slot < tree.particleCount(); ++slot) {
      Random random(43, slot);
      // Every other receiver is the slot's particle, the rest are points of no particle, some far outside.
      const bool particle = slot % 2 == 0;
      const vec3 point = particle ? tree.position(slot) : vec3(random.direction() * random.uniform(0, 20));
      x.push_back(point.x), y.push_back(point.y), z.push_back(point.z);
      self.push_back(particle ? static_cast<std::uint32_t>(slot) : kNoSlot);
      reached.push_back(random.uniform() < 0.7 ? 1 : 0);
    }
    layout::Light spot = pointLight({1, 1.5f, 0.5f});
    spot.type = layout::kLightSpot;
    for (const layout::Light& light : {spot, directionalLight({0.2f, -1, 0.1f}), pointLight({0, 0, 0})}) {
      found = std::max(found, worst(tree, {x, y, z, self}, light, 0, {0.05, 0.1}, reached));
      found = std::max(found, worst(tree, slotsOf(tree), light, 0, {0.05, 0.1}, reached));
    }
  }
  std::printf("worst |dT| of any receivers: %.2e\n", found);
  EXPECT_LE(found, kRounding);
}

TEST_F(LightGridPassTest, GoesOnWhereMoreParticlesMeetThanAShaderMayLoopOver) {
  // Cells as large as this put all into a few blocks, and lavapipe ends a shader's loops after 65,535.
  const Octree tree = ballTree(700000, 0.02, 0.02, 2, layout::kFalloffSmooth);
  const double found = worst(tree, directionalLight({0, 0, 1}), 0, {5, 5});
  const double few = worst(tree, directionalLight({0, 0, 1}), 0, {5, 0.3});
  // Here few blocks have more than kMostWorkEntries, but all of a strand do.
  const double many = worst(tree, directionalLight({0, 0, 1}), 0, {5, 0.005});
  std::printf("worst |dT| of 700,000 in a block: %.2e, in a few: %.2e, in many: %.2e\n", found, few, many);
  EXPECT_LE(found, kRounding);
  EXPECT_LE(few, kRounding);
  EXPECT_LE(many, kRounding);
}

TEST_F(LightGridPassTest, GivesTheSameBitsEveryTime) {
  const Octree tree = ballTree(20000, 0.05, 0.2, 4, layout::kFalloffSmooth);
  LightGridPass pass(device());
  const auto once = [&] { return pass.opticalDepths(tree, slotsOf(tree), pointLight({2, 3, 1}), {}, {0.02, 0.1}); };
  const std::vector<float> first = once();
  EXPECT_GT(pass.deviceSeconds(), 0);
  pass.release();
  for (int again = 0; again < 3; ++again) EXPECT_EQ(once(), first);
}

TEST_F(LightGridPassTest, SplitsTilesThatDoNotFitToTheSameBits) {
  // Few cells: each face of the cube is a tile, with all kinds of kernels about the light, or the ball is but one. In
  // the third grid more particles than kMostWorkEntries meet in a block, in the fourth many blocks stand behind one
  // another.
  struct Case {
    layout::Light light;
    GridResolution resolution;
    std::size_t count;
    bool colours;
    std::uint64_t bytes;  // far less than a tile takes
  };
  const vec3 inside(0.2f, 0.1f, -0.3f);
  for (const Case& c : {Case{pointLight(inside), {0.06, 0.05}, 30000, false, 768u << 10},
                        Case{pointLight(inside), {0.06, 0.05}, 30000, true, 512u << 10},
                        Case{directionalLight({0, 0, 1}), {5, 0.3}, 100000, false, 2500u << 10},
                        Case{directionalLight({0, 0, 1}), {5, 0.004}, 200000, false, 2500u << 10},
                        Case{directionalLight({0.3f, -1, 0.2f}), {0.06, 0.002}, 30000, false, 512u << 10}}) {
    const Octree tree = ballTree(c.count, 0.02, 0.08, 2, layout::kFalloffSmooth, c.colours, inside);
    std::vector<float> x, y, z;
    std::vector<std::uint32_t> self;
    for (std::size_t slot = 0; slot < tree.particleCount(); slot += 3) {
      Random random(44, slot);
      const vec3 point = slot % 2 == 0 ? tree.position(slot) : vec3(random.direction() * random.uniform(0, 4));
      x.push_back(point.x), y.push_back(point.y), z.push_back(point.z);
      self.push_back(slot % 2 == 0 ? static_cast<std::uint32_t>(slot) : kNoSlot);
    }
    for (const Receivers& receivers : {slotsOf(tree), Receivers{x, y, z, self}}) {
      const auto lit = [&](const Device& device) {
        LightGridPass pass(device);
        return pass.opticalDepths(tree, receivers, c.light, {}, c.resolution);
      };
      const std::vector<float> whole = lit(device());
      for (const bool stageAlways : {false, true}) {
        const SmallDevice small(c.bytes, stageAlways);
        EXPECT_EQ(lit(small.device()), whole);
      }
    }
  }
}

TEST_F(LightGridPassTest, RefusesWhereNotEvenABlockFits) {
  const Octree tree = ballTree(20000, 0.05, 0.05, 2, layout::kFalloffSmooth);
  const Gpu least(DeviceOptions{.validate = true, .memory = {.bytes = 48u << 10}});
  LightGridPass pass(least.device());
  try {
    pass.opticalDepths(tree, slotsOf(tree), directionalLight({0, 0, 1}), {}, {0.1, 0.1});
    FAIL() << "nothing was refused";
  } catch (const MachineError& error) {
    EXPECT_NE(std::string(error.what()).find("49152"), std::string::npos) << error.what();
  }
}

TEST_F(LightGridPassTest, GivesZerosWithoutShadowsAndNothingForNoParticles) {
  LightGridPass pass(device());
  const Octree empty = buildOctree({}, {}, {});
  EXPECT_TRUE(pass.opticalDepths(empty, slotsOf(empty), pointLight({0, 1, 0}), {}, {0.1, 0.1}).empty());
  const Octree tree = ballTree(100, 0.2, 0.4, 1, 0);
  layout::Light light = pointLight({0, 1, 0});
  light.castsShadows = 0;
  EXPECT_EQ(pass.opticalDepths(tree, slotsOf(tree), light, {}, {0.1, 0.1}), std::vector<float>(100, 0.0f));
}

}  // namespace
}  // namespace mote
