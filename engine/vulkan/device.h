// The logical device: the only factory of everything that lives on it.
#pragma once
#include <volk.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/vulkan/buffer.h"
#include "engine/vulkan/command_buffer.h"
#include "engine/vulkan/compute_pipeline.h"
#include "engine/vulkan/device_facts.h"
#include "engine/vulkan/fault_plan.h"
#include "engine/vulkan/graphics_pipeline.h"
#include "engine/vulkan/image.h"
#include "engine/vulkan/shader_module.h"
#include "engine/vulkan/texel_view.h"
#include "engine/vulkan/timestamp_queries.h"

namespace mote {

struct DeviceSettings {
  /// Keeps Memory::Device buffers unmapped even where they could be mapped: a CPU device then behaves as a discrete
  /// one.
  bool stageAlways = false;
  /// At most the heap: what buffers and pictures in device-local memory may take together.
  MemoryLimit memory = {};
  /// For tests: what every byte of a new buffer is set to, where it is mapped, as what nothing writes then shows.
  std::optional<std::uint8_t> fill = {};
  /// For tests: calls that are to fail. Devices that follow each other share it.
  std::shared_ptr<FaultPlan> faults = {};
};

/// One queue with graphics and compute, one command pool; for one thread. Outlives all it made.
class Device {
 public:
  /// A device from chooseDevice, which has checked that nothing is missing, and what it says of itself.
  Device(VkPhysicalDevice physicalDevice, DeviceFacts facts, const DeviceSettings& settings = {});
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  VkDevice handle() const { return device_; }
  std::string name() const { return facts_.properties.deviceName; }
  /// A software device (lavapipe): many elements an invocation suit it, workgroup barriers do not.
  bool isCpu() const { return facts_.isCpu(); }
  /// Double precision in shaders: optional, what needs it does without.
  bool hasFloat64() const { return facts_.features.shaderFloat64 != VK_FALSE; }
  /// Largest side of a point [pixels]; 1 where there is no choice.
  float mostPointSide() const { return facts_.features.largePoints ? limits().pointSizeRange[1] : 1; }
  /// Invocations a subgroup: what shaders usually get, and the least and most that a driver may choose.
  std::uint32_t subgroupSize() const { return facts_.subgroupSize; }
  std::uint32_t leastSubgroupSize() const { return facts_.leastSubgroupSize; }
  std::uint32_t mostSubgroupSize() const { return facts_.mostSubgroupSize; }
  const VkPhysicalDeviceLimits& limits() const { return facts_.properties.limits; }
  /// Largest buffer that can be made [bytes]; a bigger array must be streamed in parts.
  std::uint64_t maxBufferBytes() const;
  /// Elements of the longest texel view.
  std::uint64_t mostTexels() const { return limits().maxTexelBufferElements; }
  /// Size of the device-local heap [bytes].
  std::uint64_t memoryBytes() const { return facts_.memoryBytes(); }

  /// Everything made here that lies in device-local memory, to the byte that the driver takes.
  const MemoryBudget& budget() const { return budget_; }
  /// Another limit, at most the heap, for what is made from now on.
  void limitMemory(std::uint64_t bytes) { budget_.limit_ = std::min(bytes, memoryBytes()); }
  /// Lets the budget's peak begin anew, at what is held now.
  void restartPeak() const { budget_.peak_ = budget_.held_; }
  /// What a buffer or picture would take of the budget: 0 where it would lie in the host's memory.
  std::uint64_t bufferCost(VkDeviceSize bytes, Memory memory = Memory::Device) const;
  std::uint64_t imageCost(std::uint32_t width, std::uint32_t height, VkFormat format) const;
  /// What copies to and from buffers that are not mapped must find left of the budget; 0 where they need nothing of it.
  std::uint64_t stagingCost() const;

  /// Throws MachineError with the bytes asked for, the budget and the heap's size. 0 bytes is a valid buffer.
  Buffer createBuffer(VkDeviceSize bytes, Memory memory = Memory::Device) const;
  /// Throws MachineError when larger than maxImageDimension2D or memory is short.
  Image2D createImage(std::uint32_t width, std::uint32_t height, VkFormat format) const;
  /// The whole buffer, as far as it has whole elements of `elementBytes`, and not more than mostTexels of them.
  TexelView createTexelView(const Buffer& buffer, VkFormat format, std::uint32_t elementBytes) const;
  ShaderModule createShaderModule(std::span<const std::uint32_t> spirv) const;
  ComputePipeline createComputePipeline(std::span<const std::uint32_t> spirv, std::uint32_t pushConstantBytes,
                                        std::span<const SpecializationConstant> constants = {},
                                        std::uint32_t texelViews = 0) const;
  GraphicsPipeline createGraphicsPipeline(const GraphicsPipelineInfo& info) const;
  TimestampQueries createTimestampQueries(std::uint32_t spans) const;

  /// Starts recording; end with submitAndWait.
  CommandBuffer beginCommands() const;
  /// Makes all writes visible to the host, submits, and returns when the device is done. Throws MachineError.
  void submitAndWait(CommandBuffer commands) const;
  /// Records with `record` and does both.
  void run(const std::function<void(CommandBuffer&)>& record) const;

  /// Copies bytes into the buffer: at once where it is mapped, else through a staging buffer of at most 64 MiB and what
  /// the budget has left.
  void uploadBytes(const Buffer& to, VkDeviceSize offset, const void* data, std::size_t bytes) const;
  void downloadBytes(const Buffer& from, VkDeviceSize offset, void* data, std::size_t bytes) const;
  template <class T>
  void upload(const Buffer& to, std::span<const T> data, std::size_t firstElement = 0) const {
    uploadBytes(to, firstElement * sizeof(T), data.data(), data.size_bytes());
  }
  template <class T>
  std::vector<T> download(const Buffer& from, std::size_t count, std::size_t firstElement = 0) const {
    std::vector<T> data(count);
    downloadBytes(from, firstElement * sizeof(T), data.data(), count * sizeof(T));
    return data;
  }
  /// A buffer of Memory::Device that holds `data`.
  template <class T>
  Buffer createBufferWith(std::span<const T> data) const {
    Buffer buffer = createBuffer(data.size_bytes());
    upload(buffer, data);
    return buffer;
  }

 private:
  /// Index of the memory type that has `flags`, is allowed by `typeBits` and has most of `preferred`.
  std::uint32_t memoryType(std::uint32_t typeBits, VkMemoryPropertyFlags flags, VkMemoryPropertyFlags preferred) const;
  std::uint32_t memoryType(std::uint32_t typeBits, Memory memory) const;
  bool inBudget(std::uint32_t type) const;
  bool isMapped(std::uint32_t type, Memory memory) const;
  Buffer stagingBuffer(std::uint64_t bytes) const;
  DeviceMemory allocate(const VkMemoryRequirements& needs, std::uint32_t type, VkMemoryAllocateFlags flags,
                        const char* what) const;
  void createLayout(VkShaderStageFlags stages, std::uint32_t pushConstantBytes, VkPipelineLayout* layout,
                    const VkDescriptorSetLayout* set = nullptr) const;

  /// What a call is to fail with.
  VkResult fault(DeviceCall call) const;

  VkPhysicalDevice physicalDevice_;
  DeviceFacts facts_;
  DeviceSettings settings_;
  mutable bool lost_ = false;  // by fault()
  mutable MemoryBudget budget_;
  std::uint32_t queueFamily_ = 0, timestampBits_ = 0;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  VkCommandPool pool_ = VK_NULL_HANDLE;
};

}  // namespace mote
