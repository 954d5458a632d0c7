// Commands recorded once, submitted once.
#pragma once
#include <volk.h>

#include <cstdint>
#include <initializer_list>
#include <string_view>

#include "engine/vulkan/barrier.h"
#include "engine/vulkan/buffer.h"
#include "engine/vulkan/compute_pipeline.h"
#include "engine/vulkan/graphics_pipeline.h"
#include "engine/vulkan/image.h"
#include "engine/vulkan/texel_view.h"

namespace mote {

/// A colour target of beginRendering, and what it is cleared to.
struct RenderTarget {
  const Image2D& image;
  VkClearColorValue clear;
  bool load = false;  // true: keep the picture that an earlier rendering of the same image left, do not clear
};

/// Recording starts with Device::beginCommands and ends with Device::submitAndWait, before which no object used here
/// may be destroyed. Between two commands that touch the same memory stands a barrier(): nothing is ordered by itself.
class CommandBuffer {
 public:
  CommandBuffer(CommandBuffer&& other) noexcept;
  CommandBuffer& operator=(CommandBuffer&&) = delete;
  ~CommandBuffer();
  VkCommandBuffer handle() const { return commands_; }

  void barrier(const Barrier& barrier);
  /// Sets every 32-bit word of the buffer, or of `bytes` of it from `offset` on (multiples of 4).
  void fill(const Buffer& buffer, std::uint32_t word) { fill(buffer, word, 0, buffer.size()); }
  void fill(const Buffer& buffer, std::uint32_t word, VkDeviceSize offset, VkDeviceSize bytes);
  void copy(const Buffer& from, VkDeviceSize fromOffset, const Buffer& to, VkDeviceSize toOffset, VkDeviceSize bytes);

  /// What the dispatches of pipelines with as many texel views read from now on, binding by binding.
  void bindTexels(const ComputePipeline& pipeline, std::initializer_list<VkBufferView> views);
  /// Runs groups.x × y × z workgroups; `params` is the shader's push constant block, of exactly its size.
  template <class Params>
  void dispatch(const ComputePipeline& pipeline, const Params& params, std::uint32_t x, std::uint32_t y = 1,
                std::uint32_t z = 1) {
    dispatchBytes(pipeline, &params, sizeof(Params), x, y, z);
  }
  /// At least `groups` workgroups in a row of any length: beyond maxComputeWorkGroupCount (65535) they become a grid,
  /// so the shader's row index is gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x, and it must end where that
  /// is beyond its data. Nothing is recorded for 0.
  template <class Params>
  void dispatchRow(const ComputePipeline& pipeline, const Params& params, std::uint64_t groups) {
    if (groups == 0) return;
    const std::uint64_t rows = (groups + kMaxGroups - 1) / kMaxGroups;
    const std::uint64_t columns = (groups + rows - 1) / rows;
    dispatchBytes(pipeline, &params, sizeof(Params), static_cast<std::uint32_t>(columns),
                  static_cast<std::uint32_t>(rows), 1);
  }

  /// Colour targets of one size become writable (their old contents are dropped unless `load`), viewport and scissor
  /// cover them.
  void beginRendering(std::initializer_list<RenderTarget> targets);
  void endRendering();
  /// Between beginRendering and endRendering; gl_VertexIndex counts from 0.
  template <class Params>
  void draw(const GraphicsPipeline& pipeline, const Params& params, std::uint32_t vertexCount) {
    bindGraphics(pipeline, &params, sizeof(Params));
    vkCmdDraw(commands_, vertexCount, 1, 0, 0);
  }
  /// As draw; gl_VertexIndex is the element of `indices` (uint32), from element `first` on.
  template <class Params>
  void drawIndexed(const GraphicsPipeline& pipeline, const Params& params, const Buffer& indices,
                   std::uint32_t indexCount, std::uint32_t first = 0) {
    bindGraphics(pipeline, &params, sizeof(Params));
    vkCmdBindIndexBuffer(commands_, indices.handle(), 0, VK_INDEX_TYPE_UINT32);
    vkCmdDrawIndexed(commands_, indexCount, 1, first, 0, 0);
  }
  /// After endRendering: the picture, rows from the top without gaps, into `to`; orders itself after the drawing. The
  /// image can be drawn on afterwards (beginRendering with load).
  void copyToBuffer(const Image2D& from, const Buffer& to);

 private:
  friend class Device;
  static constexpr std::uint64_t kMaxGroups = 65535;  // the least maxComputeWorkGroupCount that Vulkan promises
  CommandBuffer(VkDevice device, VkCommandPool pool);
  void dispatchBytes(const ComputePipeline& pipeline, const void* params, std::size_t bytes, std::uint32_t x,
                     std::uint32_t y, std::uint32_t z);
  void bindGraphics(const GraphicsPipeline& pipeline, const void* params, std::size_t bytes);
  void transition(const Image2D& image, const Barrier& barrier, VkImageLayout from, VkImageLayout to);

  VkDevice device_;
  VkCommandPool pool_;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
};

}  // namespace mote
