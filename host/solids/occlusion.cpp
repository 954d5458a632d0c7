#include "host/solids/occlusion.h"

#include <cmath>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/solids/solid_walk.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 12;  // rays a task: about a millisecond

}  // namespace

std::vector<std::uint8_t> occluded(const SolidTree& tree, const Receivers& receivers,
                                   std::span<const std::uint8_t> wanted, const layout::Light& light) {
  if (!wanted.empty()) MOTE_CHECK(wanted.size(), ==, receivers.size());
  std::vector<std::uint8_t> result(receivers.size(), 0);
  if (tree.empty() || light.castsShadows == 0) return result;
  const auto [lo, hi] = tree.bounds();
  const auto nodeCount = static_cast<layout::uint>(tree.nodeCount());
  parallelBlocks(receivers.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      if (!wanted.empty() && wanted[k] == 0) continue;
      const SolidRay ray = makeSolidRay(receivers.position(k), light.position, light.direction, light.type, lo, hi);
      result[k] = anyBlocks(tree.nodes.data(), nodeCount, tree.triangles.data(), ray) ? 1 : 0;
    }
  });
  return result;
}

float surfaceOffset(const layout::Triangle& triangle, const vec3& point) {
  const dvec3 a(triangle.a), ab = dvec3(triangle.b) - a, ac = dvec3(triangle.c) - a, bc = ac - ab;
  const double longest = std::sqrt(std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(bc, bc)}));
  const double doubleArea = glm::length(glm::cross(ab, ac));
  const double sliver = doubleArea > 0 ? longest * longest / doubleArea : 1e30;
  const vec3 magnitude = glm::abs(point);
  return static_cast<float>(longest * std::min(2e-6 * sliver, 1e-3) +
                            1e-6 * std::max({magnitude.x, magnitude.y, magnitude.z}));
}

}  // namespace mote
