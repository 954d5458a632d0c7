// Light within an error: the promise on every kind of cloud, determinism, and no flicker.
#include "host/core/simd_targets.h"
#include "host/lighting/approximate.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <glm/gtc/quaternion.hpp>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/lighting/medium.h"
#include "host/particles/generate.h"
#include "host/particles/particle_loader.h"
#include "host/particles/spacing.h"
#include "tests/support/lights.h"
#include "tests/support/same_bits.h"

namespace mote {
namespace {

struct Cloud {
  std::vector<vec3> position;
  std::vector<float> radius, density;

  /// Calibrated to a mean optical depth along lines.
  Octree tree(double opticalDepth) const {
    std::vector<float> peak = peakOpticalDepths(density, radius, layout::kFalloffSmooth, true, 1);
    const Octree raw = buildOctree(position, radius, peak);
    const auto scale = static_cast<float>(opticalDepth / meanLineOpticalDepth(raw, layout::kFalloffSmooth));
    for (float& p : peak) p *= scale;
    return buildOctree(position, radius, peak);
  }
};

/// Radii of `spacings` mean distances to the neighbours, spread log-uniformly over `range`.
Cloud cloudOf(ParticleSet set, double spacings, double range = 1) {
  Cloud cloud{std::move(set.position), {}, std::move(set.density)};
  const double radius = spacings * meanNeighbourDistance(cloud.position);
  for (std::size_t i = 0; i < cloud.position.size(); ++i)
    cloud.radius.push_back(static_cast<float>(radius * std::pow(range, uniformDouble(hashBits(1, i)) - 0.5)));
  if (cloud.density.empty()) cloud.density.assign(cloud.position.size(), 1);
  return cloud;
}

Cloud noiseCloud(std::size_t count, double spacings, double range = 1) {
  return cloudOf(generateParticles(Generator::Cloud, count, 3, 1), spacings, range);
}

/// Two halves of a ball, a thousand diameters apart.
Cloud twoClusters(std::size_t count) {
  Cloud cloud = cloudOf(generateBall(count, 5), 1.5);
  for (vec3& p : cloud.position)
    if (p.x > 0) p.x += 2000;
  return cloud;
}

Cloud smoke1() {
  ParticleSource source;
  source.file = std::string(MOTE_SHARED_DATA) + "/smoke1/smoke1_350k_power05.prt";
  return cloudOf(loadParticles({source}, 1, DensityMode::CrossSection, nullptr), 1.5);
}

const char* nameOf(DepthMethod method) {
  return method == DepthMethod::Grid ? "grid" : method == DepthMethod::Detail ? "detail" : "exact";
}

double meanDifference(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(double(a[i]) - double(b[i]));
  return sum / static_cast<double>(a.size());
}

/// Holds every allowed error against all particles' exact transmittances; returns how often a grid was used.
int holdThePromise(const char* name, const Cloud& cloud, double opticalDepth,
                   const std::vector<layout::Light>& lights) {
  const Octree tree = cloud.tree(opticalDepth);
  int grids = 0;
  for (const layout::Light& light : lights) {
    const std::vector<float> exact = transmittances(opticalDepths(tree, light, {}), light);
    for (const double error : {0.02, 0.01, 0.005, 0.002, 0.001}) {
      Approximation how;
      const std::vector<float> found =
          transmittances(approximateOpticalDepths(tree, slotsOf(tree), light, {}, {error}, how), light);
      const double mean = meanDifference(exact, found);
      EXPECT_LE(mean, error) << name << " light " << light.type;
      EXPECT_LE(how.error.upper, error);
      grids += how.method != DepthMethod::Exact;
      std::printf("%-14s %-11s %.3f: %-5s cell %.2f r, %d tries, mean %.5f (measured %.5f, upper %.5f)\n", name,
                  light.type == layout::kLightPoint ? "point" : "directional", error, nameOf(how.method), how.cellRadii,
                  how.tries, mean, how.error.mean, how.error.upper);
      if (how.method == DepthMethod::Exact) {
        EXPECT_EQ(mean, 0);
        continue;
      }
      // 2,048 probes tell the mean to a few percent: 4.5 standard errors, as upper is 2.3 of them above.
      EXPECT_NEAR(mean, how.error.mean, 2 * (how.error.upper - how.error.mean) + 1e-7);
      EXPECT_EQ(how.error.probes, kErrorProbes);
      EXPECT_GE(how.error.greatest, how.error.p99);
    }
  }
  return grids;
}

TEST(Approximate, KeepsTheErrorOnBalls) {
  EXPECT_GE(holdThePromise("ball", cloudOf(generateBall(100000, 1), 1.5), 4,
                           {pointLight({2, 3, 1}), pointLight({0.2f, 0.1f, 0}), directionalLight({0, -1, 0.2f})}),
            6);
}
TEST(Approximate, KeepsTheErrorOnClouds) {
  EXPECT_GE(holdThePromise("cloud", noiseCloud(150000, 1.5), 4, {pointLight({2, 3, 1}), directionalLight({1, -1, 0})}),
            5);
}
TEST(Approximate, KeepsTheErrorWhereManyParticlesOverlap) {
  EXPECT_GE(holdThePromise("overlapping", noiseCloud(100000, 4), 4, {pointLight({2, 3, 1})}), 4);
}
TEST(Approximate, KeepsTheErrorOnPlumes) {
  EXPECT_GE(holdThePromise("plume", cloudOf(generateParticles(Generator::Plume, 100000, 1, 1), 1.5), 4,
                           {pointLight({2, 3, 1}), directionalLight({0, -1, 0})}),
            4);
}
TEST(Approximate, KeepsTheErrorForMixedRadii) {
  EXPECT_GE(holdThePromise("mixed radii", noiseCloud(100000, 2, 10), 4, {pointLight({2, 3, 1})}), 2);
}
TEST(Approximate, KeepsTheErrorWhereItIsVeryDense) {
  EXPECT_GE(holdThePromise("tau 50", noiseCloud(100000, 1.5), 50, {pointLight({2, 3, 1})}), 2);
}
TEST(Approximate, KeepsTheErrorWhereItIsVeryThin) {
  EXPECT_GE(holdThePromise("tau 0.1", noiseCloud(100000, 1.5), 0.1, {directionalLight({1, 1, 1})}), 2);
}
TEST(Approximate, KeepsTheErrorOnClustersFarApart) {
  EXPECT_GE(
      holdThePromise("two clusters", twoClusters(100000), 4, {directionalLight({0, -1, 0}), pointLight({1000, 9, 0})}),
      1);
}
TEST(Approximate, KeepsTheErrorOnRealSmoke) {
  EXPECT_GE(holdThePromise("smoke1", smoke1(), 4, {pointLight({2, 3, 1}), directionalLight({1, -1, 0})}), 4);
}

TEST(Approximate, LevelOfDetailServesWhereVeryManyOverlap) {
  const Octree tree = noiseCloud(150000, 10).tree(4);
  const layout::Light light = pointLight({2, 3, 1});
  const std::vector<float> exact = transmittances(opticalDepths(tree, light, {}), light);
  Approximation how;
  const std::vector<float> found =
      transmittances(approximateOpticalDepths(tree, slotsOf(tree), light, {}, {0.0007}, how), light);
  EXPECT_EQ(how.method, DepthMethod::Detail);
  EXPECT_GT(how.tolerance, 0);
  EXPECT_LT(how.treeParticles, tree.particleCount());
  EXPECT_LE(meanDifference(exact, found), 0.0007);
  EXPECT_GT(how.error.mean, 0);
}

TEST(Approximate, TakesEverythingFromTheSourcesThatAreGiven) {
  const Octree tree = noiseCloud(100000, 1.5).tree(4), wide = noiseCloud(150000, 10).tree(4);
  const layout::Light light = pointLight({2, 3, 1});
  int exact = 0, grid = 0;
  DepthSources counted = hostDepths();
  counted.exact = [&](auto&&... of) { return ++exact, hostDepths().exact(of...); };
  counted.grid = [&](auto&&... of) { return ++grid, hostDepths().grid(of...); };
  const auto depths = [&](const Octree& of, double error) {
    Approximation how;
    return approximateOpticalDepths(of, slotsOf(of), light, {}, {error}, how, {}, {}, counted);
  };
  exact = grid = 0, depths(tree, 0);
  EXPECT_EQ(exact, 1);
  EXPECT_EQ(grid, 0);
  exact = grid = 0, depths(tree, 0.02);
  EXPECT_EQ(exact, 0);
  EXPECT_GE(grid, 1);
  exact = grid = 0, depths(wide, 0.0007);  // level of detail: exact sums of stand-ins
  EXPECT_GE(exact, 1);
}

TEST(Approximate, ThreeColoursAndSpotsAndEveryFalloff) {
  const Cloud cloud = noiseCloud(200000, 2);  // for fewer, exact sums are cheaper than the probes
  layout::Light spot = pointLight({0, 4, 0});
  spot.type = layout::kLightSpot;
  for (const layout::uint falloff : {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere}) {
    const std::vector<float> peak = peakOpticalDepths(cloud.density, cloud.radius, falloff, true, 1);
    std::vector<float> peaks[3];
    const double scale = 4 / meanLineOpticalDepth(buildOctree(cloud.position, cloud.radius, peak), falloff);
    for (std::size_t i = 0; i < peak.size(); ++i)
      for (int c = 0; c < 3; ++c)
        peaks[c].push_back(static_cast<float>(peak[i] * scale * (0.3 + uniformDouble(hashBits(2, i, c)))));
    const Octree tree = buildOctree({cloud.position, cloud.radius, peaks[0], peaks[1], peaks[2]});
    std::vector<std::uint8_t> reached(tree.particleCount());
    for (std::size_t i = 0; i < reached.size(); ++i) reached[i] = tree.x[i] > 0;
    const LightingOptions options{.falloff = falloff};
    const std::size_t count = reached.size();
    const std::vector<float> exact =
        transmittances(opticalDepths(tree, slotsOf(tree), spot, options, reached), count, spot, vec3(1));
    Approximation how;
    const std::vector<float> found = transmittances(
        approximateOpticalDepths(tree, slotsOf(tree), spot, options, {0.02}, how, reached), count, spot, vec3(1));
    ASSERT_EQ(found.size(), 3 * count);
    EXPECT_EQ(how.method, DepthMethod::Grid);
    double sum = 0;
    std::size_t lit = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (reached[i % count] == 0) {
        ASSERT_EQ(found[i], 1);
      } else {
        sum += std::abs(found[i] - exact[i]), ++lit;
      }
    }
    EXPECT_LE(sum / static_cast<double>(lit), 0.02);
    EXPECT_GT(sum, 0);
  }
}

TEST(LightGrid, ReceiversThatAreNoSlotsReadTheSameGrid) {
  const Octree tree = noiseCloud(20000, 2).tree(3);
  const Receivers slots = slotsOf(tree);
  // Every third slot with its own particle left out, as receivers of their own, in another order.
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> self;
  for (std::size_t k = tree.particleCount(); k-- > 0;)
    if (k % 3 == 0)
      x.push_back(tree.x[k]), y.push_back(tree.y[k]), z.push_back(tree.z[k]),
          self.push_back(static_cast<std::uint32_t>(k));
  for (const layout::Light& light :
       {pointLight({2, 3, 1}), pointLight({0.1f, 0, 0.1f}), directionalLight({1, -1, 0.3f})}) {
    const GridResolution fine{0.3 * tree.meanRadius / (light.type == layout::kLightPoint ? 1.5 : 1), tree.meanRadius};
    const std::vector<float> all = gridOpticalDepths(tree, slots, light, {}, fine);
    const std::vector<float> own = gridOpticalDepths(tree, {x, y, z, self}, light, {}, fine);
    for (std::size_t k = 0; k < self.size(); ++k) ASSERT_NEAR(own[k], all[self[k]], 2e-5 * (1 + all[self[k]])) << k;
  }
}

TEST(LightGrid, ParticlesFarApartInDepthCostNoMemoryBetween) {
  // Two clusters one behind the other, a hundred thousand radii apart: the bins between are left out.
  Cloud cloud = noiseCloud(20000, 1.5);
  const double radius = cloud.radius.front();
  for (std::size_t i = 0; i < cloud.position.size(); ++i)
    if (i % 2 == 0) cloud.position[i].z += static_cast<float>(1e5 * radius);
  const Octree tree = cloud.tree(3);
  const layout::Light light = directionalLight({0, 0, 1});
  const std::vector<float> exact = transmittances(opticalDepths(tree, light, {}), light);
  const std::vector<float> found =
      transmittances(gridOpticalDepths(tree, slotsOf(tree), light, {}, {0.5 * radius, radius}), light);
  EXPECT_LT(meanDifference(exact, found), 0.01);
}

/// Mean |ΔT| of grids of 1, ½ and ¼ radii.
std::array<double, 3> errorsOfFinerGrids(const Octree& tree, const Receivers& receivers, const layout::Light& light) {
  const double distance = light.type == layout::kLightPoint && light.position.y > 1 ? std::sqrt(14.0) : 1;
  const std::vector<float> exact = transmittances(opticalDepths(tree, receivers, light, {.cutoff = 0}), light);
  std::array<double, 3> errors{};
  for (std::size_t k = 0; k < errors.size(); ++k) {
    const double length = std::pow(0.5, static_cast<double>(k)) * tree.meanRadius;
    errors[k] = meanDifference(
        exact,
        transmittances(gridOpticalDepths(tree, receivers, light, {.cutoff = 0}, {length / distance, length}), light));
    std::printf("light %u, cells of %.2f radii: mean |dT| %.1e\n", light.type, length / tree.meanRadius, errors[k]);
  }
  return errors;
}

TEST(LightGrid, ConvergesToTheExactSumAsItBecomesFiner) {
  const Octree tree = noiseCloud(30000, 2).tree(3);
  // Receivers out of the cloud: with a light out of it too, particles lie wholly in a ray's way or beside it.
  std::vector<float> x, y, z;
  for (std::size_t i = 0; i < 8000; ++i) {
    const dvec3 place = 6.0 * Random(8, i).direction();
    x.push_back(static_cast<float>(place.x)), y.push_back(static_cast<float>(place.y));
    z.push_back(static_cast<float>(place.z));
  }
  const std::vector<std::uint32_t> none(x.size(), kNoSlot);
  const layout::Light outside = pointLight({2, 3, 1}), inside = pointLight({0.1f, 0, 0.1f}),
                      sun = directionalLight({1, -1, 0.3f});
  for (const layout::Light& light : {outside, inside, sun}) {
    const std::array<double, 3> errors = errorsOfFinerGrids(tree, {x, y, z, none}, light);
    EXPECT_GT(errors[0], 0);
    for (std::size_t k = 1; k < errors.size(); ++k) EXPECT_LT(errors[k], 0.6 * errors[k - 1]);
  }
  for (const layout::Light& light : {outside, inside, sun}) {
    const std::array<double, 3> errors = errorsOfFinerGrids(tree, slotsOf(tree), light);
    for (std::size_t k = 1; k < errors.size(); ++k) EXPECT_LT(errors[k], 0.6 * errors[k - 1]);
    EXPECT_LE(errors[2], 1.5e-3);
  }
}

TEST(LightGrid, AFinerGridIsABetterOneAtEveryStep) {
  // Where windows change and kernels become tents, weights must not be worse than on a coarser grid.
  for (const layout::uint falloff : {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere}) {
    const Octree tree = noiseCloud(60000, 1.5).tree(4);
    const layout::Light light = directionalLight({1, -1, 0.3f});
    const LightingOptions options{.falloff = falloff, .cutoff = 0};
    const std::vector<float> exact = transmittances(opticalDepths(tree, light, options), light);
    const auto errorOf = [&](double cell) {
      const double length = cell * tree.meanRadius;
      return meanDifference(
          exact, transmittances(gridOpticalDepths(tree, slotsOf(tree), light, options, {length, 2 * length}), light));
    };
    double last = 1;
    for (const double cell : {0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3}) {
      const double error = errorOf(cell);
      EXPECT_LT(error, 0.95 * last) << "falloff " << falloff << " cell " << cell;
      last = error;
    }
    if (falloff == layout::kFalloffSmooth) {
      EXPECT_LT(errorOf(0.4), 0.24 * errorOf(0.8));
    }
  }
}

TEST(LightGrid, AParticleNearTheLightKeepsItsTotalOnEveryPartOfTheCube) {
  for (const dvec3& direction : {dvec3(1, 0, 0), dvec3(5, 2, 0), dvec3(5, 4, 4), dvec3(1, 0.999, 0)}) {
    const dvec3 axis = glm::normalize(direction);
    const std::vector<vec3> position{vec3(axis * 5.0)};
    const std::vector<float> one{1};
    const Octree tree = buildOctree(position, one, one);
    std::vector<float> x, y, z;
    for (std::size_t i = 0; i < 200000; ++i) {
      const dvec3 d = Random(2, i).direction();
      if (glm::dot(d, axis) < 0.95) continue;  // the particle is 11.5° wide from its middle
      x.push_back(static_cast<float>(10 * d.x)), y.push_back(static_cast<float>(10 * d.y));
      z.push_back(static_cast<float>(10 * d.z));
    }
    const std::vector<std::uint32_t> self(x.size(), kNoSlot);
    const Receivers receivers{x, y, z, self};
    double exact = 0, found = 0;
    for (const float depth : opticalDepths(tree, receivers, pointLight({0, 0, 0}), {.cutoff = 0})) exact += depth;
    for (const float depth : gridOpticalDepths(tree, receivers, pointLight({0, 0, 0}), {.cutoff = 0}, {0.01, 0.25}))
      found += depth;
    EXPECT_NEAR(found / exact, 1, 2e-3) << direction.x << ' ' << direction.y << ' ' << direction.z;
  }
}

TEST(LightGrid, TheSameBitsOnEveryInstructionSetAndAnyNumberOfThreads) {
  const Octree tree = noiseCloud(30000, 1.5, 3).tree(4);
  const layout::Light light = pointLight({0.3f, 2, 1});
  const GridResolution resolution{0.3 * tree.meanRadius, 1.5 * tree.meanRadius};
  expectSameBits([&] { return gridOpticalDepths(tree, slotsOf(tree), light, {}, resolution); });
}

TEST(Approximate, ProbesFewAndFarBetweenAreExact) {
  for (const Cloud& cloud : {noiseCloud(40000, 2), noiseCloud(40000, 2, 10), twoClusters(40000)}) {
    const Octree tree = cloud.tree(3);
    std::vector<float> x, y, z;
    std::vector<std::uint32_t> self;
    for (std::size_t i = 0; i < 500; ++i) {
      const auto slot = static_cast<std::uint32_t>(hashBits(4, i) % tree.particleCount());
      x.push_back(tree.x[slot]), y.push_back(tree.y[slot]), z.push_back(tree.z[slot]), self.push_back(slot);
    }
    const Receivers few{x, y, z, self};
    for (const layout::Light& light :
         {pointLight({2, 3, 1}), pointLight({0.1f, 0, 0.1f}), directionalLight({1, -1, 0.3f})})
      for (const layout::uint falloff : {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere})
        for (const layout::uint endpoint : {layout::kEndpointSoft, layout::kEndpointClamp}) {
          const LightingOptions options{.falloff = falloff, .endpoint = endpoint, .cutoff = 0};
          const std::vector<float> exact = opticalDepths(tree, few, light, options);
          const std::vector<float> found = opticalDepthsOfFew(tree, few, light, options);
          for (std::size_t i = 0; i < exact.size(); ++i) ASSERT_NEAR(found[i], exact[i], 1e-5 * (1 + exact[i]));
          for (const std::string& target : simdTargets()) {
            useSimdTarget(target);
            EXPECT_EQ(opticalDepthsOfFew(tree, few, light, options), found) << target;
          }
          useSimdTarget("");
        }
  }
}

/// Greatest mean |ΔT| between neighbouring frames of a cloud and its light that move together, so that nothing changes
/// but where they stand in the grid.
double flicker(const Cloud& cloud, const layout::Light& light, double error, std::vector<DepthMethod>& chosen,
               const std::function<void(int, vec3&, bool)>& move) {
  double greatest = 0;
  std::vector<float> last;
  for (int frame = 0; frame < 6; ++frame) {
    Cloud moved = cloud;
    for (vec3& p : moved.position) move(frame, p, false);
    layout::Light with = light;
    move(frame, with.position, false);
    move(frame, with.direction, true);
    const Octree tree = buildOctree(moved.position, moved.radius, moved.density);
    Approximation how;
    const std::vector<float> slots =
        transmittances(approximateOpticalDepths(tree, slotsOf(tree), with, {}, {error, true}, how), with);
    chosen.push_back(how.method);
    std::vector<float> found(slots.size());
    for (std::size_t slot = 0; slot < slots.size(); ++slot) found[tree.source[slot]] = slots[slot];
    if (!last.empty()) greatest = std::max(greatest, meanDifference(last, found));
    last = std::move(found);
  }
  return greatest;
}

/// Holds noise clouds that turn or drift with their light against a quarter of each allowed error; returns how each
/// frame was lit.
std::vector<DepthMethod> holdStill(std::size_t count, double spacings, const std::vector<double>& errors) {
  Cloud cloud = noiseCloud(count, spacings);
  const Octree tree = cloud.tree(4);
  for (std::size_t slot = 0; slot < tree.particleCount(); ++slot) cloud.density[tree.source[slot]] = tree.peak[slot];
  const auto turn = [](int frame, vec3& p, bool) {
    p = vec3(glm::angleAxis(0.3 * frame * kPi / 180, glm::normalize(dvec3(1, 3, 2))) * dvec3(p));
  };
  const double radius = tree.meanRadius;
  const auto drift = [radius](int frame, vec3& p, bool direction) {
    if (!direction) p += vec3(glm::normalize(dvec3(2, 1, -1)) * (0.1 * radius * frame));
  };
  std::vector<DepthMethod> chosen;
  for (const layout::Light& light : {pointLight({2, 3, 1}), directionalLight({0.3f, -1, 0.2f})})
    for (const double error : errors) {
      const double turning = flicker(cloud, light, error, chosen, turn),
                   drifting = flicker(cloud, light, error, chosen, drift);
      std::printf("light %u error %.4f %-6s: between frames, turning %.6f, drifting %.6f\n", light.type, error,
                  nameOf(chosen.back()), turning, drifting);
      EXPECT_LE(turning, error / 4);
      EXPECT_LE(drifting, error / 4);
    }
  return chosen;
}

TEST(Approximate, DoesNotFlicker) {
  const std::vector<DepthMethod> chosen = holdStill(150000, 3, {0.04, 0.02, 0.01});
  // Of 72 frames: exact light does not flicker anyway.
  EXPECT_LE(std::count(chosen.begin(), chosen.end(), DepthMethod::Exact), 32);
}
TEST(Approximate, LevelOfDetailDoesNotFlicker) {
  const std::vector<DepthMethod> chosen = holdStill(110000, 8, {0.006, 0.004});
  EXPECT_EQ(std::count(chosen.begin(), chosen.end(), DepthMethod::Detail), 48);  // all frames
}

}  // namespace
}  // namespace mote
