// The density octree: every promise of the flattened layout, and bounds that are conservative.
#include "host/octree/octree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "host/core/parallel.h"
#include "host/core/random.h"

namespace mote {
namespace {

struct Cloud {
  std::vector<vec3> position;
  std::vector<float> radius, peak;
};

/// `spread` 0: uniform in a cube; larger: log-normal clusters with radii over three decades.
Cloud randomCloud(std::size_t count, std::uint64_t seed, double spread = 0) {
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    const double scale = std::exp(spread * random.normal());
    cloud.position.emplace_back(dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)) * scale);
    cloud.radius.push_back(static_cast<float>(0.05 * std::pow(1000.0, -random.uniform())));
    cloud.peak.push_back(static_cast<float>(random.uniform()));
  }
  return cloud;
}

Octree build(const Cloud& cloud, std::uint32_t particlesPerCell = kDefaultParticlesPerCell) {
  return buildOctree(cloud.position, cloud.radius, cloud.peak, particlesPerCell);
}

TEST(Octree, KeepsEveryPromiseOfTheLayoutForManySizesAndCells) {
  for (const std::size_t count : {0, 1, 2, 7, 8, 9, 31, 32, 33, 1000, 100000})
    for (const std::uint32_t cell : {1u, 8u, 32u, 1000u})
      EXPECT_EQ(validate(build(randomCloud(count, 1), cell), cell), "") << count << " particles, cells of " << cell;
}

TEST(Octree, KeepsThemForClustersOverManyScales) {
  EXPECT_EQ(validate(build(randomCloud(100000, 2, 4.0)), kDefaultParticlesPerCell), "");
}

TEST(Octree, KeepsThemForEqualPositionsLinesAndPlanes) {
  Cloud cloud = randomCloud(5000, 3);
  for (std::size_t i = 0; i < 5000; ++i) {
    if (i < 2000)
      cloud.position[i] = {0.25f, 0.25f, 0.25f};
    else if (i < 3000)
      cloud.position[i].x = cloud.position[i].y = 0;
    else if (i < 4000)
      cloud.position[i].z = -1;
  }
  EXPECT_EQ(validate(build(cloud, 8), 8), "");
  std::fill(cloud.position.begin(), cloud.position.end(), vec3(3, -4, 5));
  const Octree single = build(cloud, 8);
  EXPECT_EQ(validate(single, 8), "");
  EXPECT_EQ(single.nodeCount(), 1u) << "no cut parts particles at one position";
}

TEST(Octree, KeepsThemFarFromTheOriginAndAtExtremeScales) {
  for (const float scale : {1e-15f, 1e15f}) {
    Cloud cloud = randomCloud(3000, 4);
    for (vec3& p : cloud.position) p = (p + vec3(100, 0, -50)) * scale;
    for (float& r : cloud.radius) r *= scale;
    EXPECT_EQ(validate(build(cloud), kDefaultParticlesPerCell), "") << scale;
  }
}

TEST(Octree, BoundsHoldRandomPointsOfEverySupport) {
  // Against the definition and not against validate(): points inside a particle's ball lie in each of its nodes.
  const Cloud cloud = randomCloud(3000, 5, 1.0);
  const Octree tree = build(cloud, 16);
  std::size_t checked = 0;
  for (std::size_t index = 0; index < tree.nodeCount(); ++index) {
    const layout::Node& node = tree.nodes[index];
    for (std::size_t slot = node.first; slot < tree.nodes[node.skip].first; ++slot) {
      Random random(6, slot);
      for (int k = 0; k < 4; ++k, ++checked) {
        const dvec3 point = dvec3(tree.position(slot)) + double(tree.radius[slot]) * random.direction();
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_GE(point[axis], double(node.lo[axis]));
          ASSERT_LE(point[axis], double(node.hi[axis]));
        }
      }
    }
  }
  EXPECT_GT(checked, 3000u * 4);
}

TEST(Octree, BoundsAreTight) {
  // Each face of each leaf touches some support, up to the one rounding step outwards.
  const Octree tree = build(randomCloud(2000, 7), 16);
  for (std::size_t index = 0; index < tree.nodeCount(); ++index) {
    const layout::Node& node = tree.nodes[index];
    Bounds supports;
    for (std::size_t slot = node.first; slot < tree.nodes[node.skip].first; ++slot)
      supports.add(Bounds{tree.position(slot) - tree.radius[slot], tree.position(slot) + tree.radius[slot]});
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(node.lo[axis], supports.lo[axis], 2e-7f);
      EXPECT_NEAR(node.hi[axis], supports.hi[axis], 2e-7f);
    }
  }
}

TEST(Octree, ValidateFindsEachKindOfDamage) {
  const Octree good = build(randomCloud(1000, 8), 16);
  ASSERT_EQ(validate(good, 16), "");
  const auto broken = [&](auto damage) {
    Octree tree = good;
    damage(tree);
    return validate(tree, 16);
  };
  EXPECT_NE(broken([](Octree& t) { t.nodes[3].lo.x += 0.1f; }), "");
  EXPECT_NE(broken([](Octree& t) { t.nodes[0].hi.z -= 1e-3f; }), "");
  EXPECT_NE(broken([](Octree& t) { t.nodes[1].skip += 1; }), "");
  EXPECT_NE(broken([](Octree& t) { t.nodes[5].first += 1; }), "");
  EXPECT_NE(broken([](Octree& t) { t.source[4] = t.source[5]; }), "");
  EXPECT_NE(broken([](Octree& t) { std::swap(t.x[0], t.x[999]); }), "");
  EXPECT_NE(broken([](Octree& t) { t.nodes.pop_back(); }), "");
  EXPECT_NE(broken([](Octree& t) { t.radius[17] *= 3; }), "");
  EXPECT_NE(validate(good, 4), "") << "leaves of up to 16 are more than 4";
}

TEST(Octree, IsTheSameForAnyNumberOfThreads) {
  const Cloud cloud = randomCloud(200000, 9, 1.0);
  const auto once = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return build(cloud);
  };
  const Octree one = once(1), seven = once(7);
  EXPECT_EQ(one.source, seven.source);
  ASSERT_EQ(one.nodes.size(), seven.nodes.size());
  EXPECT_EQ(0, std::memcmp(one.nodes.data(), seven.nodes.data(), one.nodes.size() * sizeof(layout::Node)));
}

}  // namespace
}  // namespace mote
