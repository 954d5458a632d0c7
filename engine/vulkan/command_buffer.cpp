#include "engine/vulkan/command_buffer.h"

#include <utility>
#include <vector>

#include "engine/vulkan/check.h"
#include "engine/vulkan/structure.h"

namespace mote {
namespace {

constexpr VkImageSubresourceRange kWholeColor{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
// Between drawings and copies a colour target rests in this layout.
constexpr VkImageLayout kDrawLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
constexpr VkAccessFlags2 kColorAccess = VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT;
constexpr Barrier kAnyToColor{VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                              VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT,
                              VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT, kColorAccess};
constexpr Barrier kColorToTransfer{VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
                                   VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                   VK_ACCESS_2_TRANSFER_READ_BIT};
constexpr Barrier kTransferToColor{VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_NONE,
                                   VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT, kColorAccess};

}  // namespace

CommandBuffer::CommandBuffer(VkDevice device, VkCommandPool pool) : device_(device), pool_(pool) {
  auto info = structure<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  info.commandPool = pool;
  info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  info.commandBufferCount = 1;
  vkCheck(vkAllocateCommandBuffers(device, &info, &commands_), "vkAllocateCommandBuffers");
  auto begin = structure<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  const VkResult result = vkBeginCommandBuffer(commands_, &begin);
  if (result == VK_SUCCESS) return;
  vkFreeCommandBuffers(device_, pool_, 1, &commands_);
  vkCheck(result, "vkBeginCommandBuffer");
}

CommandBuffer::CommandBuffer(CommandBuffer&& other) noexcept
    : device_(other.device_), pool_(other.pool_), commands_(std::exchange(other.commands_, VK_NULL_HANDLE)) {}

CommandBuffer::~CommandBuffer() {
  if (commands_ != VK_NULL_HANDLE) vkFreeCommandBuffers(device_, pool_, 1, &commands_);
}

void CommandBuffer::barrier(const Barrier& barrier) {
  auto memory = structure<VkMemoryBarrier2>(VK_STRUCTURE_TYPE_MEMORY_BARRIER_2);
  memory.srcStageMask = barrier.fromStage;
  memory.srcAccessMask = barrier.fromAccess;
  memory.dstStageMask = barrier.toStage;
  memory.dstAccessMask = barrier.toAccess;
  auto dependency = structure<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  dependency.memoryBarrierCount = 1;
  dependency.pMemoryBarriers = &memory;
  vkCmdPipelineBarrier2(commands_, &dependency);
}

void CommandBuffer::transition(const Image2D& image, const Barrier& barrier, VkImageLayout from, VkImageLayout to) {
  auto change = structure<VkImageMemoryBarrier2>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2);
  change.srcStageMask = barrier.fromStage;
  change.srcAccessMask = barrier.fromAccess;
  change.dstStageMask = barrier.toStage;
  change.dstAccessMask = barrier.toAccess;
  change.oldLayout = from;
  change.newLayout = to;
  change.srcQueueFamilyIndex = change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  change.image = image.handle();
  change.subresourceRange = kWholeColor;
  auto dependency = structure<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  dependency.imageMemoryBarrierCount = 1;
  dependency.pImageMemoryBarriers = &change;
  vkCmdPipelineBarrier2(commands_, &dependency);
}

void CommandBuffer::fill(const Buffer& buffer, std::uint32_t word, VkDeviceSize offset, VkDeviceSize bytes) {
  MOTE_CHECK(offset % 4 + bytes % 4, ==, 0u);
  MOTE_CHECK(offset + bytes, <=, buffer.size());
  if (bytes > 0) vkCmdFillBuffer(commands_, buffer.handle(), offset, bytes, word);
}

void CommandBuffer::copy(const Buffer& from, VkDeviceSize fromOffset, const Buffer& to, VkDeviceSize toOffset,
                         VkDeviceSize bytes) {
  MOTE_CHECK(fromOffset + bytes, <=, from.size());
  MOTE_CHECK(toOffset + bytes, <=, to.size());
  if (bytes == 0) return;
  const VkBufferCopy region{fromOffset, toOffset, bytes};
  vkCmdCopyBuffer(commands_, from.handle(), to.handle(), 1, &region);
}

void CommandBuffer::bindTexels(const ComputePipeline& pipeline, std::initializer_list<VkBufferView> views) {
  MOTE_CHECK(views.size(), ==, pipeline.texelViews());
  std::vector<VkWriteDescriptorSet> writes;
  for (const VkBufferView& view : views) {
    auto write = structure<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    write.dstBinding = static_cast<std::uint32_t>(writes.size());
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
    write.pTexelBufferView = &view;
    writes.push_back(write);
  }
  vkCmdPushDescriptorSetKHR(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.layout(), 0,
                            static_cast<std::uint32_t>(writes.size()), writes.data());
}

void CommandBuffer::dispatchBytes(const ComputePipeline& pipeline, const void* params, std::size_t bytes,
                                  std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  MOTE_CHECK(bytes, ==, pipeline.pushConstantBytes());
  vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.handle());
  vkCmdPushConstants(commands_, pipeline.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, static_cast<std::uint32_t>(bytes),
                     params);
  vkCmdDispatch(commands_, x, y, z);
}

void CommandBuffer::beginRendering(std::initializer_list<RenderTarget> targets) {
  MOTE_CHECK(targets.size(), >, 0u);
  const VkExtent2D extent{targets.begin()->image.width(), targets.begin()->image.height()};
  std::vector<VkRenderingAttachmentInfo> attachments;
  for (const RenderTarget& target : targets) {
    MOTE_CHECK(target.image.width(), ==, extent.width);
    MOTE_CHECK(target.image.height(), ==, extent.height);
    transition(target.image, kAnyToColor, target.load ? kDrawLayout : VK_IMAGE_LAYOUT_UNDEFINED, kDrawLayout);
    auto attachment = structure<VkRenderingAttachmentInfo>(VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO);
    attachment.imageView = target.image.view();
    attachment.imageLayout = kDrawLayout;
    attachment.loadOp = target.load ? VK_ATTACHMENT_LOAD_OP_LOAD : VK_ATTACHMENT_LOAD_OP_CLEAR;
    attachment.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    attachment.clearValue.color = target.clear;
    attachments.push_back(attachment);
  }
  auto info = structure<VkRenderingInfo>(VK_STRUCTURE_TYPE_RENDERING_INFO);
  info.renderArea.extent = extent;
  info.layerCount = 1;
  info.colorAttachmentCount = static_cast<std::uint32_t>(attachments.size());
  info.pColorAttachments = attachments.data();
  vkCmdBeginRendering(commands_, &info);

  const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
  vkCmdSetViewport(commands_, 0, 1, &viewport);
  vkCmdSetScissor(commands_, 0, 1, &info.renderArea);
}

void CommandBuffer::endRendering() { vkCmdEndRendering(commands_); }

void CommandBuffer::bindGraphics(const GraphicsPipeline& pipeline, const void* params, std::size_t bytes) {
  MOTE_CHECK(bytes, ==, pipeline.pushConstantBytes());
  vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.handle());
  vkCmdPushConstants(commands_, pipeline.layout(), pipeline.stages(), 0, static_cast<std::uint32_t>(bytes), params);
}

void CommandBuffer::copyToBuffer(const Image2D& from, const Buffer& to) {
  transition(from, kColorToTransfer, kDrawLayout, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageExtent = {from.width(), from.height(), 1};
  vkCmdCopyImageToBuffer(commands_, from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(), 1, &region);
  transition(from, kTransferToColor, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, kDrawLayout);
}

}  // namespace mote
