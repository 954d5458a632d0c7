// One compute shader, ready to dispatch.
#pragma once
#include <volk.h>

#include <cstdint>

#include "engine/vulkan/handle.h"

namespace mote {

/// Created by Device::createComputePipeline. No descriptors: parameters are push constants, arrays device addresses.
class ComputePipeline {
 public:
  ComputePipeline() = default;
  VkPipeline handle() const { return pipeline_.get(); }
  VkPipelineLayout layout() const { return layout_.get(); }
  std::uint32_t pushConstantBytes() const { return pushConstantBytes_; }

 private:
  friend class Device;
  DeviceHandle<VkPipelineLayout, &vkDestroyPipelineLayout> layout_;
  DeviceHandle<VkPipeline, &vkDestroyPipeline> pipeline_;
  std::uint32_t pushConstantBytes_ = 0;
};

}  // namespace mote
