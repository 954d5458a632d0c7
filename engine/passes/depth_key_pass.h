// Depth keys on the device: from particles to the (key, index) pairs that SortPass sorts.
#pragma once
#include <cstdint>

#include "engine/vulkan/device.h"
#include "host/core/vec.h"

namespace mote {

/// The keys are those of mote::depthKey, bit for bit (layout/sort.h has the formula).
class DepthKeyPass {
 public:
  explicit DepthKeyPass(const Device& device);

  /// Pair k of `pairs` (≥ SortPass::pairBytes(count)) becomes (key, k) of particle k of `particles`
  /// (layout::SplatParticle), for a camera at `camera` [scene units]; `scale` is a power of two, see depthKeyScale;
  /// `axis` is viewAxis() of the camera.
  /// Needs the particles uploaded, or a barrier after what wrote them. Linear in count.
  void record(CommandBuffer& commands, const Buffer& particles, std::uint32_t count, const vec3& camera, float scale,
              const Buffer& pairs, const vec3& axis = vec3(0)) const;

 private:
  ComputePipeline pipeline_;
};

}  // namespace mote
