// The compute shader against the host, particle by particle, under every rule.
#include <cmath>

#include "engine/passes/light_pass.h"
#include "host/core/random.h"
#include "host/lighting/level_of_detail.h"
#include "host/lighting/medium.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/support/lights.h"

namespace mote {
namespace {

constexpr layout::uint kFalloffs[] = {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere};
constexpr layout::uint kEndpoints[] = {layout::kEndpointSoft, layout::kEndpointClamp};

/// Uniform in the unit ball with log-uniform radii, some at equal positions, one at `light`.
Octree ballTree(std::size_t count, double least, double greatest, double opticalDepth, layout::uint falloff,
                const vec3& light, const vec3& centre = vec3(0)) {
  std::vector<vec3> position;
  std::vector<float> radius, density;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(21, i);
    position.emplace_back(centre + vec3(random.direction() * std::cbrt(random.uniform())));
    radius.push_back(static_cast<float>(least * std::pow(greatest / least, random.uniform())));
    density.push_back(static_cast<float>(opticalDepth * 4.0 / 3.0 * kPi / static_cast<double>(count)));
    if (i % 50 == 1) position[i] = position[i - 1];
  }
  if (count > 10) position[7] = light;
  return buildOctree(position, radius, peakOpticalDepths(density, radius, falloff, true, 1));
}

/// Green and blue of their own for each particle.
void colour(Octree& tree) {
  tree.peakGreen = tree.peakBlue = tree.peak;
  for (std::size_t slot = 0; slot < tree.particleCount(); ++slot) {
    Random random(31, slot);
    tree.peakGreen[slot] *= static_cast<float>(random.uniform(0, 2));
    tree.peakBlue[slot] *= static_cast<float>(random.uniform(0, 0.2));
  }
}

class LightPassTest : public GpuTest {
 protected:
  double worstTransmittance(const Octree& tree, const layout::Light& light, layout::uint falloff, layout::uint endpoint,
                            float cutoff) {
    LightPass pass(device(), falloff, endpoint);
    pass.setTree(tree);
    const std::vector<float> onDevice = transmittances(pass.opticalDepths(light, {falloff, endpoint, cutoff}), light);
    const std::vector<float> onHost = transmittances(opticalDepths(tree, light, {falloff, endpoint, cutoff}), light);
    EXPECT_EQ(onDevice.size(), onHost.size());
    double worst = 0;
    for (std::size_t i = 0; i < onHost.size(); ++i) {
      const double delta = std::abs(double(onDevice[i]) - double(onHost[i]));
      worst = std::isfinite(onDevice[i]) ? std::max(worst, delta) : INFINITY;
    }
    return worst;
  }
};

TEST_F(LightPassTest, AgreesWithTheHostUnderEveryRule) {
  const vec3 inside(0.2f, 0.1f, -0.3f);
  double worst = 0;
  for (const layout::uint falloff : kFalloffs) {
    const Octree tree = ballTree(5000, 0.05, 0.15, 2, falloff, inside);
    for (const layout::uint endpoint : kEndpoints)
      for (const layout::Light& light :
           {pointLight(inside), pointLight({2, 3, 1}), directionalLight({0, -1, -0.3f}), directionalLight({0, 0, 1})})
        worst = std::max(worst, worstTransmittance(tree, light, falloff, endpoint, 0));
  }
  std::printf("worst |dT| with cutoff 0: %.2e\n", worst);
  EXPECT_LE(worst, 2e-5);
}

TEST(LightPassMemory, WhatNothingWroteDoesNotCount) {
  // Floats of the bits 0xfefefefe are −1.7e38: with the near-light list empty, a share of its entry would be infinite.
  const Octree tree = ballTree(250, 0.2, 0.3, 4, layout::kFalloffSmooth, vec3(0));
  const layout::Light light = pointLight({2, 3, 1});
  const std::vector<float> onHost = opticalDepths(tree, light, {});
  for (const std::uint8_t fill : {0x00, 0x7f, 0xfe, 0xff}) {
    const Gpu gpu(DeviceOptions{.validate = true, .fill = fill});
    {
      LightPass pass(gpu.device(), layout::kFalloffSmooth, layout::kEndpointSoft);
      pass.setTree(tree);
      const std::vector<float> onDevice = pass.opticalDepths(light, {});
      ASSERT_EQ(onDevice.size(), onHost.size());
      for (std::size_t k = 0; k < onHost.size(); ++k)
        ASSERT_NEAR(onDevice[k], onHost[k], 2e-5) << k << " fill " << +fill;
    }
    EXPECT_EQ(gpu.validationMessages(), std::vector<std::string>{});
  }
}

TEST_F(LightPassTest, AgreesForRadiiOverThreeDecades) {
  double worst = 0;
  for (const layout::uint falloff : kFalloffs) {
    const Octree tree = ballTree(5000, 0.0006, 0.6, 0.01, falloff, {0, 0, 0});
    worst = std::max(worst, worstTransmittance(tree, pointLight({2, 3, 1}), falloff, layout::kEndpointSoft, 0));
    worst = std::max(worst, worstTransmittance(tree, pointLight({0, 0, 0}), falloff, layout::kEndpointClamp, 0));
  }
  std::printf("worst |dT| for radii 1000:1: %.2e\n", worst);
  EXPECT_LE(worst, 2e-5);
}

TEST_F(LightPassTest, AgreesInThreeColoursFromWithinAndFarFromTheOrigin) {
  double worst = 0;
  for (const vec3& centre : {vec3(0), vec3(1000, -2000, 500)}) {
    const vec3 inside = centre + vec3(0.2f, 0.1f, -0.3f);
    Octree tree = ballTree(20000, 0.02, 0.2, 2, layout::kFalloffSmooth, inside, centre);
    colour(tree);
    for (const layout::Light& light :
         {pointLight(inside), pointLight(centre + vec3(0, 4, 0)), directionalLight({0.3f, -1, 0.2f})})
      worst = std::max(worst, worstTransmittance(tree, light, layout::kFalloffSmooth, layout::kEndpointSoft, 0));
  }
  std::printf("worst |dT| in RGB, radii 10:1, also far from the origin: %.2e\n", worst);
  EXPECT_LE(worst, 2e-5);
}

TEST_F(LightPassTest, GivesTheSameBitsEveryTime) {
  const Octree tree = ballTree(20000, 0.05, 0.2, 4, layout::kFalloffSmooth, {0, 0, 0});
  LightPass pass(device(), layout::kFalloffSmooth, layout::kEndpointSoft);
  pass.setTree(tree);
  const std::vector<float> first = pass.opticalDepths(pointLight({2, 3, 1}), {});
  for (int again = 0; again < 3; ++again) EXPECT_EQ(pass.opticalDepths(pointLight({2, 3, 1}), {}), first);
}

TEST_F(LightPassTest, StopsEarlyWithinTheCutoff) {
  const Octree tree = ballTree(20000, 0.05, 0.05, 30, layout::kFalloffSmooth, {0, 0, 0});
  // Where both stop, both transmittances lie between the true one and the cutoff.
  EXPECT_LE(worstTransmittance(tree, directionalLight({0, -1, 0}), 0, 0, 1e-4f), 1e-4);
  EXPECT_LE(worstTransmittance(tree, directionalLight({0, -1, 0}), 0, 0, 0.1f), 0.1);
}

TEST_F(LightPassTest, TakesAnyNumberOfParticles) {
  for (const std::size_t count : {1, 2, 3, 63, 64, 65, 255, 256, 257, 1000})
    EXPECT_LE(worstTransmittance(ballTree(count, 0.2, 0.4, 1, 0, {0, 0, 0}), pointLight({0, 2, 0}), 0, 0, 0), 2e-5)
        << count;
}

TEST_F(LightPassTest, GivesNothingForNoParticlesAndZerosWithoutShadows) {
  LightPass pass(device(), 0, 0);
  const Octree empty = buildOctree({}, {}, {});
  pass.setTree(empty);
  EXPECT_TRUE(pass.opticalDepths(pointLight({0, 1, 0}), {}).empty());
  const Octree tree = ballTree(100, 0.2, 0.4, 1, 0, {0, 0, 0});
  pass.setTree(tree);
  layout::Light light = pointLight({0, 1, 0});
  light.castsShadows = 0;
  EXPECT_EQ(pass.opticalDepths(light, {}), std::vector<float>(100, 0.0f));
}

TEST_F(LightPassTest, LightsAnyPointsInThreeColoursAndOnlyThoseReached) {
  const Octree grey = ballTree(5000, 0.05, 0.15, 2, layout::kFalloffSmooth, {0.2f, 0.1f, -0.3f});
  Octree tree = grey;
  colour(tree);
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> self;
  std::vector<std::uint8_t> reached;
  for (std::size_t slot = 0; slot < tree.particleCount(); ++slot) {
    Random random(32, slot);
    // Every other receiver is the slot's particle, the rest are points of no particle, some far outside.
    const bool particle = slot % 2 == 0;
    const vec3 point = particle ? tree.position(slot) : vec3(random.direction() * random.uniform(0, 20));
    x.push_back(point.x), y.push_back(point.y), z.push_back(point.z);
    self.push_back(particle ? static_cast<std::uint32_t>(slot) : kNoSlot);
    reached.push_back(random.uniform() < 0.7 ? 1 : 0);
  }
  const Receivers receivers{x, y, z, self};
  layout::Light spot = pointLight({2, 3, 1});
  spot.type = layout::kLightSpot;
  double worst = 0;
  for (const Octree* in : {&grey, static_cast<const Octree*>(&tree)})
    for (const layout::Light& light : {spot, directionalLight({0.2f, -1, 0.1f})}) {
      const LightingOptions options{.cutoff = 0};
      LightPass pass(device(), options.falloff, options.endpoint);
      pass.setTree(*in);
      const std::vector<float> onDevice = pass.opticalDepths(receivers, light, options, reached);
      const std::vector<float> onHost = opticalDepths(*in, receivers, light, options, reached);
      ASSERT_EQ(onDevice.size(), in->channels() * receivers.size());
      ASSERT_EQ(onHost.size(), onDevice.size());
      for (std::size_t i = 0; i < onHost.size(); ++i) {
        worst = std::max(worst, std::abs(std::exp(-double(onHost[i])) - std::exp(-double(onDevice[i]))));
        if (reached[i % reached.size()] == 0) {
          ASSERT_EQ(onDevice[i], 0);
        }
      }
    }
  std::printf("worst |dT| of any receivers, grey and RGB: %.2e\n", worst);
  EXPECT_LE(worst, 2e-5);
}

TEST_F(LightPassTest, AgreesWithTheHostInLevelOfDetail) {
  const vec3 inside(0.2f, 0.1f, -0.3f);
  double worst = 0;
  for (const bool colours : {false, true})
    for (const layout::uint endpoint : kEndpoints) {
      Octree tree = ballTree(20000, 0.2, 0.3, 2, layout::kFalloffSmooth, inside);
      if (colours) colour(tree);
      const DetailTree detail(tree, nodeSums(tree), {.tolerance = 0.05});
      ASSERT_LE(detail.tree().particleCount(), tree.particleCount() / 2);
      LightPass pass(device(), layout::kFalloffSmooth, endpoint);
      pass.setTree(detail.tree());
      const auto onDevice = [&](const Octree&, const auto&... rest) { return pass.opticalDepths(rest...); };
      const LightingOptions options{.endpoint = endpoint, .cutoff = 0};
      for (const layout::Light& light : {pointLight(inside), pointLight({2, 3, 1}), directionalLight({0, -1, -0.3f})}) {
        const std::vector<float> host = lodOpticalDepths(detail, slotsOf(tree), light, options),
                                 found = lodOpticalDepths(detail, slotsOf(tree), light, options, onDevice);
        ASSERT_EQ(found.size(), host.size());
        for (std::size_t i = 0; i < host.size(); ++i)
          worst = std::max(worst, std::abs(std::exp(-double(host[i])) - std::exp(-double(found[i]))));
      }
    }
  std::printf("worst |dT| in level of detail: %.2e\n", worst);
  EXPECT_LE(worst, 2e-5);
}

TEST_F(LightPassTest, GoesOnWhereTheListOfAColumnIsFull) {
  const Octree tree = ballTree(20000, 0.2, 0.2, 2, 0, {0, 0, 0});
  EXPECT_LE(worstTransmittance(tree, pointLight({0, 6, 0}), 0, layout::kEndpointSoft, 0), 2e-5);
  EXPECT_LE(worstTransmittance(tree, directionalLight({0, 0, 1}), 0, layout::kEndpointSoft, 0), 2e-5);
  // Nearly all are near this one, in the list's other end.
  EXPECT_LE(worstTransmittance(tree, pointLight({0, 0, 0}), 0, layout::kEndpointClamp, 0), 2e-5);
}

TEST_F(LightPassTest, SplitsMoreRaysThanOneSubmissionTakes) {
  const Octree tree = ballTree(150000, 0.02, 0.02, 2, 0, {0, 0, 0});
  EXPECT_LE(worstTransmittance(tree, pointLight({3, 0, 0}), 0, 0, 1e-4f), 1e-4);
}

}  // namespace
}  // namespace mote
