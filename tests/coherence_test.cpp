// Temporal coherence of the light (Monette 2011, §4.3): what moves together changes nothing, what moves a little
// changes little, and the tree's cells are not seen.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "host/core/random.h"
#include "host/lighting/lighting.h"
#include "host/lighting/medium.h"
#include "host/octree/morton.h"
#include "tests/support/lights.h"

namespace mote {
namespace {

constexpr layout::uint kEndpoints[] = {layout::kEndpointSoft, layout::kEndpointClamp};

struct Cloud {
  std::vector<vec3> position;
  std::vector<float> radius, peak;
};

Cloud ball(std::size_t count) {
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(21, i);
    cloud.position.emplace_back(random.direction() * std::cbrt(random.uniform()));
    cloud.radius.push_back(static_cast<float>(random.uniform(0.05, 0.1)));
    cloud.peak.push_back(static_cast<float>(random.uniform(0.01, 0.05)));
  }
  return cloud;
}

/// T of every particle in input order.
std::vector<float> lit(const Cloud& cloud, const layout::Light& light, layout::uint endpoint) {
  const Octree tree = buildOctree(cloud.position, cloud.radius, cloud.peak);
  const std::vector<float> slots =
      transmittances(opticalDepths(tree, light, {layout::kFalloffSmooth, endpoint, 0}), light);
  std::vector<float> result(slots.size());
  for (std::size_t slot = 0; slot < slots.size(); ++slot) result[tree.source[slot]] = slots[slot];
  return result;
}

double worst(const std::vector<float>& a, const std::vector<float>& b, std::size_t but = SIZE_MAX) {
  double difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (i != but) difference = std::max(difference, std::fabs(double(a[i]) - double(b[i])));
  return difference;
}

TEST(Coherence, ARigidMotionOfParticlesAndLightsLeavesEveryTransmittance) {
  const Cloud cloud = ball(20000);
  const layout::Light lights[] = {pointLight({2, 1, 1}), pointLight({0.2f, 0.1f, -0.3f}),
                                  directionalLight({0.3f, -1, 0.2f})};
  double found = 0;
  for (const layout::uint endpoint : kEndpoints)
    for (const layout::Light& light : lights) {
      const std::vector<float> still = lit(cloud, light, endpoint);
      for (int step = 1; step <= 4; ++step) {
        const glm::dquat turn = glm::angleAxis(0.37 * step, glm::normalize(dvec3(1, 2, -1)));
        const dvec3 shift(0.4 * step, -0.3 * step, 0.7 * step);
        Cloud moved = cloud;
        for (vec3& p : moved.position) p = vec3(turn * dvec3(p) + shift);
        layout::Light movedLight = light;
        movedLight.position = vec3(turn * dvec3(light.position) + shift);
        movedLight.direction = vec3(turn * dvec3(light.direction));
        found = std::max(found, worst(still, lit(moved, movedLight, endpoint)));
      }
    }
  std::printf("rigid motion: worst |dT| %.2e\n", found);
  EXPECT_LE(found, 1e-4);
}

// A particle that moves by d changes its share in a ray by at most L·|d| / r. For the smooth kernel F = (1 − q)²,
// |dF/db| ≤ 1.54 / r; each end's cap adds F·cap′ ≤ 0.75 / r along the ray, and by its half chord 0.11 / r across. So
// L = 1.54 + 2 · (0.75 + 0.11).
TEST(Coherence, AParticleThatMovesALittleChangesOthersByNoMoreThanTheKernelsSlope) {
  const Cloud cloud = ball(20000);
  constexpr double kSlope = 1.54 + 2 * (0.75 + 0.11);
  double most = 0;
  for (const layout::Light& light : {pointLight({2, 1, 1}), directionalLight({0.3f, -1, 0.2f})}) {
    const std::vector<float> still = lit(cloud, light, layout::kEndpointSoft);
    for (std::size_t k = 0; k < 12; ++k) {
      const std::size_t moving = 1 + k * 1600;
      Cloud moved = cloud;
      moved.position[moving] += vec3(Random(22, k).direction() * (0.01 * cloud.radius[moving]));
      const double change = worst(still, lit(moved, light, layout::kEndpointSoft), moving);
      // Rounding of T ≤ 1 and of a sum of hundreds of terms.
      EXPECT_LE(change, 0.01 * kSlope * cloud.peak[moving] + 1e-6) << "particle " << moving;
      EXPECT_GT(change, 0) << "particle " << moving << " shades nobody";
      most = std::max(most, change / (0.01 * kSlope * cloud.peak[moving]));
    }
  }
  std::printf("one particle moved by 1 %% of its radius: at most %.2f of the bound\n", most);
}

TEST(Coherence, AParticleThatCrossesACellBorderChangesNothing) {
  Cloud cloud = ball(20000);
  cloud.position[0] = {-1, -1, -1}, cloud.position[1] = {1, 1, 1};  // fix the root cell: its middle is the origin
  const std::size_t crossing = 7;
  Cloud other = cloud;
  cloud.position[crossing] = {-1e-8f, 0.2f, 0.3f}, other.position[crossing] = {1e-8f, 0.2f, 0.3f};
  const auto slotOf = [&](const Cloud& of) {
    const std::vector<std::uint32_t> order = mortonOrder(of.position);
    return std::find(order.begin(), order.end(), crossing) - order.begin();
  };
  ASSERT_GT(std::abs(slotOf(cloud) - slotOf(other)), 1000) << "the particle stays in its cell";
  for (const layout::uint endpoint : kEndpoints)
    for (const layout::Light& light : {pointLight({2, 1, 1}), directionalLight({0.3f, -1, 0.2f})}) {
      const double change = worst(lit(cloud, light, endpoint), lit(other, light, endpoint));
      EXPECT_LE(change, 2e-6);  // another order of the sums
    }
}

}  // namespace
}  // namespace mote
