// Sub-sampling, compensation and the size that rays meet (Monette 2011, §4.6).
#include "host/lighting/density_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "host/core/sampling.h"
#include "host/lighting/auto_subsample.h"
#include "host/lighting/lighting.h"
#include "host/lighting/medium.h"
#include "host/particles/generate.h"
#include "tests/support/lights.h"

namespace mote {
namespace {

struct Cloud {
  ParticleSet set;
  std::vector<float> peak;

  explicit Cloud(std::size_t count) : set(generateBall(count, 9)) {
    peak = peakOpticalDepths(set.density, set.radius, layout::kFalloffSmooth, true, 0.5);
  }
  DensityInput input() const { return {set.position, set.radius, peak, {}, {}, set.id}; }
};

std::set<std::uint64_t> idsInTree(const Cloud& cloud, const DensityTree& density) {
  std::set<std::uint64_t> ids;
  for (const std::uint32_t i : density.tree().source) ids.insert(cloud.set.id[i]);
  return ids;
}

double crossSection(const Octree& tree) {
  double sum = 0;
  for (std::size_t slot = 0; slot < tree.particleCount(); ++slot)
    sum += double(tree.peak[slot]) * tree.radius[slot] * tree.radius[slot];
  return sum;
}

TEST(DensityTree, WholeTreeHasItsOwnSlotsAsReceivers) {
  const Cloud cloud(3000);
  const DensityTree density(cloud.input(), {});
  EXPECT_EQ(density.receivers().x.data(), density.tree().x.data());
  EXPECT_TRUE(density.receivers().self.empty());
  EXPECT_EQ(&density.source(), &density.tree().source);
}

TEST(DensityTree, SampleIsAShareThatGoesByIdAndNests) {
  Cloud cloud(20000);
  const DensityTree half(cloud.input(), {.fraction = 0.5f, .seed = 3}),
      tenth(cloud.input(), {.fraction = 0.1f, .seed = 3});
  // Binomial: 20,000 · f ± 4 standard deviations.
  EXPECT_NEAR(static_cast<double>(half.tree().particleCount()), 10000, 4 * std::sqrt(5000));
  EXPECT_NEAR(static_cast<double>(tenth.tree().particleCount()), 2000, 4 * std::sqrt(1800));
  const std::set<std::uint64_t> ids = idsInTree(cloud, half);
  for (const std::uint64_t id : idsInTree(cloud, tenth)) EXPECT_TRUE(ids.contains(id));
  // The next frame, with the particles in another order: the same ones stay.
  std::reverse(cloud.set.id.begin(), cloud.set.id.end());
  std::reverse(cloud.set.position.begin(), cloud.set.position.end());
  EXPECT_EQ(idsInTree(cloud, DensityTree(cloud.input(), {.fraction = 0.5f, .seed = 3})), ids);
  EXPECT_NE(idsInTree(cloud, DensityTree(cloud.input(), {.fraction = 0.5f, .seed = 4})), ids);
}

TEST(DensityTree, WithoutIdsTheIndexDecides) {
  Cloud cloud(5000);
  const auto indices = [&] {
    const DensityTree density(cloud.input(), {.fraction = 0.5f, .seed = 3});
    return std::set<std::uint32_t>(density.tree().source.begin(), density.tree().source.end());
  };
  const auto chosenBy = [&](const auto& key) {
    std::set<std::uint32_t> chosen;
    for (std::uint32_t i = 0; i < 5000; ++i)
      if (isSampled(key(i), 3, 0.5f)) chosen.insert(i);
    return chosen;
  };
  for (std::uint32_t i = 0; i < 5000; ++i) cloud.set.id[i] = 1'000'000 + 7 * i;
  const std::set<std::uint32_t> byId = indices();
  EXPECT_EQ(byId, chosenBy([](std::uint32_t i) { return 1'000'000 + 7 * i; }));
  cloud.set.id.clear();
  EXPECT_EQ(indices(), chosenBy([](std::uint32_t i) { return i; }));
  EXPECT_NE(indices(), byId);
}

TEST(DensityTree, MeanIdShareIsOneWhereEveryIdIsAnothersAndTheCountWhereAllAreOne) {
  using Ids = std::vector<std::uint64_t>;
  EXPECT_EQ(meanIdShare(Ids{}), 0);
  EXPECT_EQ(meanIdShare(Ids{7, 3, 9, 0}), 1);
  EXPECT_EQ(meanIdShare(Ids{7, 7, 7, 7}), 4);
  EXPECT_EQ(meanIdShare(Ids{1, 2, 3, 1, 2, 3}), 2);  // two sources that count from 1
  EXPECT_EQ(meanIdShare(Ids{5, 0, 5, 5}), 2.5);      // (3 · 3 + 1 · 1) / 4
}

TEST(DensityTree, EveryParticleIsLitAndLeavesItselfOut) {
  const Cloud cloud(5000);
  const DensityTree density(cloud.input(), {.fraction = 0.3f});
  const Receivers receivers = density.receivers();
  ASSERT_EQ(receivers.size(), 5000u);
  std::set<std::uint32_t> seen;
  std::size_t inTree = 0;
  for (std::size_t k = 0; k < receivers.size(); ++k) {
    const std::uint32_t i = density.source()[k];
    seen.insert(i);
    EXPECT_EQ(receivers.position(k), cloud.set.position[i]);
    if (receivers.selfOf(k) == kNoSlot) continue;
    ++inTree;
    EXPECT_EQ(density.tree().source[receivers.selfOf(k)], i);
  }
  EXPECT_EQ(seen.size(), 5000u);
  EXPECT_EQ(inTree, density.tree().particleCount());
}

TEST(DensityTree, CompensationKeepsTheTotalCrossSection) {
  const Cloud cloud(20000);
  const double total = crossSection(DensityTree(cloud.input(), {}).tree());
  // Peaks are rounded to float: 1e-7 each.
  EXPECT_NEAR(crossSection(DensityTree(cloud.input(), {.fraction = 0.1f}).tree()) / total, 1, 1e-6);
  EXPECT_NEAR(crossSection(DensityTree(cloud.input(), {.fraction = 0.1f, .compensate = false}).tree()) / total, 0.1,
              0.01);
}

TEST(DensityTree, RadiusScaleKeepsCrossSectionsOrPeaks) {
  const Cloud cloud(1000);
  const DensityTree one(cloud.input(), {}), wide(cloud.input(), {.radiusScale = 2}),
      peak(cloud.input(), {.crossSection = false, .radiusScale = 2});
  EXPECT_NEAR(crossSection(wide.tree()) / crossSection(one.tree()), 1, 1e-6);
  EXPECT_NEAR(crossSection(peak.tree()) / crossSection(one.tree()), 4, 1e-5);
  EXPECT_EQ(wide.tree().radius[0], 2 * cloud.set.radius[wide.tree().source[0]]);
  EXPECT_EQ(peak.tree().peak[0], cloud.peak[peak.tree().source[0]]);
}

/// Mean |ΔT| of the particles between two trees.
double meanError(const Cloud& cloud, const DensityTree& a, const DensityTree& b, const layout::Light& light) {
  std::vector<float> first(cloud.set.size());
  const std::vector<float> ta = transmittances(opticalDepths(a.tree(), a.receivers(), light, {}), light);
  const std::vector<float> tb = transmittances(opticalDepths(b.tree(), b.receivers(), light, {}), light);
  for (std::size_t k = 0; k < ta.size(); ++k) first[a.source()[k]] = ta[k];
  double sum = 0;
  for (std::size_t k = 0; k < tb.size(); ++k) sum += std::abs(double(tb[k]) - double(first[b.source()[k]]));
  return sum / static_cast<double>(tb.size());
}

TEST(DensityTree, TenPercentCompensatedLooksLikeAllOfThem) {
  const Cloud cloud(50000);
  const layout::Light light = pointLight({2, 2, 2});
  const DensityTree all(cloud.input(), {});
  const double with = meanError(cloud, all, DensityTree(cloud.input(), {.fraction = 0.1f}), light);
  const double without =
      meanError(cloud, all, DensityTree(cloud.input(), {.fraction = 0.1f, .compensate = false}), light);
  std::printf("10 %% of 50,000: mean |dT| %.4f compensated, %.4f not\n", with, without);
  // 5,000 particles cannot carry the detail of 50,000; without wider radii it would be 0.089.
  EXPECT_LT(with, 0.06);
  EXPECT_GT(without, 4 * with);
}

TEST(AutoSubsample, TakesTheSmallestShareWithinTheError) {
  const Cloud cloud(50000);
  const layout::Light lights[] = {pointLight({2, 2, 2}), directionalLight({0, -1, 0})};
  const DensityTree all(cloud.input(), {});
  double before = 0;
  for (const double error : {0.05, 0.02, 0.005}) {
    const SubsampleChoice choice = autoSubsample(cloud.input(), {}, lights, {}, error);
    std::printf("error %.3f: fraction %.4f, measured %.4f\n", error, choice.fraction, choice.error);
    EXPECT_LE(choice.error, error);
    EXPECT_GE(choice.fraction, before);  // less error, more particles
    before = choice.fraction;
    if (choice.fraction == 1) continue;
    // All particles instead of 1,024 of them: four standard errors of the mean, and the probes' own luck in choosing.
    const DensityTree sampled(cloud.input(), {.fraction = choice.fraction});
    for (const layout::Light& light : lights) EXPECT_LE(meanError(cloud, all, sampled, light), 1.15 * error);
  }
  EXPECT_LT(autoSubsample(cloud.input(), {}, lights, {}, 0.05).fraction, 0.3);
  EXPECT_EQ(autoSubsample(cloud.input(), {}, lights, {}, 0).fraction, 1);
}

}  // namespace
}  // namespace mote
