// Exact lighting against the definition in double precision, and the promises about threads, instruction sets, cutoff.
#include "host/core/simd_targets.h"
#include "host/lighting/lighting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/lighting/exact/beam_kernel.h"
#include "host/lighting/exact/beams.h"
#include "host/lighting/medium.h"
#include "tests/support/lighting_oracle.h"
#include "tests/support/lights.h"

namespace mote {
namespace {

constexpr layout::uint kFalloffs[] = {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere};
constexpr layout::uint kEndpoints[] = {layout::kEndpointSoft, layout::kEndpointClamp};

struct Cloud {
  std::vector<vec3> position;
  std::vector<float> radius, density;
  Octree tree(layout::uint falloff, bool crossSection, double scale) const {
    return buildOctree(position, radius, peakOpticalDepths(density, radius, falloff, crossSection, scale));
  }
};

/// Uniform in the unit ball; radii from `least` to `greatest`, log-uniform.
Cloud ballCloud(std::size_t count, std::uint64_t seed, double least, double greatest) {
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    cloud.position.emplace_back(random.direction() * std::cbrt(random.uniform()));
    cloud.radius.push_back(static_cast<float>(least * std::pow(greatest / least, random.uniform())));
    cloud.density.push_back(static_cast<float>(random.uniform(0.2, 1.8)));
  }
  return cloud;
}

/// The hard cases in one cloud: radii over three decades, pairs at equal positions, particles at the light and near it.
Cloud hardCloud(const vec3& light) {
  Cloud cloud = ballCloud(2000, 11, 0.0006, 0.6);
  for (std::size_t i = 0; i < 100; ++i) cloud.position[2 * i + 1] = cloud.position[2 * i];
  cloud.position[500] = cloud.position[501] = light;
  for (std::size_t i = 502; i < 520; ++i) cloud.position[i] = light + 0.3f * cloud.radius[i] * cloud.position[i];
  return cloud;
}

double worstRelativeError(const Octree& tree, const layout::Light& light, const LightingOptions& options) {
  const std::vector<float> depths = opticalDepths(tree, light, options);
  const std::vector<double> expected = oracleOpticalDepths(tree, light, options.falloff, options.endpoint);
  double worst = 0;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const double error = std::abs(depths[i] - expected[i]);
    if (error > 0) worst = std::max(worst, expected[i] > 0 ? error / expected[i] : INFINITY);
  }
  return worst;
}

TEST(LightingOracle, EveryRuleAgreesForHardCloudsAndAllLights) {
  const vec3 inside(0.3f, -0.2f, 0.1f);
  const layout::Light lights[] = {pointLight(inside), pointLight({2, 3, 1}), directionalLight({0, -1, -0.3f}),
                                  directionalLight({1, 0, 0})};
  const Cloud cloud = hardCloud(inside);
  double worst = 0;
  for (const bool crossSection : {true, false})
    for (const layout::uint falloff : kFalloffs) {
      const Octree tree = cloud.tree(falloff, crossSection, crossSection ? 1e-4 : 0.01);
      for (const layout::uint endpoint : kEndpoints)
        for (const layout::Light& light : lights) {
          const double error = worstRelativeError(tree, light, {falloff, endpoint, 0});
          EXPECT_LE(error, 1e-4) << "falloff " << falloff << " endpoint " << endpoint << " light " << light.type
                                 << (crossSection ? " cross_section" : " peak");
          worst = std::max(worst, error);
        }
    }
  RecordProperty("worst_relative_error", std::to_string(worst));
  std::printf("worst relative error of optical depth: %.2e\n", worst);
}

TEST(LightingOracle, AgreesForEqualRadiiAndDenseNeighbourhoods) {
  const Cloud cloud = ballCloud(2000, 12, 0.15, 0.15);
  for (const layout::uint falloff : kFalloffs)
    for (const layout::uint endpoint : kEndpoints)
      EXPECT_LE(worstRelativeError(cloud.tree(falloff, true, 1e-3), pointLight({0, 4, 0}), {falloff, endpoint, 0}),
                1e-4);
}

/// A packet may start on both sides of a light among its receivers: what lies around those behind the light counts too.
TEST(LightingOracle, AgreesForLightsAmongTheParticles) {
  const Cloud cloud = ballCloud(20000, 16, 0.08, 0.09);
  const Octree tree = cloud.tree(layout::kFalloffSmooth, true, 1e-3);
  std::size_t compared = 0;
  for (int k = 0; k < 20; ++k) {
    const vec3 place = cloud.position[static_cast<std::size_t>(k) * 900];
    const layout::Light light = pointLight(k % 2 == 0 ? place : place + vec3(0.02f, -0.01f, 0.015f));
    const layout::uint endpoint = kEndpoints[k / 2 % 2];
    const std::vector<float> depths = opticalDepths(tree, light, {layout::kFalloffSmooth, endpoint, 0});
    for (std::size_t i = 0; i < depths.size(); ++i) {
      if (glm::distance(tree.position(i), light.position) > 0.25f || tree.position(i) == light.position) continue;
      const double expected = oracleOpticalDepth(tree, i, light, layout::kFalloffSmooth, endpoint);
      ASSERT_NEAR(depths[i], expected, 1e-4 * expected + 1e-5) << "light " << k << " slot " << i;
      ++compared;
    }
  }
  EXPECT_GT(compared, 2000u);
}

TEST(Lighting, ScalarAndEveryInstructionSetGiveTheSameBits) {
  const Cloud cloud = ballCloud(20000, 13, 0.01, 0.1);
  const layout::Light light = pointLight({0.5f, 0.5f, 2});
  for (const layout::uint falloff : kFalloffs)
    for (const layout::uint endpoint : kEndpoints)
      for (const float cutoff : {0.0f, 1e-4f, 0.3f}) {
        const Octree tree = cloud.tree(falloff, true, 1e-3);
        const LightingOptions options{falloff, endpoint, cutoff};
        const std::vector<float> scalar = opticalDepthsScalar(tree, light, options);
        for (const std::string& target : simdTargets()) {
          useSimdTarget(target);
          EXPECT_EQ(opticalDepths(tree, light, options), scalar) << target << " falloff " << falloff;
        }
        useSimdTarget("");
      }
}

TEST(Lighting, IsTheSameForAnyNumberOfThreads) {
  const Cloud cloud = ballCloud(50000, 14, 0.02, 0.05);
  const Octree tree = cloud.tree(layout::kFalloffSmooth, true, 1e-3);
  const auto once = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return opticalDepths(tree, pointLight({2, 1, 0}), {});
  };
  const std::vector<float> one = once(1);
  EXPECT_EQ(one, once(2));
  EXPECT_EQ(one, once(7));
}

TEST(Lighting, DoesNotDependOnTheLeafSizeBeyondRounding) {
  const Cloud cloud = ballCloud(20000, 15, 0.02, 0.08);
  const std::vector<float> peaks = peakOpticalDepths(cloud.density, cloud.radius, 0, true, 1e-3);
  const Octree coarse = buildOctree(cloud.position, cloud.radius, peaks, 500);
  const Octree fine = buildOctree(cloud.position, cloud.radius, peaks, 1);
  const std::vector<float> a = opticalDepths(coarse, pointLight({2, 1, 0}), {0, 0, 0});
  const std::vector<float> b = opticalDepths(fine, pointLight({2, 1, 0}), {0, 0, 0});
  // The same terms in the same Morton order; only packets, and so which grazing particles are skipped, may differ.
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-6 + 1e-5 * a[i]);
}

TEST(Lighting, CutoffBoundsTheErrorOfTransmittance) {
  const Cloud cloud = ballCloud(20000, 16, 0.05, 0.05);
  const Octree tree = cloud.tree(layout::kFalloffSmooth, true, 5e-3);
  layout::Light light = directionalLight({0, -1, 0});
  light.shadowDensity = 0.7f;
  const std::vector<float> exact = transmittances(opticalDepths(tree, light, {0, 0, 0}), light);
  std::size_t stopped = 0;
  for (const float cutoff : {1e-4f, 1e-2f, 0.2f}) {
    const std::vector<float> early = transmittances(opticalDepths(tree, light, {0, 0, cutoff}), light);
    for (std::size_t i = 0; i < exact.size(); ++i) {
      ASSERT_GE(early[i], exact[i]);
      ASSERT_LE(early[i] - exact[i], cutoff);
      stopped += early[i] != exact[i];
    }
  }
  EXPECT_GT(stopped, 1000u) << "the cloud is dense enough for rays to stop";
}

TEST(Lighting, LightsWithoutShadowsReachEverything) {
  const Octree tree = ballCloud(1000, 17, 0.1, 0.1).tree(0, true, 1);
  layout::Light light = pointLight({0, 2, 0});
  light.castsShadows = 0;
  for (const float depth : opticalDepths(tree, light, {})) ASSERT_EQ(depth, 0);
  light.castsShadows = 1, light.shadowDensity = 0;
  for (const float transmittance : transmittances(opticalDepths(tree, light, {}), light)) ASSERT_EQ(transmittance, 1);
}

TEST(Lighting, InScatteringFollowsTheInverseSquareAndTheIsotropicPhase) {
  const std::vector<vec3> position{{0, 0, 0}, {0, 1, 0}, {0, 2, 0}};
  const std::vector<float> radius(3, 0.25f), peak(3, 0.0f);
  const Octree tree = buildOctree(position, radius, peak);
  layout::Light light = pointLight({0, 2, 0});
  light.power = {8, 4, 2};
  std::vector<vec3> radiance(3, vec3(0));
  const std::vector<float> some{1.0f, 0.5f, 1.0f}, all(3, 1.0f);
  addInScattering(slotsOf(tree), radius, light, some, {}, radiance);
  const double isotropic = 1 / (4 * kPi);
  for (std::size_t slot = 0; slot < 3; ++slot) {
    const double distance = 2 - tree.y[slot];
    // At the light itself the particle's own radius stands for the distance.
    const double irradiance = slot == 2 ? 8 / (0.25 * 0.25) : 8 / (distance * distance);
    const double transmittance = slot == 1 ? 0.5 : 1.0;
    EXPECT_NEAR(radiance[slot].x, isotropic * irradiance * transmittance, 1e-6 * irradiance);
    EXPECT_NEAR(radiance[slot].z, isotropic * irradiance * transmittance / 4, 1e-6 * irradiance);
  }
  for (const float decay : {0.0f, 1.0f, 1.5f}) {
    light.decay = decay;
    std::vector<vec3> other(3, vec3(0));
    addInScattering(slotsOf(tree), radius, light, all, {}, other);
    EXPECT_NEAR(other[0].x, isotropic * 8 / std::pow(2.0, decay), 1e-6);
  }
}

TEST(Beams, TakeEverySlotOnceInBeamsOfColumns) {
  Cloud cloud = ballCloud(30001, 18, 0.1, 0.1);
  for (std::size_t i = 0; i < 5000; ++i) cloud.position[i] = {0.5f, 0.5f, 0.5f};  // no cut parts these
  const Octree tree = cloud.tree(0, true, 1);
  const vec3 own = tree.position(7);
  for (const layout::Light& light : {pointLight({0, 0, 0}), pointLight({50, 0, 0}), pointLight(own),
                                     pointLight({1e6f, 1e6f, -3e5f}), directionalLight({0, 0, 1})}) {
    const Beams beams = planBeams(slotsOf(tree), light, {}, tree.meanRadius);
    std::vector<std::uint32_t> order = beams.receiver;
    std::sort(order.begin(), order.end());
    std::vector<std::uint32_t> expected(30001);
    std::iota(expected.begin(), expected.end(), 0u);
    if (light.position == own && light.type == layout::kLightPoint) expected.erase(expected.begin() + 7);
    ASSERT_EQ(order, expected);
    ASSERT_EQ(beams.column.front(), 0u);
    ASSERT_EQ(beams.column.back() + 1, beams.start.size());
    ASSERT_EQ(beams.start.back(), beams.receiver.size());
    for (std::size_t c = 0; c < beams.columns(); ++c) {
      ASSERT_LT(beams.column[c], beams.column[c + 1]);
      ASSERT_LE(beams.ofColumn(c).size(), BeamLimits{}.columnRays);
      for (std::size_t b = beams.column[c]; b < beams.column[c + 1]; ++b) {
        ASSERT_LT(beams.start[b], beams.start[b + 1]);
        ASSERT_LE(beams.ofBeam(b).size(), BeamLimits{}.beamRays * 5 / 4);
      }
    }
  }
}

TEST(Beams, AreNoneWhereNothingIsReached) {
  const Octree tree = ballCloud(100, 18, 0.1, 0.1).tree(0, true, 1);
  const std::vector<std::uint8_t> none(100, 0);
  for (const layout::Light& light : {pointLight({0, 0, 0}), directionalLight({0, 0, 1})}) {
    const Beams beams = planBeams(slotsOf(tree), light, none, tree.meanRadius);
    EXPECT_EQ(beams.columns(), 0u);
    EXPECT_TRUE(beams.receiver.empty());
    EXPECT_EQ(planBeams(slotsOf(Octree{}), light, {}, 1).columns(), 0u);
    EXPECT_EQ(opticalDepths(tree, slotsOf(tree), light, {}, none), std::vector<float>(100, 0.0f));
  }
}

TEST(Column, FindsEveryParticleThatARayMeetsInTheOrderOfReach) {
  const Cloud cloud = ballCloud(5000, 20, 0.01, 0.2);
  const Octree tree = cloud.tree(0, true, 1);
  for (const layout::Light& light : {pointLight({0.2f, 0, 0}), pointLight({3, 1, 0}), directionalLight({1, 2, 3})}) {
    const Receivers receivers = slotsOf(tree);
    const ColumnRules rules = columnRules(tree, light, receivers.bounds());
    const Beams beams = planBeams(receivers, light, {}, tree.meanRadius);
    std::size_t met = 0;
    Column column;
    Beam beam;
    for (std::size_t c = 0; c < beams.columns(); ++c) {
      column.setRays(receivers, light, beams.ofColumn(c), rules);
      simdBeamKernel().gather(tree, column);
      simdBeamKernel().place(column);
      column.sort(1);
      const auto& reach = column.sorted.reach;
      ASSERT_TRUE(std::is_sorted(reach.begin(), reach.begin() + static_cast<std::ptrdiff_t>(column.sorted.count)));
      for (std::size_t b = beams.column[c]; b < beams.column[c + 1]; ++b) {
        beam.setRays(column, receivers, beams.ofBeam(b));
        simdBeamKernel().choose(column, 1, beam);
        std::vector<bool> chosen(tree.particleCount(), false);
        for (std::size_t k = 0; k < beam.particles.count; ++k)
          chosen[column.gathered.slot[beam.particles.index[k]]] = true;
        for (const std::uint32_t index : column.nearLight) chosen[column.gathered.slot[index]] = true;
        const std::uint32_t ray = beams.ofBeam(b).front();
        const dvec3 origin(tree.position(ray));
        const bool point = light.type == layout::kLightPoint;
        const dvec3 toLight = point ? dvec3(light.position) - origin : -dvec3(light.direction);
        for (std::size_t j = 0; j < tree.particleCount(); ++j) {
          const double share =
              oracleShare(dvec3(tree.position(j)) - origin, glm::normalize(toLight),
                          point ? glm::length(toLight) : INFINITY, tree.radius[j], 0, layout::kEndpointSoft);
          met += share > 0;
          ASSERT_TRUE(share <= 0 || chosen[j]) << "light " << light.type << " ray " << ray << " particle " << j;
        }
      }
    }
    EXPECT_GT(met, 100u);
  }
}

TEST(Lighting, LinesCountEverythingOnTheWholeLine) {
  const std::vector<vec3> position{{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 5, 0}};
  const std::vector<float> radius(4, 0.2f), peak{0.1f, 0.2f, 0.3f, 10.0f};
  const Octree tree = buildOctree(position, radius, peak);
  const std::vector<vec3> points{{0, 0, 0}, {0, 0, 0}}, directions{{1, 0, 0}, {0, 0, 1}};
  const std::vector<float> depths = lineOpticalDepths(tree, points, directions, layout::kFalloffSmooth);
  EXPECT_NEAR(depths[0], 0.6, 1e-6);
  EXPECT_NEAR(depths[1], 0.2, 1e-6);
}

TEST(Medium, KernelsIntegrateToOneOverTheDisc) {
  for (const layout::uint falloff : kFalloffs)
    for (const double radius : {0.01, 1.0, 30.0}) {
      // ∫ W dA = π r² W(0) ∫₀¹ F(q) dq, by the midpoint rule: error ~ 1e-8 (1e-6 for the root at q = 1).
      double sum = 0;
      constexpr int kSteps = 100000;
      for (int i = 0; i < kSteps; ++i) sum += oracleFalloff(falloff, (i + 0.5) / kSteps) / kSteps;
      EXPECT_NEAR(kPi * radius * radius * kernelPeak(falloff, radius) * sum, 1, 1e-6);
    }
}

TEST(Medium, PeakModeTakesTheChannelAsOpticalDepth) {
  const std::vector<float> density{0.5f, 2.0f}, radius{0.1f, 3.0f};
  EXPECT_EQ(peakOpticalDepths(density, radius, 0, false, 2), (std::vector<float>{1.0f, 4.0f}));
  const std::vector<float> peaks = peakOpticalDepths(density, radius, 0, true, 2);
  EXPECT_NEAR(peaks[0], 1.0 * 3 / (kPi * 0.01), 1e-4);
}

TEST(Medium, CalibrationIsTheMeanOverLinesThroughParticles) {
  // A uniform ball of n particles, cross-section c each: a line through a uniformly drawn point in a uniformly drawn
  // direction has the mean chord ∫ … = 1.5 R (for chords weighted by length: ⟨s²⟩/⟨s⟩ = (2R²)/(4R/3)), and the line's
  // own particle adds its whole peak.
  constexpr std::size_t kCount = 20000;
  const Cloud cloud = ballCloud(kCount, 19, 0.05, 0.05);
  std::vector<float> one(kCount, 1.0f);
  const double section = 1e-4;
  const Octree tree = buildOctree(cloud.position, cloud.radius, peakOpticalDepths(one, cloud.radius, 0, true, section));
  const double numberDensity = kCount / (4.0 / 3.0 * kPi);
  const double expected = numberDensity * section * 1.5 + section * kernelPeak(0, 0.05);
  // 4096 lines whose depths scatter by about 35 %: standard error 0.6 %; the ball's soft edge loses under 1 %.
  EXPECT_NEAR(meanLineOpticalDepth(tree, 0) / expected, 1, 0.03);
}

}  // namespace
}  // namespace mote
