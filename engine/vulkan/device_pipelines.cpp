// Device: shader modules and pipelines.
#include <array>

#include "engine/vulkan/check.h"
#include "engine/vulkan/device.h"
#include "engine/vulkan/structure.h"
#include "host/core/error.h"

namespace mote {
namespace {

constexpr std::uint32_t kMaxPushConstantBytes = 128;  // what chooseDevice has checked

VkPipelineColorBlendAttachmentState blendState(Blend blend) {
  VkPipelineColorBlendAttachmentState state{};
  state.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
  state.blendEnable = blend != Blend::Replace;
  state.srcColorBlendFactor = state.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
  const bool over = blend == Blend::PremultipliedOver;
  state.dstColorBlendFactor = state.dstAlphaBlendFactor =
      over ? VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA : VK_BLEND_FACTOR_ONE;
  if (blend == Blend::DualSourceOver) {
    state.dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC1_COLOR;
    state.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC1_ALPHA;
  }
  state.colorBlendOp = blend == Blend::Min ? VK_BLEND_OP_MIN : blend == Blend::Max ? VK_BLEND_OP_MAX : VK_BLEND_OP_ADD;
  state.alphaBlendOp = state.colorBlendOp;
  return state;
}

VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits bit, const ShaderModule& module,
                                      const SpecializationInfo& constants) {
  auto info = structure<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  info.stage = bit;
  info.module = module.handle();
  info.pName = "main";
  info.pSpecializationInfo = constants.get();
  return info;
}

/// Bindings 0, 1, … of texel views, pushed with the commands.
void createTexelSet(VkDevice device, std::uint32_t texelViews, VkDescriptorSetLayout* set) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (std::uint32_t k = 0; k < texelViews; ++k)
    bindings.push_back({k, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
  auto info = structure<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  info.flags = VK_DESCRIPTOR_SET_LAYOUT_CREATE_PUSH_DESCRIPTOR_BIT_KHR;
  info.bindingCount = texelViews;
  info.pBindings = bindings.data();
  vkCheck(vkCreateDescriptorSetLayout(device, &info, nullptr, set), "vkCreateDescriptorSetLayout");
}

}  // namespace

ShaderModule Device::createShaderModule(std::span<const std::uint32_t> spirv) const {
  ShaderModule module;
  module.module_ = DeviceHandle<VkShaderModule, &vkDestroyShaderModule>(device_);
  auto info = structure<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  info.codeSize = spirv.size_bytes();
  info.pCode = spirv.data();
  vkCheck(vkCreateShaderModule(device_, &info, nullptr, module.module_.out()), "vkCreateShaderModule",
          fmt::format("{} words", spirv.size()));
  return module;
}

void Device::createLayout(VkShaderStageFlags stages, std::uint32_t pushConstantBytes, VkPipelineLayout* layout,
                          const VkDescriptorSetLayout* set) const {
  MOTE_CHECK(pushConstantBytes, <=, kMaxPushConstantBytes);
  MOTE_CHECK(pushConstantBytes % 4, ==, 0u);
  const VkPushConstantRange range{stages, 0, pushConstantBytes};
  auto info = structure<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.pushConstantRangeCount = pushConstantBytes > 0 ? 1 : 0;
  info.pPushConstantRanges = &range;
  info.setLayoutCount = set ? 1 : 0;
  info.pSetLayouts = set;
  vkCheck(vkCreatePipelineLayout(device_, &info, nullptr, layout), "vkCreatePipelineLayout");
}

ComputePipeline Device::createComputePipeline(std::span<const std::uint32_t> spirv, std::uint32_t pushConstantBytes,
                                              std::span<const SpecializationConstant> constants,
                                              std::uint32_t texelViews) const {
  ComputePipeline pipeline;
  pipeline.set_ = DeviceHandle<VkDescriptorSetLayout, &vkDestroyDescriptorSetLayout>(device_);
  pipeline.layout_ = DeviceHandle<VkPipelineLayout, &vkDestroyPipelineLayout>(device_);
  pipeline.pipeline_ = DeviceHandle<VkPipeline, &vkDestroyPipeline>(device_);
  pipeline.pushConstantBytes_ = pushConstantBytes;
  pipeline.texelViews_ = texelViews;
  if (texelViews > 0) createTexelSet(device_, texelViews, pipeline.set_.out());
  const VkDescriptorSetLayout set = pipeline.set_.get();
  createLayout(VK_SHADER_STAGE_COMPUTE_BIT, pushConstantBytes, pipeline.layout_.out(), texelViews > 0 ? &set : nullptr);

  const ShaderModule module = createShaderModule(spirv);
  const SpecializationInfo specialization(constants);
  auto info = structure<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.stage = stage(VK_SHADER_STAGE_COMPUTE_BIT, module, specialization);
  info.layout = pipeline.layout();
  VkResult result = fault(DeviceCall::Pipeline);
  if (result == VK_SUCCESS)
    result = vkCreateComputePipelines(device_, VK_NULL_HANDLE, 1, &info, nullptr, pipeline.pipeline_.out());
  vkCheck(result, "vkCreateComputePipelines");
  return pipeline;
}

GraphicsPipeline Device::createGraphicsPipeline(const GraphicsPipelineInfo& wanted) const {
  GraphicsPipeline pipeline;
  pipeline.layout_ = DeviceHandle<VkPipelineLayout, &vkDestroyPipelineLayout>(device_);
  pipeline.pipeline_ = DeviceHandle<VkPipeline, &vkDestroyPipeline>(device_);
  pipeline.pushConstantBytes_ = wanted.pushConstantBytes;
  pipeline.stages_ = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
  if (!wanted.geometry.empty()) pipeline.stages_ |= VK_SHADER_STAGE_GEOMETRY_BIT;
  createLayout(pipeline.stages_, wanted.pushConstantBytes, pipeline.layout_.out());

  const SpecializationInfo specialization(wanted.constants);
  const ShaderModule vertex = createShaderModule(wanted.vertex);
  const ShaderModule fragment = createShaderModule(wanted.fragment);
  ShaderModule geometry;
  std::vector<VkPipelineShaderStageCreateInfo> stages{stage(VK_SHADER_STAGE_VERTEX_BIT, vertex, specialization),
                                                      stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment, specialization)};
  if (!wanted.geometry.empty()) {
    geometry = createShaderModule(wanted.geometry);
    stages.push_back(stage(VK_SHADER_STAGE_GEOMETRY_BIT, geometry, specialization));
  }

  const auto input =
      structure<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
  auto assembly =
      structure<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
  assembly.topology = wanted.topology;
  auto viewport = structure<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
  viewport.viewportCount = viewport.scissorCount = 1;
  auto raster =
      structure<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  raster.polygonMode = VK_POLYGON_MODE_FILL;
  raster.cullMode = VK_CULL_MODE_NONE;
  raster.lineWidth = 1;
  auto samples =
      structure<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;

  std::vector<VkPipelineColorBlendAttachmentState> blends;
  std::vector<VkFormat> formats;
  for (const ColorTarget& target : wanted.targets) {
    blends.push_back(blendState(target.blend));
    formats.push_back(target.format);
  }
  auto blend = structure<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
  blend.attachmentCount = static_cast<std::uint32_t>(blends.size());
  blend.pAttachments = blends.data();
  constexpr std::array kDynamic{VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  auto dynamic = structure<VkPipelineDynamicStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO);
  dynamic.dynamicStateCount = static_cast<std::uint32_t>(kDynamic.size());
  dynamic.pDynamicStates = kDynamic.data();
  auto rendering = structure<VkPipelineRenderingCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO);
  rendering.colorAttachmentCount = static_cast<std::uint32_t>(formats.size());
  rendering.pColorAttachmentFormats = formats.data();

  auto info = structure<VkGraphicsPipelineCreateInfo>(VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO);
  info.pNext = &rendering;
  info.stageCount = static_cast<std::uint32_t>(stages.size());
  info.pStages = stages.data();
  info.pVertexInputState = &input;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &viewport;
  info.pRasterizationState = &raster;
  info.pMultisampleState = &samples;
  info.pColorBlendState = &blend;
  info.pDynamicState = &dynamic;
  info.layout = pipeline.layout();
  VkResult result = fault(DeviceCall::Pipeline);
  if (result == VK_SUCCESS)
    result = vkCreateGraphicsPipelines(device_, VK_NULL_HANDLE, 1, &info, nullptr, pipeline.pipeline_.out());
  vkCheck(result, "vkCreateGraphicsPipelines");
  return pipeline;
}

}  // namespace mote
