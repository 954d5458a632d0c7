// The model against mathematics: expectations over random media that hold whatever the code does inside.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "host/core/random.h"
#include "host/lighting/lighting.h"
#include "host/lighting/medium.h"
#include "tests/support/lighting_oracle.h"
#include "tests/support/lights.h"

namespace mote {
namespace {

constexpr layout::uint kFalloffs[] = {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere};

/// Equal particles: support radius, and cross-section that gives the peak.
struct Kind {
  layout::uint falloff;
  double radius, crossSection;
  double peak() const { return crossSection * kernelPeak(falloff, radius); }
  double opacity(double b) const { return 1 - std::exp(-peak() * oracleFalloff(falloff, b * b / (radius * radius))); }
};

Octree treeOf(const std::vector<vec3>& position, const Kind& kind) {
  const std::vector<float> radius(position.size(), static_cast<float>(kind.radius));
  const std::vector<float> peak(position.size(), static_cast<float>(kind.peak()));
  return buildOctree(position, radius, peak);
}

std::vector<vec3> uniformBall(std::size_t count, std::uint64_t seed) {
  std::vector<vec3> position;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    position.emplace_back(random.direction() * std::cbrt(random.uniform()));
  }
  return position;
}

/// Mean over realisations with its standard error, for "within 4 standard errors".
struct Estimate {
  double mean, standardError;
};

Estimate estimate(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  double mean = 0, square = 0;
  for (const double value : values) mean += value / count;
  for (const double value : values) square += (value - mean) * (value - mean) / (count - 1);
  return {mean, std::sqrt(square / count)};
}

void expectMean(const std::vector<double>& values, double expected, const std::string& what) {
  const Estimate e = estimate(values);
  // The error itself must be small, or anything would pass.
  EXPECT_LT(e.standardError, 0.01 * expected) << what;
  EXPECT_NEAR(e.mean, expected, 4 * e.standardError) << what;
  std::printf("%s: mean T %.5f, expected %.5f, %.2f standard errors off\n", what.c_str(), e.mean, expected,
              (e.mean - expected) / e.standardError);
}

double meanOpticalDepth(const Octree& tree, const layout::Light& light, layout::uint falloff, layout::uint endpoint) {
  double sum = 0;
  for (const float depth : opticalDepths(tree, light, {falloff, endpoint, 0})) sum += depth;
  return sum / static_cast<double>(tree.particleCount());
}

TEST(Analytic, MeanOpticalDepthInABallDoesNotDependOnTheRadius) {
  constexpr std::size_t kCount = 200000;
  const std::vector<vec3> position = uniformBall(kCount, 1);
  const double spacing = std::cbrt(4.0 / 3.0 * kPi / kCount);
  // The mean way from a uniform point of a ball to its surface, in a fixed direction, is ¾ R.
  const double expected = 4;
  const double crossSection = expected / (0.75 * kCount / (4.0 / 3.0 * kPi));
  for (const layout::uint falloff : kFalloffs) {
    const Kind once{falloff, 1.5 * spacing, crossSection}, twice{falloff, 3 * spacing, crossSection};
    const double a =
        meanOpticalDepth(treeOf(position, once), directionalLight({0, 0, -1}), falloff, layout::kEndpointSoft);
    const double b =
        meanOpticalDepth(treeOf(position, twice), directionalLight({0, 0, -1}), falloff, layout::kEndpointSoft);
    std::printf("falloff %u: mean optical depth %.4f with r, %.4f with 2 r, expected %.4f\n", falloff, a, b, expected);
    EXPECT_NEAR(b / a, 1, 0.01);
    EXPECT_NEAR(a / expected, 1, 0.01);
  }
}

TEST(Analytic, ClampedEndpointsCountWhatLiesBehind) {
  // The thesis' rule is biased by about r · n · c; it must differ, or the option does nothing.
  constexpr std::size_t kCount = 50000;
  const std::vector<vec3> position = uniformBall(kCount, 2);
  const double spacing = std::cbrt(4.0 / 3.0 * kPi / kCount);
  const Kind kind{layout::kFalloffSmooth, 1.5 * spacing, 4 / (0.75 * kCount / (4.0 / 3.0 * kPi))};
  const Octree tree = treeOf(position, kind);
  const double soft = meanOpticalDepth(tree, directionalLight({0, 0, -1}), kind.falloff, layout::kEndpointSoft);
  const double clamp = meanOpticalDepth(tree, directionalLight({0, 0, -1}), kind.falloff, layout::kEndpointClamp);
  EXPECT_GT(clamp / soft, 1.005);
}

/// Lines along z through N particles uniform in [-1, 1]² × [0, thickness]. A particle is passed at distance b whatever
/// its z, so E[T] = (1 − ∫(1−e^−τ)dA / 4)^N, which is exp(−n·L·∫(1−e^−τ)dA) for many particles (DESIGN §2).
void checkSlab(std::size_t count, double radiusInSpacings, int realisations) {
  constexpr double kThickness = 0.5, kArea = 4;
  const double spacing = std::cbrt(kArea * kThickness / static_cast<double>(count));
  {
    const layout::uint falloff = kFalloffs[count % 3];
    const Kind kind{falloff, radiusInSpacings * spacing, 1.5 * kArea / static_cast<double>(count)};
    double blocked = 0;  // ∫(1−e^−τ)dA, midpoint rule
    constexpr int kSteps = 20000;
    for (int i = 0; i < kSteps; ++i) {
      const double b = (i + 0.5) / kSteps * kind.radius;
      blocked += kind.opacity(b) * 2 * kPi * b * kind.radius / kSteps;
    }
    std::vector<double> means;
    for (int k = 0; k < realisations; ++k) {
      std::vector<vec3> position, points;
      for (std::size_t i = 0; i < count; ++i) {
        Random random(100 + k, i);
        position.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0, kThickness));
      }
      const double inside = 1 - kind.radius;  // no line feels the sides
      for (int i = 0; i < 1500; ++i) {
        Random random(200 + k, i);
        points.emplace_back(random.uniform(-inside, inside), random.uniform(-inside, inside), 0);
      }
      const std::vector<vec3> directions(points.size(), vec3(0, 0, 1));
      double sum = 0;
      for (const float depth : lineOpticalDepths(treeOf(position, kind), points, directions, falloff))
        sum += std::exp(-depth);
      means.push_back(sum / static_cast<double>(points.size()));
    }
    const double expected = std::pow(1 - blocked / kArea, static_cast<double>(count));
    expectMean(means, expected,
               fmt::format("slab, {} particles, r = {} spacings, falloff {}", count, radiusInSpacings, falloff));
    EXPECT_NEAR(expected, std::exp(-static_cast<double>(count) / kArea * blocked), 0.001);
  }
}

TEST(Analytic, SlabOfTenThousandHasTheExpectedTransmittance) {
  checkSlab(10000, 0.5, 16);  // single particles are opaque enough that Beer's law alone would fail
  checkSlab(10001, 1.5, 16);
  checkSlab(10002, 1.5, 16);
}
TEST(Analytic, SlabOfAHundredThousandHasTheExpectedTransmittance) { checkSlab(100000, 0.5, 12); }
TEST(Analytic, SlabOfAMillionHasTheExpectedTransmittance) { checkSlab(1000000, 1.5, 6); }

/// Probes of no density behind a uniform ball, lit through it. A line at distance h from the middle passes particle
/// after particle, each at its own place: E[T] = (1 − 3/(4π) ∫(1−e^−τ(b)) · chord(|h + b|) dA)^N.
double expectedThroughBall(const Kind& kind, double h, std::size_t count) {
  constexpr int kRings = 100, kSpokes = 64;
  double blocked = 0;
  for (int ring = 0; ring < kRings; ++ring)
    for (int spoke = 0; spoke < kSpokes; ++spoke) {
      const double b = (ring + 0.5) / kRings * kind.radius, angle = (spoke + 0.5) / kSpokes * 2 * kPi;
      const double square = h * h + b * b + 2 * h * b * std::cos(angle);
      const double chord = 2 * std::sqrt(std::max(0.0, 1 - square));
      blocked += kind.opacity(b) * chord * b * (kind.radius / kRings) * (2 * kPi / kSpokes);
    }
  return std::pow(1 - blocked * 3 / (4 * kPi), static_cast<double>(count));
}

void checkBall(std::size_t count, double radiusInSpacings, int realisations) {
  const layout::uint falloff = kFalloffs[count % 3];
  const double spacing = std::cbrt(4.0 / 3.0 * kPi / static_cast<double>(count));
  const Kind kind{falloff, radiusInSpacings * spacing, 1.0 * 4.0 / 3.0 * kPi / static_cast<double>(count)};
  constexpr std::size_t kProbes = 1000;
  std::vector<vec3> probes;
  double expected = 0;
  for (std::size_t i = 0; i < kProbes; ++i) {
    Random random(7, i);
    const double h = 0.8 * std::sqrt(random.uniform()), angle = random.uniform(0, 2 * kPi);
    probes.emplace_back(h * std::cos(angle), h * std::sin(angle), -2);
    expected += expectedThroughBall(kind, h, count) / kProbes;
  }
  std::vector<double> means;
  for (int k = 0; k < realisations; ++k) {
    std::vector<vec3> position = uniformBall(count, 300 + k);
    position.insert(position.end(), probes.begin(), probes.end());
    std::vector<float> radius(position.size(), static_cast<float>(kind.radius)),
        peak(count, static_cast<float>(kind.peak()));
    peak.resize(position.size(), 0.0f);
    const Octree tree = buildOctree(position, radius, peak);
    const std::vector<float> depths =
        opticalDepths(tree, directionalLight({0, 0, -1}), {falloff, layout::kEndpointSoft, 0});
    double sum = 0;
    for (std::size_t slot = 0; slot < depths.size(); ++slot)
      if (tree.source[slot] >= count) sum += std::exp(-depths[slot]);
    means.push_back(sum / kProbes);
  }
  expectMean(means, expected,
             fmt::format("ball, {} particles, r = {} spacings, falloff {}", count, radiusInSpacings, falloff));
}

TEST(Analytic, BallOfTenThousandHasTheExpectedTransmittance) {
  checkBall(10000, 0.4, 16);
  checkBall(10001, 1.5, 16);
  checkBall(10002, 1.5, 16);
}
TEST(Analytic, BallOfAHundredThousandHasTheExpectedTransmittance) { checkBall(100000, 1.0, 8); }
TEST(Analytic, BallOfAMillionHasTheExpectedTransmittance) { checkBall(1000000, 1.0, 4); }

TEST(Analytic, ThinParticlesGiveBeersLaw) {
  // Thesis eq. 12: T = e^(−σ d). With many thin particles a slab's mean transmittance is Beer's: single τ ≤ 0.02 leaves
  // a relative difference of n·L·c·τ/3 ≈ 0.3 %.
  constexpr std::size_t kCount = 60000;
  constexpr double kThickness = 0.5, kSigmaD = 1.0;
  const double spacing = std::cbrt(4 * kThickness / kCount);
  const Kind kind{layout::kFalloffSmooth, 2.5 * spacing, kSigmaD * 4 / kCount};
  ASSERT_LT(kind.peak(), 0.02);
  std::vector<double> logs;
  for (int k = 0; k < 8; ++k) {
    std::vector<vec3> position, points;
    for (std::size_t i = 0; i < kCount; ++i) {
      Random random(400 + k, i);
      position.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0, kThickness));
    }
    for (int i = 0; i < 1000; ++i) {
      Random random(500 + k, i);
      points.emplace_back(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8), 0);
    }
    const std::vector<vec3> directions(points.size(), vec3(0, 0, 1));
    double sum = 0;
    for (const float depth : lineOpticalDepths(treeOf(position, kind), points, directions, kind.falloff))
      sum += std::exp(-depth);
    logs.push_back(sum / static_cast<double>(points.size()));
  }
  const Estimate e = estimate(logs);
  EXPECT_LT(e.standardError, 0.005);
  EXPECT_NEAR(e.mean, std::exp(-kSigmaD), 4 * e.standardError + 0.004 * std::exp(-kSigmaD));
}

TEST(Analytic, TransmittanceOfAPathIsTheProductOfItsParts) {
  // Thesis eq. 9: T(a→c) = T(a→b) · T(b→c). Soft ends share a particle that straddles b between the two parts exactly:
  // cap(x) + cap(−x) = 1. So the optical depths add up to rounding.
  const std::vector<vec3> cloud = uniformBall(20000, 3);
  const Kind kind{layout::kFalloffSmooth, 0.06, 2e-4};
  for (int trial = 0; trial < 20; ++trial) {
    Random random(9, trial);
    const dvec3 a = 0.9 * random.direction(), c = 1.4 * random.direction();
    const vec3 start(a), end(c), middle(0.5 * (a + c));
    std::vector<vec3> position = cloud;
    position.push_back(start);
    position.push_back(middle);
    std::vector<float> radius(position.size(), static_cast<float>(kind.radius)),
        peak(position.size(), static_cast<float>(kind.peak()));
    peak[cloud.size()] = peak[cloud.size() + 1] = 0;  // probes
    const Octree tree = buildOctree(position, radius, peak);
    const auto depthTo = [&](const vec3& light, std::size_t particle) {
      const std::vector<float> depths =
          opticalDepths(tree, pointLight(light), {kind.falloff, layout::kEndpointSoft, 0});
      for (std::size_t slot = 0; slot < depths.size(); ++slot)
        if (tree.source[slot] == particle) return double(depths[slot]);
      return -1.0;
    };
    const double whole = depthTo(end, cloud.size());
    const double parts = depthTo(middle, cloud.size()) + depthTo(end, cloud.size() + 1);
    if (glm::length(c - a) < 0.3) continue;  // shorter than a particle the two soft ends of one part overlap
    ASSERT_GT(whole, 0.01);
    // `middle` is rounded to float: 1e-7 beside the line, 1e-6 of a radius.
    EXPECT_NEAR(std::exp(-whole), std::exp(-parts), 2e-5);
  }
}

}  // namespace
}  // namespace mote
