// Light at any points, from any kind of light, in one or three colours: against sums in double precision.
#include <gtest/gtest.h>

#include <cmath>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/core/simd_targets.h"
#include "host/lighting/exact/beams.h"
#include "host/lighting/irradiance.h"
#include "host/lighting/lighting.h"
#include "host/lighting/medium.h"
#include "tests/support/lighting_oracle.h"
#include "tests/support/lights.h"

namespace mote {
namespace {

layout::Light spotLight(const vec3& position, const vec3& target, double inner, double outer) {
  layout::Light light = pointLight(position);
  light.type = layout::kLightSpot;
  light.direction = glm::normalize(target - position);
  light.cosInner = static_cast<float>(std::cos(inner * kPi / 180));
  light.cosOuter = static_cast<float>(std::cos(outer * kPi / 180));
  return light;
}

/// A thousand particles whose optical depth differs from colour to colour, and points in and around them.
struct Scattered {
  Octree tree;
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> self;
  std::vector<std::uint8_t> reached;

  explicit Scattered(bool colored) {
    std::vector<vec3> position;
    std::vector<float> radius, peaks[3];
    for (std::size_t i = 0; i < 1000; ++i) {
      Random random(3, i);
      position.emplace_back(random.direction() * std::cbrt(random.uniform()));
      radius.push_back(static_cast<float>(random.uniform(0.05, 0.3)));
      for (auto& peak : peaks) peak.push_back(static_cast<float>(random.uniform(0, 0.05)));
    }
    tree = colored ? buildOctree({position, radius, peaks[0], peaks[1], peaks[2]})
                   : buildOctree(position, radius, peaks[0]);
    for (std::size_t k = 0; k < 777; ++k) {
      Random random(4, k);
      const bool particle = k % 3 == 0;
      const auto slot = static_cast<std::uint32_t>(random.bits() % 1000);
      const vec3 point = particle ? tree.position(slot) : vec3(random.direction() * random.uniform(0, 3));
      x.push_back(point.x), y.push_back(point.y), z.push_back(point.z);
      self.push_back(particle ? slot : kNoSlot);
      reached.push_back(random.uniform() < 0.6 ? 1 : 0);
    }
  }
  Receivers receivers() const { return {x, y, z, self}; }
  const std::vector<float>& peaks(std::size_t channel) const {
    return channel == 0 ? tree.peak : channel == 1 ? tree.peakGreen : tree.peakBlue;
  }
};

/// The definition, for one receiver and channel.
double oracle(const Scattered& s, std::size_t k, std::size_t channel, const layout::Light& light,
              const LightingOptions& options) {
  const dvec3 origin(s.receivers().position(k));
  dvec3 direction = -dvec3(light.direction);
  double length = INFINITY;
  if (light.type != layout::kLightDirectional) {
    direction = dvec3(light.position) - origin;
    length = glm::length(direction);
    direction /= length;
  }
  double depth = 0;
  for (std::size_t j = 0; j < s.tree.particleCount(); ++j)
    if (j != s.self[k])
      depth += s.peaks(channel)[j] * oracleShare(dvec3(s.tree.position(j)) - origin, direction, length,
                                                 s.tree.radius[j], options.falloff, options.endpoint);
  return depth;
}

TEST(Receivers, AnyPointGetsTheSumOfItsDefinitionInEveryColour) {
  double worst = 0;
  for (const bool colored : {false, true}) {
    const Scattered s(colored);
    for (const layout::uint falloff : {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere})
      for (const layout::uint endpoint : {layout::kEndpointSoft, layout::kEndpointClamp})
        for (const layout::Light& light :
             {spotLight({2, 2, 2}, {0, 0, 0}, 10, 20), pointLight({0.1f, 0, 0}), directionalLight({1, -1, 0})}) {
          const LightingOptions options{falloff, endpoint, 0};
          const std::vector<float> depths = opticalDepths(s.tree, s.receivers(), light, options, s.reached);
          ASSERT_EQ(depths.size(), s.tree.channels() * s.x.size());
          for (std::size_t channel = 0; channel < s.tree.channels(); ++channel)
            for (std::size_t k = 0; k < s.x.size(); ++k) {
              const float depth = depths[channel * s.x.size() + k];
              if (s.reached[k] == 0) {
                ASSERT_EQ(depth, 0);
                continue;
              }
              const double exact = oracle(s, k, channel, light, options);
              worst = std::max(worst, std::abs(std::exp(-exact) - std::exp(-double(depth))));
            }
        }
  }
  std::printf("worst |dT| at any point: %.2e\n", worst);
  // Sums of 1000 terms in single precision: 1e-6 of τ ≤ 5; a sphere's slope at its rim is infinite and adds the rest.
  EXPECT_LE(worst, 2e-5);
}

TEST(Receivers, ThreeColoursAreThreeGreySumsBitForBitOnEveryInstructionSet) {
  const Scattered s(true);
  const layout::Light light = spotLight({2, 2, 2}, {0, 0, 0}, 10, 20);
  for (const float cutoff : {0.0f, 1e-3f}) {
    const LightingOptions options{.cutoff = cutoff};
    const std::vector<float> scalar = opticalDepthsScalar(s.tree, s.receivers(), light, options, s.reached);
    for (const std::string& target : simdTargets()) {
      useSimdTarget(target);
      EXPECT_EQ(opticalDepths(s.tree, s.receivers(), light, options, s.reached), scalar) << target;
    }
    useSimdTarget("");
    if (cutoff > 0) continue;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      Octree grey = s.tree;
      grey.peak = s.peaks(channel);
      grey.peakGreen.clear(), grey.peakBlue.clear();
      const std::vector<float> one = opticalDepths(grey, s.receivers(), light, options, s.reached);
      EXPECT_TRUE(
          std::equal(one.begin(), one.end(), scalar.begin() + static_cast<std::ptrdiff_t>(channel * one.size())));
    }
  }
}

TEST(Receivers, TheSameForAnyNumberOfThreads) {
  const Scattered s(true);
  const auto once = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return opticalDepths(s.tree, s.receivers(), pointLight({2, 1, 0}), {}, s.reached);
  };
  EXPECT_EQ(once(1), once(2));
  EXPECT_EQ(once(1), once(7));
}

TEST(Receivers, OnlyThoseReachedHaveRays) {
  const Scattered s(false);
  const std::vector<std::uint32_t> order = planBeams(s.receivers(), pointLight({2, 1, 0}), s.reached, 0.1).receiver;
  std::vector<std::uint8_t> seen(s.x.size(), 0);
  for (const std::uint32_t k : order) ++seen[k];
  EXPECT_EQ(seen, s.reached);
}

TEST(Receivers, UniformColourNeedsOneSumAndKeepsTheCutoffInEveryColour) {
  const Scattered s(false);
  const layout::Light light = directionalLight({0, -1, 0});
  LightingOptions options{.cutoff = 0.05f};
  options.extinction = {0.2f, 1, 3};
  const std::size_t count = s.x.size();
  const std::vector<float> early =
      transmittances(opticalDepths(s.tree, s.receivers(), light, options), count, light, options.extinction);
  options.cutoff = 0;
  const std::vector<float> depths = opticalDepths(s.tree, s.receivers(), light, options);
  const std::vector<float> exact = transmittances(depths, count, light, options.extinction);
  ASSERT_EQ(depths.size(), count);
  ASSERT_EQ(exact.size(), 3 * count);
  for (std::size_t k = 0; k < count; ++k)
    for (int c = 0; c < 3; ++c) {
      ASSERT_NEAR(exact[c * count + k], std::exp(-options.extinction[c] * depths[k]), 1e-6);
      ASSERT_GE(early[c * count + k], exact[c * count + k] - 1e-6f);
      ASSERT_LE(early[c * count + k] - exact[c * count + k], 0.05f);
    }
}

TEST(Irradiance, SpotIsFullInsideNothingOutsideAndSmoothBetween) {
  const layout::Light light = spotLight({0, 0, 0}, {0, 0, -1}, 20, 40);
  const auto at = [&](double degrees) {
    const double angle = degrees * kPi / 180;
    return irradiance(light, vec3(3 * std::sin(angle), 0, -3 * std::cos(angle)), 0).x * 9;
  };
  EXPECT_NEAR(at(0), 1, 1e-6);
  EXPECT_NEAR(at(19.9), 1, 1e-6);
  EXPECT_EQ(at(40.1), 0);
  EXPECT_EQ(at(180), 0);
  // Half way in the cosine it is half.
  EXPECT_NEAR(at(std::acos((std::cos(20 * kPi / 180) + std::cos(40 * kPi / 180)) / 2) * 180 / kPi), 0.5, 1e-4);
  // No step in value or slope: at most the cubic's greatest slope, 1.5 / (cos 20° − cos 40°) · sin 40° = 5.6 a radian.
  for (double degrees = 15; degrees < 45; degrees += 0.1)
    EXPECT_LE(std::abs(at(degrees + 0.1) - at(degrees)), 5.7 * 0.1 * kPi / 180);
  EXPECT_TRUE(reaches(light, {0, 0, -5}));
  EXPECT_FALSE(reaches(light, {0, 0, 5}));
  EXPECT_FALSE(reaches(light, {5, 0, 0}));
}

TEST(Irradiance, AConeWithoutASoftRimIsAStep) {
  const layout::Light light = spotLight({0, 0, 0}, {0, 0, -1}, 30, 30);
  EXPECT_TRUE(reaches(light, {0.57f, 0, -1}));  // tan 30° = 0.577
  EXPECT_FALSE(reaches(light, {0.58f, 0, -1}));
  EXPECT_EQ(irradiance(light, {0.57f, 0, -1}, 0).x, irradiance(light, {0, 0.57f, -1}, 0).x);
}

TEST(InScattering, TakesPhaseAndColourIntoAccount) {
  const std::vector<float> x{0, 0}, y{0, 0}, z{0, -1}, radius{0.1f, 0.1f}, transmittance{1, 0.5f, 0.5f, 0.25f, 0, 1};
  const Receivers receivers{x, y, z, {}};
  const layout::Light light = directionalLight({0, 0, -1});
  // Seen from +x: the light turns by 90°.
  const Scattering scattering{{PhaseKind::HenyeyGreenstein, 0.5f},
                              {.eye = {0, 0, 0}, .parallel = true, .toCamera = {1, 0, 0}}};
  std::vector<vec3> radiance(2, vec3(0));
  addInScattering(receivers, radius, light, transmittance, scattering, radiance);
  const float phase = 0.75f / (4 * static_cast<float>(kPi) * std::pow(1.25f, 1.5f));
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(radiance[0][c], phase * transmittance[2 * c], 1e-6);
    EXPECT_NEAR(radiance[1][c], phase * transmittance[2 * c + 1], 1e-6);
  }
}

TEST(ColorExtinction, NeedsThreeSumsOnlyWhereTheRatioDiffers) {
  const std::vector<vec3> color{{1, 0.5f, 0}, {1, 0.5f, 0}}, same{{0, 0.1f, 1}, {0, 0.1f, 1}},
      other{{0, 0, 0}, {1, 1, 1}};
  EXPECT_TRUE(colorExtinction(color, vec3(1), {}, vec3(1), vec3(2)).grey());
  EXPECT_EQ(colorExtinction(color, vec3(1), {}, vec3(1), {1, 2, 3}).uniform, vec3(1, 2, 3));
  const ColorExtinction uniform = colorExtinction(color, vec3(1), same, vec3(0.5f), {1, 2, 3});
  EXPECT_TRUE(uniform.factor.empty());
  EXPECT_NEAR(uniform.uniform.y, (0.25f + 0.1f) * 2, 1e-6);
  EXPECT_FALSE(uniform.grey());
  const ColorExtinction varying = colorExtinction(color, vec3(1), other, vec3(1), vec3(1));
  ASSERT_EQ(varying.factor.size(), 2u);
  EXPECT_EQ(varying.of(1), vec3(2, 1.5f, 1));
  EXPECT_EQ(singleScatteringAlbedo({1, 0.5f, 0}, &other[1]), vec3(0.5f, 0.5f / 1.5f, 0));
  EXPECT_EQ(singleScatteringAlbedo({0, 0, 0}, &other[0]), vec3(0));
  EXPECT_EQ(singleScatteringAlbedo({1, 0.5f, 0}, nullptr), vec3(1, 0.5f, 0));
}

}  // namespace
}  // namespace mote
