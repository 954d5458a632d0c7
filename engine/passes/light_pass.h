// Exact lighting in a compute shader: the walk of host/lighting over the same flattened tree, on the device.
//
// One subgroup walks the tree as one packet of rays (see light.comp for why that suits hardware and lavapipe alike).
// Every array is addressed by device address, so none is bound by maxStorageBufferRange.
#pragma once
#include <optional>
#include <vector>

#include "engine/vulkan/device.h"
#include "host/lighting/lighting.h"
#include "host/octree/octree.h"

namespace mote {

class LightPass {
 public:
  /// `device` must outlive the pass.
  LightPass(const Device& device, layout::uint falloff, layout::uint endpoint);

  /// Copies the tree, which must stay alive, to the device: 20 bytes a particle (28 with three channels), 32 bytes a
  /// node. Throws MachineError where it does not fit.
  void setTree(const Octree& tree);

  /// As mote::opticalDepths for the tree that was set, with the rules of the constructor; T within 2e-5 of it for
  /// cutoff 0. Needs on the device while it runs: 8 bytes a receiver (16 with three channels), and 20 more where the
  /// receivers are not the tree's own slots.
  std::vector<float> opticalDepths(const Receivers& receivers, const layout::Light& light,
                                   const LightingOptions& options, std::span<const std::uint8_t> reached = {},
                                   const RaysDone& done = {});
  /// … from every slot of the tree.
  std::vector<float> opticalDepths(const layout::Light& light, const LightingOptions& options,
                                   const RaysDone& done = {});

  /// Device seconds of all opticalDepths calls so far, from timestamps.
  double deviceSeconds() const { return deviceSeconds_; }
  /// Bytes on the device while a light is computed.
  std::uint64_t deviceBytes() const { return deviceBytes_; }

 private:
  const ComputePipeline& pipeline(bool ownSlots);
  void dispatch(const ComputePipeline& pipeline, layout::LightParams params, std::size_t rays, const RaysDone& done);

  const Device& device_;
  TimestampQueries queries_;
  layout::uint falloff_, endpoint_;
  std::uint32_t raysPerGroup_;
  const Octree* tree_ = nullptr;
  bool exact_ = false;                                // the tree spans so much that rays are rebased in double
  std::optional<ComputePipeline> ownSlots_, others_;  // for receivers that are the tree's slots, and for any
  Buffer nodes_, particles_, peaks_, peaksGreen_, peaksBlue_;
  double deviceSeconds_ = 0;
  std::uint64_t deviceBytes_ = 0;
};

}  // namespace mote
