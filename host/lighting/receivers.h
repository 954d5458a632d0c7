// The points that light is computed for: every particle, and the surface points of solids.
#pragma once
#include <cstdint>
#include <span>

#include "host/core/vec.h"
#include "host/octree/octree.h"

namespace mote {

/// "No slot": a receiver that is no particle of the tree leaves nothing out of its sum.
constexpr std::uint32_t kNoSlot = 0xffffffffu;

/// Views of arrays that somebody else owns. Neighbours in the arrays should be neighbours in space (Morton order),
/// which is kind to caches.
struct Receivers {
  std::span<const float> x, y, z;  ///< where they are [scene units]; all of one length
  std::span<const std::uint32_t>
      self;  ///< the tree's slot that each leaves out, or kNoSlot; empty: receiver k is slot k

  std::size_t size() const { return x.size(); }
  vec3 position(std::size_t k) const { return {x[k], y[k], z[k]}; }
  Bounds bounds() const;  ///< of the points; parallel
  std::uint32_t selfOf(std::size_t k) const { return self.empty() ? static_cast<std::uint32_t>(k) : self[k]; }
};

/// Every slot of a tree, each leaving itself out.
inline Receivers slotsOf(const Octree& tree) {
  const std::size_t count = tree.particleCount();
  return {std::span(tree.x).first(count), std::span(tree.y).first(count), std::span(tree.z).first(count), {}};
}
inline bool areSlotsOf(const Octree& tree, const Receivers& receivers) {
  return receivers.self.empty() && receivers.x.data() == tree.x.data() && receivers.size() == tree.particleCount();
}

}  // namespace mote
