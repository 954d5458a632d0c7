// One compute shader, ready to dispatch.
#pragma once
#include <volk.h>

#include <cstdint>

#include "engine/vulkan/handle.h"

namespace mote {

/// Created by Device::createComputePipeline. Parameters are push constants, arrays device addresses, or texel views
/// where that is faster (set 0, bindings from 0 on, pushed by CommandBuffer::bindTexels).
class ComputePipeline {
 public:
  ComputePipeline() = default;
  VkPipeline handle() const { return pipeline_.get(); }
  VkPipelineLayout layout() const { return layout_.get(); }
  std::uint32_t pushConstantBytes() const { return pushConstantBytes_; }
  std::uint32_t texelViews() const { return texelViews_; }

 private:
  friend class Device;
  DeviceHandle<VkDescriptorSetLayout, &vkDestroyDescriptorSetLayout> set_;  // null without texel views
  DeviceHandle<VkPipelineLayout, &vkDestroyPipelineLayout> layout_;
  DeviceHandle<VkPipeline, &vkDestroyPipeline> pipeline_;
  std::uint32_t pushConstantBytes_ = 0, texelViews_ = 0;
};

}  // namespace mote
