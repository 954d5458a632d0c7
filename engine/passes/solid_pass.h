// Shadow rays against solids in a compute shader: host/solids/occlusion.h on the device.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "engine/vulkan/device.h"
#include "host/lighting/receivers.h"
#include "host/solids/solid_tree.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

class SolidPass {
 public:
  /// `device` must outlive the pass.
  explicit SolidPass(const Device& device);

  /// Copies the tree to the device: 36 bytes a triangle, 32 bytes a node. Throws MachineError where it does not fit.
  void setTree(const SolidTree& tree);

  /// As mote::occluded for the tree that was set; the same bytes wherever the device divides as exactly as the host
  /// does (lavapipe), watertight everywhere. 16 bytes a ray on the device for at most 2²⁰ rays at a time, and as few
  /// as its budget has room for.
  std::vector<std::uint8_t> occluded(const Receivers& receivers, std::span<const std::uint8_t> wanted,
                                     const layout::Light& light);

  /// Device seconds of all occluded() calls so far, from timestamps.
  double deviceSeconds() const { return deviceSeconds_; }

 private:
  const Device& device_;
  ComputePipeline pipeline_;
  TimestampQueries queries_;
  Buffer nodes_, triangles_;
  layout::uint nodeCount_ = 0;
  double deviceSeconds_ = 0;
};

}  // namespace mote
