// A light grid by patches is the grid that goes tile by tile, and its patches have what they must.
#include "host/lighting/grid/patches.h"

#include <gtest/gtest.h>

#include <cmath>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/lighting/exact/beam_kernel.h"
#include "host/lighting/grid/field.h"
#include "host/lighting/grid/light_grid.h"
#include "host/particles/generate.h"
#include "host/particles/spacing.h"
#include "tests/support/lights.h"
#include "tests/support/same_bits.h"

namespace mote {
namespace {

/// A noise cloud; radii of 1.5 spacings, spread log-uniformly over `range`.
Octree cloudTree(std::size_t count, double range, bool colours = false) {
  const std::vector<vec3> position = generateParticles(Generator::Cloud, count, 3, 1).position;
  const double radius = 1.5 * meanNeighbourDistance(position);
  std::vector<float> radii, peak[3];
  for (std::size_t i = 0; i < count; ++i) {
    radii.push_back(static_cast<float>(radius * std::pow(range, uniformDouble(hashBits(1, i)) - 0.5)));
    for (int c = 0; c < 3; ++c)
      peak[c].push_back(0.02f + 0.01f * static_cast<float>((i + static_cast<std::size_t>(c)) % 3));
  }
  if (colours) return buildOctree({position, radii, peak[0], peak[1], peak[2]});
  return buildOctree(position, radii, peak[0]);
}

/// Lights that a cloud about the origin is seen from on one face, on three, and through a plane.
std::vector<layout::Light> lightsOutside() {
  return {pointLight({0.3f, 6, 0.2f}), pointLight({4, 4.1f, 3.9f}), directionalLight({1, -1, 0.3f})};
}

/// Cells of `cell` mean radii at the middle of the cloud.
GridResolution resolutionOf(const Octree& tree, const layout::Light& light, double cell) {
  const double distance = light.type == layout::kLightPoint ? glm::length(dvec3(light.position)) : 1;
  return {cell * tree.meanRadius / distance, 2 * cell * tree.meanRadius};
}

bool goesByPatches(const Octree& tree, const layout::Light& light, const GridResolution& resolution) {
  const GridShape shape = gridShape(light, resolution, layout::kFalloffSmooth);
  const auto plan = planPatches(tree, shape);
  return plan && GridField(plan->patches, shape.faces.size(), (1 << 19) + 5 * tree.particleCount()).fits;
}

TEST(GridPatches, GiveTheSameGridAsTiles) {
  for (const double range : {1.0, 10.0})
    for (const bool colours : {false, true})
      for (const layout::Light& light : lightsOutside()) {
        const Octree tree = cloudTree(20000, range, colours);
        const GridResolution resolution = resolutionOf(tree, light, 0.8);
        ASSERT_TRUE(goesByPatches(tree, light, resolution));
        const std::vector<float> patches = gridOpticalDepths(tree, slotsOf(tree), light, {}, resolution);
        // The same points as receivers of their own go by tiles.
        const std::vector<float> x = tree.x, y = tree.y, z = tree.z;
        const Receivers slots = slotsOf(tree);
        const Receivers others{std::span(x).first(slots.size()), std::span(y).first(slots.size()),
                               std::span(z).first(slots.size()), slots.self};
        const std::vector<float> tiles = gridOpticalDepths(tree, others, light, {}, resolution);
        ASSERT_EQ(patches.size(), tiles.size());
        double greatest = 0, deepest = 0;
        for (std::size_t k = 0; k < tiles.size(); ++k) {
          greatest = std::max<double>(greatest, std::abs(patches[k] - tiles[k]));
          deepest = std::max<double>(deepest, tiles[k]);
        }
        EXPECT_GT(deepest, 1);
        EXPECT_LE(greatest, 2e-6 * deepest) << "range " << range << " light " << light.type;
      }
}

TEST(GridPatches, AreTheSameBitsOnEveryInstructionSetAndAnyNumberOfThreads) {
  for (const layout::Light& light : lightsOutside()) {
    const Octree tree = cloudTree(30000, 4);
    const GridResolution resolution = resolutionOf(tree, light, 0.7);
    ASSERT_TRUE(goesByPatches(tree, light, resolution));
    expectSameBits([&] { return gridOpticalDepths(tree, slotsOf(tree), light, {}, resolution); });
  }
}

TEST(GridPatches, LightOnlyWhatIsReached) {
  const Octree tree = cloudTree(20000, 1);
  const layout::Light light = pointLight({4, 4.1f, 3.9f});
  const GridResolution resolution = resolutionOf(tree, light, 0.8);
  std::vector<std::uint8_t> reached(tree.particleCount());
  for (std::size_t k = 0; k < reached.size(); ++k) reached[k] = k % 3 == 0;
  const std::vector<float> all = gridOpticalDepths(tree, slotsOf(tree), light, {}, resolution);
  std::size_t lit = 0;
  const std::vector<float> some = gridOpticalDepths(tree, slotsOf(tree), light, {}, resolution, reached);
  for (std::size_t k = 0; k < all.size(); ++k) {
    ASSERT_EQ(some[k], reached[k] != 0 ? all[k] : 0) << k;
    lit += some[k] > 0;
  }
  EXPECT_GT(lit, reached.size() / 4);
}

TEST(GridPatches, HaveEverySlotOnceAndEveryNodeOfItsKernel) {
  const Octree tree = cloudTree(30000, 4);
  for (const layout::Light& light : lightsOutside())
    for (const double cell : {1.0, 0.3}) {
      const GridShape shape = gridShape(light, resolutionOf(tree, light, cell), layout::kFalloffSmooth);
      const auto plan = planPatches(tree, shape);
      ASSERT_TRUE(plan);
      std::vector<int> stands(tree.particleCount(), 0);
      std::size_t several = 0;
      for (const GridPatch& patch : plan->patches) {
        const NodeRange nodes = patch.footprint();
        EXPECT_LT(nodes.hi.x - nodes.lo.x, plan->mostNodes);
        EXPECT_LT(nodes.hi.y - nodes.lo.y, plan->mostNodes);
        EXPECT_LE(patch.bins, plan->mostBins);
        EXPECT_LE(patch.nearestBin, patch.firstBin);
        EXPECT_GE(patch.deepestBin, patch.firstBin + patch.bins);
        several += patch.count() > 100;
        const LightFrame& frame = shape.faces[patch.face];
        for (std::size_t i = 0; i < patch.count(); ++i) {
          const std::size_t slot = patch.slot(i);
          stands[slot] += patch.standsOnFace(i);
          const dvec3 centre = dvec3(tree.position(slot)) - frame.origin;
          const NodeRange own = nodeRange(centre, tree.radius[slot], frame, shape);
          ASSERT_TRUE(glm::all(glm::greaterThanEqual(own.lo, patch.nodes.lo - 1e-6))) << slot;
          ASSERT_TRUE(glm::all(glm::lessThanEqual(own.hi, patch.nodes.hi + 1e-6))) << slot;
        }
      }
      for (const int count : stands) ASSERT_EQ(count, 1);
      if (cell == 1) {
        EXPECT_GT(several, 10u);  // few and large, or nothing is gained
      }
    }
}

TEST(GridPatches, AreNoneWhereAParticleIsInNoGrid) {
  const GridResolution resolution{0.1, 0.1};
  const std::vector<vec3> position{{0, 0, 0}, {1, 0, 0}};
  const std::vector<float> radius{0.1f, 0.1f}, none{0.1f, 0}, peak{1, 1};
  const auto plan = [&](const std::vector<float>& radii, const vec3& light) {
    return planPatches(buildOctree(position, radii, peak),
                       gridShape(pointLight(light), resolution, layout::kFalloffSmooth));
  };
  EXPECT_TRUE(plan(radius, {0, 0, 3}));
  EXPECT_FALSE(plan(radius, {0, 0, 0.3f}));  // within four radii of the light
  EXPECT_FALSE(plan(radius, {0, 0, 0}));
  EXPECT_FALSE(plan(none, {0, 0, 3}));
}

TEST(GridPatches, AreNoneWhereParticlesStandFarApart) {
  std::vector<vec3> position;
  for (int i = 0; i < 20 * 20 * 20; ++i) position.emplace_back(i % 20, i / 20 % 20, i / 400);
  const std::vector<float> peak(position.size(), 1);
  const auto plan = [&](float radius) {
    return planPatches(buildOctree(position, std::vector<float>(position.size(), radius), peak),
                       gridShape(directionalLight({0, 0, 1}), {radius, 2 * radius}, layout::kFalloffSmooth));
  };
  EXPECT_FALSE(plan(0.01f));  // a hundred cells from one to the next: each would be a patch
  const auto close = plan(1);
  ASSERT_TRUE(close);
  EXPECT_LT(close->patches.size(), position.size() / 100);
}

}  // namespace
}  // namespace mote
