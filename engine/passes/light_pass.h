// Exact lighting in a compute shader: the walk of host/lighting over the same flattened tree, on the device.
//
// One subgroup walks the tree as one packet of rays (see light.comp for why that suits hardware and lavapipe alike).
// Every array is addressed by device address, so none is bound by maxStorageBufferRange.
#pragma once
#include <vector>

#include "engine/vulkan/device.h"
#include "host/lighting/lighting.h"
#include "host/octree/octree.h"

namespace mote {

class LightPass {
 public:
  /// `device` must outlive the pass.
  LightPass(const Device& device, layout::uint falloff, layout::uint endpoint);

  /// Compiles the shader for the tree and copies it, which must stay alive, to the device: 20 bytes a particle, 32
  /// bytes a node. Throws MachineError where it does not fit.
  void setTree(const Octree& tree);

  /// As mote::opticalDepths for the tree that was set, with the rules of the constructor; T within 2e-5 of it for
  /// cutoff 0. Needs 8 more bytes a particle on the device while it runs.
  std::vector<float> opticalDepths(const layout::Light& light, float cutoff, const RaysDone& done = {});

  /// Device seconds of all opticalDepths calls so far, from timestamps.
  double deviceSeconds() const { return deviceSeconds_; }
  /// Bytes on the device while a light is computed.
  std::uint64_t deviceBytes() const { return deviceBytes_; }

 private:
  void createPipeline(bool exact);
  void dispatch(layout::LightParams params, const RaysDone& done);

  const Device& device_;
  ComputePipeline pipeline_;
  TimestampQueries queries_;
  layout::uint falloff_, endpoint_;
  std::uint32_t raysPerGroup_;
  const Octree* tree_ = nullptr;
  Buffer nodes_, particles_, peaks_;
  double deviceSeconds_ = 0;
  std::uint64_t deviceBytes_ = 0;
};

}  // namespace mote
