// Vertex, geometry and fragment shader with their blending, drawing into dynamic rendering's colour targets.
#pragma once
#include <volk.h>

#include <cstdint>
#include <span>
#include <vector>

#include "engine/vulkan/handle.h"
#include "engine/vulkan/shader_module.h"

namespace mote {

/// How a fragment's colour meets what the target holds.
enum class Blend {
  Replace,
  PremultipliedOver,  // source + (1 − source α) · target, all four channels
  DualSourceOver,     // index 0 + (1 − index 1) · target, channel by channel; the only target of its pipeline
  Min,                // componentwise
  Max,
  Add,
};

struct ColorTarget {
  VkFormat format;
  Blend blend;
};

struct GraphicsPipelineInfo {
  std::span<const std::uint32_t> vertex = {}, geometry = {}, fragment = {};  // SPIR-V; geometry may be empty
  std::vector<ColorTarget> targets = {};  // in the order of the fragment shader's locations
  VkPrimitiveTopology topology = VK_PRIMITIVE_TOPOLOGY_POINT_LIST;
  std::uint32_t pushConstantBytes = 0;                 // seen by all stages, ≤ 128
  std::vector<SpecializationConstant> constants = {};  // given to every stage
};

/// Created by Device::createGraphicsPipeline. No vertex input (shaders pull by device address), no depth test, no
/// culling, one sample; viewport and scissor are set by CommandBuffer::beginRendering.
class GraphicsPipeline {
 public:
  GraphicsPipeline() = default;
  VkPipeline handle() const { return pipeline_.get(); }
  VkPipelineLayout layout() const { return layout_.get(); }
  std::uint32_t pushConstantBytes() const { return pushConstantBytes_; }
  VkShaderStageFlags stages() const { return stages_; }

 private:
  friend class Device;
  DeviceHandle<VkPipelineLayout, &vkDestroyPipelineLayout> layout_;
  DeviceHandle<VkPipeline, &vkDestroyPipeline> pipeline_;
  std::uint32_t pushConstantBytes_ = 0;
  VkShaderStageFlags stages_ = 0;
};

}  // namespace mote
