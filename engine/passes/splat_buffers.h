// The particles of a SplatSet on a device, all of them or a part.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "engine/vulkan/device.h"
#include "host/splat/splat_set.h"

namespace mote {

/// Arrays beside `particles` are empty where the set's are.
struct SplatBuffers {
  Buffer particles;                       ///< layout::SplatParticle
  Buffer extinction, emission, velocity;  ///< vec3

  SplatBuffers() = default;
  /// Room for `count` particles of the set.
  SplatBuffers(const Device& device, const SplatSet& set, std::uint64_t count);
  /// The sizes [bytes] of the arrays for `count` particles of the set: 32 a particle, 12 more for each further array.
  static std::vector<std::uint64_t> sizes(const SplatSet& set, std::uint64_t count);

  /// Fills them with the set's particles, in its order …
  void upload(const Device& device, const SplatSet& set) const;
  /// … or with those that `order` names, in that order, gathered on the host.
  void upload(const Device& device, const SplatSet& set, std::span<const layout::uint> order) const;
};

}  // namespace mote
