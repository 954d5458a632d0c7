// Generated particles: the same on any number of threads, statistically what they claim, and a plume that moves as its
// own velocities say.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/particles/generate.h"
#include "host/particles/plume_flow.h"
#include "host/particles/spacing.h"

namespace mote {
namespace {

constexpr Generator kAll[] = {Generator::Ball, Generator::Cloud, Generator::Plume};

template <class T>
bool sameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool sameBytes(const ParticleSet& a, const ParticleSet& b) {
  return sameBytes(a.position, b.position) && sameBytes(a.velocity, b.velocity) && sameBytes(a.radius, b.radius) &&
         sameBytes(a.density, b.density) && sameBytes(a.id, b.id);
}

TEST(Generate, IsTheSameOnOneAndTwoThreads) {
  for (const Generator kind : kAll) {
    ParticleSet sets[2];
    for (const unsigned threads : {1u, 2u}) {
      const ThreadLimit limit(threads);
      sets[threads - 1] = generateParticles(kind, 30'000, 7, 3);
    }
    EXPECT_TRUE(sameBytes(sets[0], sets[1])) << static_cast<int>(kind);
  }
}

TEST(Generate, SeedsDiffer) {
  for (const Generator kind : kAll)
    EXPECT_FALSE(sameBytes(generateParticles(kind, 100, 1, 1), generateParticles(kind, 100, 2, 1)));
}

TEST(Generate, GivesFiniteParticlesOfEveryCount) {
  for (const Generator kind : kAll)
    for (const std::uint64_t count : {1u, 2u, 20'000u}) {
      const ParticleSet set = generateParticles(kind, count, 7, 1);
      ASSERT_EQ(set.size(), count);
      ASSERT_EQ(set.radius.size(), count);
      ASSERT_EQ(set.density.size(), count);
      ASSERT_EQ(set.id.size(), count);
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_TRUE(glm::all(glm::lessThan(glm::abs(set.position[i]), vec3(10))));  // false for NaN, too
        ASSERT_TRUE(set.radius[i] > 0 && std::isfinite(set.radius[i]));
        ASSERT_TRUE(set.density[i] >= 0 && std::isfinite(set.density[i]));
      }
    }
  EXPECT_THROW(generateParticles(Generator::Ball, 0, 1, 1), InputError);
}

TEST(Generate, NamesAreThoseOfTheCommandLine) {
  EXPECT_EQ(generatorNamed("ball"), Generator::Ball);
  EXPECT_EQ(generatorNamed("cloud"), Generator::Cloud);
  EXPECT_EQ(generatorNamed("plume"), Generator::Plume);
  EXPECT_EQ(generatorNamed("Plume"), Generator::None);
}

// ---- ball ----

TEST(GenerateBall, IsUniform) {
  constexpr std::size_t kCount = 100'000;
  const ParticleSet ball = generateBall(kCount, 42);
  dvec3 mean(0);
  constexpr int kBins = 20;
  double shells[kBins] = {}, slices[kBins] = {};
  for (const vec3& p : ball.position) {
    mean += dvec3(p);
    const double r = glm::length(dvec3(p));
    ASSERT_LE(r, 1 + 1e-6);
    // Uniform in the ball: r³ is uniform, and so is the cosine with any axis, here one that is none of the
    // coordinates'.
    ++shells[std::min(kBins - 1, static_cast<int>(r * r * r * kBins))];
    const double cosine = glm::dot(dvec3(p), glm::normalize(dvec3(1, 2, -3))) / r;
    ++slices[glm::clamp(static_cast<int>((0.5 + 0.5 * cosine) * kBins), 0, kBins - 1)];
  }
  // Variance of a coordinate: 1/5. Five standard errors.
  EXPECT_LT(glm::length(mean) / kCount, 5 * std::sqrt(0.6 / kCount));
  for (const auto* bins : {shells, slices}) {
    double chiSquared = 0;
    for (int b = 0; b < kBins; ++b)
      chiSquared += std::pow(bins[b] - double(kCount) / kBins, 2) / (double(kCount) / kBins);
    EXPECT_LT(chiSquared, 66);   // 19 degrees of freedom: exceeded once in two million
    EXPECT_GT(chiSquared, 1.9);  // and below this as rarely: the numbers are random, not spread by a rule
  }
}

TEST(GenerateBall, HasMeanOpticalDepth4AlongADiameter) {
  const ParticleSet ball = generateBall(100'000, 1);
  Random random(9);
  constexpr int kLines = 200;
  double sum = 0;
  for (int line = 0; line < kLines; ++line) {
    const dvec3 direction = random.direction();
    for (std::size_t i = 0; i < ball.size(); ++i) {
      const dvec3 p(ball.position[i]);
      const double along = glm::dot(p, direction),
                   s = (glm::dot(p, p) - along * along) / (double(ball.radius[i]) * ball.radius[i]);
      if (s < 1) sum += ball.density[i] * 3 / (kPi * double(ball.radius[i]) * ball.radius[i]) * (1 - s) * (1 - s);
    }
  }
  // A line meets about 350 particles with unequal weights: 7 % a line, 0.5 % for 200; all lines share the centre, hence
  // 3 %.
  EXPECT_NEAR(sum / kLines, 4, 0.12);
}

// ---- cloud ----

TEST(GenerateCloud, FillsItsBoxWithRadiiLikeItsSpacing) {
  const ParticleSet cloud = generateCloud(200'000, 7);
  const Bounds box = cloud.bounds();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GE(box.lo[axis], -1);
    EXPECT_LE(box.hi[axis], 1);
    EXPECT_GT(box.hi[axis] - box.lo[axis], 0.7f);
  }
  // The rule of "auto" for the whole, by local density for each: the same within the fringe's share.
  const double automatic = kAutoRadiusFactor * meanNeighbourDistance(cloud.position);
  EXPECT_NEAR(static_cast<double>(radiusRange(cloud).mean) / automatic, 1, 0.15);
}

TEST(GenerateCloud, HasHolesAndBillows) {
  // Far from uniform: in cells of 1/8 the variance of the counts is many times that of chance (which is 1 × the mean).
  const ParticleSet cloud = generateCloud(200'000, 7);
  std::map<std::tuple<int, int, int>, double> counts;
  for (const vec3& p : cloud.position) {
    const vec3 c = glm::floor(p * 8.0f);
    ++counts[{static_cast<int>(c.x), static_cast<int>(c.y), static_cast<int>(c.z)}];
  }
  double sum = 0, squares = 0;
  for (const auto& [cell, n] : counts) sum += n, squares += n * n;
  const double cells = static_cast<double>(counts.size()), mean = sum / cells;
  EXPECT_GT(squares / cells - mean * mean, 20 * mean);
}

// ---- plume ----

TEST(GeneratePlume, IsAColumnAboutTwoUnitsTallThatThinsAndWidens) {
  const ParticleSet plume = generatePlume(50'000, 7, 1);
  const Bounds box = plume.bounds();
  EXPECT_GE(box.lo.y, -0.15f);
  EXPECT_GT(box.hi.y, 1.6f);
  EXPECT_LT(box.hi.y, 2.6f);
  double lowWidth = 0, highWidth = 0, low = 0, high = 0;
  for (const vec3& p : plume.position) {
    if (p.y < 0.3f) lowWidth += std::hypot(p.x, p.z), ++low;
    if (p.y > 1.4f) highWidth += std::hypot(p.x, p.z), ++high;
  }
  ASSERT_GT(low, 1000);
  ASSERT_GT(high, 1000);
  EXPECT_GT(highWidth / high, 2 * lowWidth / low);
  for (std::size_t i = 1; i < plume.size(); ++i) {  // in order of birth, oldest first
    ASSERT_EQ(plume.id[i], plume.id[i - 1] + 1);
    ASSERT_LE(plume.radius[i], plume.radius[i - 1]);
    ASSERT_GE(plume.density[i], plume.density[i - 1]);
  }
}

TEST(GeneratePlume, MovesFromFrameToFrameAsItsVelocitiesSay) {
  const ParticleSet before = generatePlume(20'000, 7, 12), after = generatePlume(20'000, 7, 13);
  std::map<std::uint64_t, std::size_t> index;
  for (std::size_t i = 0; i < before.size(); ++i) index[before.id[i]] = i;
  std::size_t shared = 0;
  double fastest = 0, worst = 0;
  const double dt = 1 / kGeneratorFps;
  for (std::size_t k = 0; k < after.size(); ++k) {
    const auto found = index.find(after.id[k]);
    if (found == index.end()) continue;
    ++shared;
    const std::size_t i = found->second;
    const dvec3 u(before.velocity[i]), v(after.velocity[k]);
    fastest = std::max({fastest, glm::length(u), glm::length(v)});
    worst = std::max(worst, glm::length(dvec3(after.position[k]) - dvec3(before.position[i]) - 0.5 * dt * (u + v)));
  }
  // All but those that one frame gives birth to (and as many at the end of their lives).
  EXPECT_GT(shared, 19'700u);
  EXPECT_LT(shared, 20'000u);
  // The step holds the air's velocity fixed and lets drag act exactly; against the trapezium of the velocities this
  // differs by at most 0.03 × dt × the slip, which is below twice the greatest speed.
  EXPECT_LT(worst, 0.06 * dt * fastest);
  EXPECT_GT(fastest, 0.5);
}

TEST(GeneratePlume, AnyFrameIsReproducible) {
  EXPECT_TRUE(sameBytes(generatePlume(5'000, 7, 100), generatePlume(5'000, 7, 100)));
  EXPECT_FALSE(sameBytes(generatePlume(5'000, 7, 100), generatePlume(5'000, 7, 101)));
  EXPECT_EQ(generatePlume(5'000, 7, -500).size(), 5'000u);  // frames before the first exist as well
}

TEST(PlumeFlow, IsFreeOfDivergence) {
  const PlumeFlow flow(7, 90, 90);
  Random random(2);
  constexpr float h = 0.004f;  // a twelfth of the smallest vortex; far above float's rounding of 1e-7 / h
  double divergence = 0, gradient = 0;
  for (int k = 0; k < 4000; ++k) {
    const vec3 p(random.uniform(-0.4, 0.4), random.uniform(0.1, 2), random.uniform(-0.4, 0.4));
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      vec3 step(0);
      step[axis] = h;
      const dvec3 slope = dvec3(flow.velocity(p + step, 90) - flow.velocity(p - step, 90)) / (2.0 * h);
      sum += slope[axis];
      gradient += glm::dot(slope, slope);
    }
    divergence += sum * sum;
  }
  // Central differences are wrong by h²/6 of the third derivative: (h/R)² ≈ 1 % of the gradient at the smallest
  // vortices.
  EXPECT_LT(std::sqrt(divergence / gradient), 0.02);
  EXPECT_GT(std::sqrt(gradient / 4000), 1);  // there is something to be free of
}

}  // namespace
}  // namespace mote
