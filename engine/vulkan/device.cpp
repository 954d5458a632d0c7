#include "engine/vulkan/device.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "engine/vulkan/check.h"
#include "engine/vulkan/physical_device.h"
#include "engine/vulkan/structure.h"
#include "host/core/error.h"

namespace mote {
namespace {

struct QueueFamily {
  std::uint32_t index, timestampBits;
};

QueueFamily graphicsAndCompute(VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  constexpr VkQueueFlags kNeeded = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
  for (std::uint32_t i = 0; i < count; ++i)
    if ((families[i].queueFlags & kNeeded) == kNeeded) return {i, families[i].timestampValidBits};
  throw MachineError("the Vulkan device has no queue with graphics and compute");
}

VkDevice createLogicalDevice(VkPhysicalDevice physicalDevice, const DeviceFacts& facts, std::uint32_t queueFamily) {
  auto v13 = structure<VkPhysicalDeviceVulkan13Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES);
  v13.dynamicRendering = v13.synchronization2 = v13.maintenance4 = VK_TRUE;
  auto v12 = structure<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
  v12.pNext = &v13;
  v12.bufferDeviceAddress = v12.scalarBlockLayout = v12.hostQueryReset = VK_TRUE;
  auto features = structure<VkPhysicalDeviceFeatures2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2);
  features.pNext = &v12;
  features.features.geometryShader = features.features.independentBlend = VK_TRUE;
  features.features.dualSrcBlend = VK_TRUE;
  features.features.fullDrawIndexUint32 = features.features.shaderInt64 = VK_TRUE;
  // These are used where they are there, and done without elsewhere.
  features.features.shaderFloat64 = facts.features.shaderFloat64;
  features.features.largePoints = facts.features.largePoints;

  const float priority = 1;
  auto queue = structure<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = queueFamily;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  auto info = structure<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  info.pNext = &features;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  info.enabledExtensionCount = static_cast<std::uint32_t>(kDeviceExtensions.size());
  info.ppEnabledExtensionNames = kDeviceExtensions.data();
  VkDevice device = VK_NULL_HANDLE;
  vkCheck(vkCreateDevice(physicalDevice, &info, nullptr, &device), "vkCreateDevice");
  return device;
}

/// What the host can map; coherent, so that no write of either side is ever flushed.
constexpr VkMemoryPropertyFlags kMappable = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;

VkBufferCreateInfo bufferInfo(VkDeviceSize bytes) {
  auto info = structure<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = std::max<VkDeviceSize>(bytes, 16);  // a buffer of 0 bytes does not exist in Vulkan, but an array does
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT |
               VK_BUFFER_USAGE_INDEX_BUFFER_BIT | VK_BUFFER_USAGE_VERTEX_BUFFER_BIT |
               VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT |
               VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  return info;
}

VkImageCreateInfo imageInfo(std::uint32_t width, std::uint32_t height, VkFormat format) {
  auto info = structure<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = format;
  info.extent = {width, height, 1};
  info.mipLevels = info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.tiling = VK_IMAGE_TILING_OPTIMAL;
  info.usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  info.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  return info;
}

}  // namespace

Device::Device(VkPhysicalDevice physicalDevice, DeviceFacts facts, const DeviceSettings& settings)
    : physicalDevice_(physicalDevice), facts_(std::move(facts)), settings_(settings) {
  const MemoryLimit& limit = settings.memory;
  const auto share = static_cast<std::uint64_t>(limit.share * static_cast<double>(memoryBytes()));
  budget_.limit_ = std::min(limit.bytes > 0 ? limit.bytes : share, memoryBytes());

  const QueueFamily family = graphicsAndCompute(physicalDevice);
  queueFamily_ = family.index;
  timestampBits_ = family.timestampBits;
  vkCheck(fault(DeviceCall::Open), "vkCreateDevice");
  device_ = createLogicalDevice(physicalDevice, facts_, queueFamily_);
  vkGetDeviceQueue(device_, queueFamily_, 0, &queue_);
  auto pool = structure<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
  pool.queueFamilyIndex = queueFamily_;
  const VkResult result = vkCreateCommandPool(device_, &pool, nullptr, &pool_);
  if (result != VK_SUCCESS) vkDestroyDevice(device_, nullptr);
  vkCheck(result, "vkCreateCommandPool");
}

Device::~Device() {
  vkDestroyCommandPool(device_, pool_, nullptr);
  vkDestroyDevice(device_, nullptr);
}

VkResult Device::fault(DeviceCall call) const {
  if (lost_) return VK_ERROR_DEVICE_LOST;  // as a real one would
  const VkResult result = settings_.faults ? settings_.faults->next(call) : VK_SUCCESS;
  lost_ = result == VK_ERROR_DEVICE_LOST;
  return result;
}

std::uint64_t Device::maxBufferBytes() const {
  return std::min({facts_.maxBufferSize, facts_.maxMemoryAllocationSize, memoryBytes()});
}

std::uint32_t Device::memoryType(std::uint32_t typeBits, VkMemoryPropertyFlags flags,
                                 VkMemoryPropertyFlags preferred) const {
  // Vulkan lists types with fewer properties first, so of two that match alike the first asks no more than needed.
  std::uint32_t best = facts_.memory.memoryTypeCount;
  int bestMatch = -1;
  for (std::uint32_t i = 0; i < facts_.memory.memoryTypeCount; ++i) {
    const VkMemoryPropertyFlags has = facts_.memory.memoryTypes[i].propertyFlags;
    if (!(typeBits & (1u << i)) || (has & flags) != flags) continue;
    const int match = std::popcount(has & preferred);
    if (match > bestMatch) best = i, bestMatch = match;
  }
  if (best == facts_.memory.memoryTypeCount)
    throw MachineError(
        fmt::format("{} has no memory type with the properties {:#x} among the types {:#x}", name(), flags, typeBits));
  return best;
}

std::uint32_t Device::memoryType(std::uint32_t typeBits, Memory memory) const {
  return memory == Memory::Host ? memoryType(typeBits, kMappable, VK_MEMORY_PROPERTY_HOST_CACHED_BIT)
                                : memoryType(typeBits, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
}

bool Device::inBudget(std::uint32_t type) const {
  return facts_.memory.memoryHeaps[facts_.memory.memoryTypes[type].heapIndex].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT;
}

bool Device::isMapped(std::uint32_t type, Memory memory) const {
  const bool mappable = (facts_.memory.memoryTypes[type].propertyFlags & kMappable) == kMappable;
  return memory == Memory::Host || (mappable && !settings_.stageAlways);
}

std::uint64_t Device::bufferCost(VkDeviceSize bytes, Memory memory) const {
  const VkBufferCreateInfo info = bufferInfo(bytes);
  auto asked = structure<VkDeviceBufferMemoryRequirements>(VK_STRUCTURE_TYPE_DEVICE_BUFFER_MEMORY_REQUIREMENTS);
  asked.pCreateInfo = &info;
  auto needs = structure<VkMemoryRequirements2>(VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2);
  vkGetDeviceBufferMemoryRequirements(device_, &asked, &needs);
  const VkMemoryRequirements& found = needs.memoryRequirements;
  return inBudget(memoryType(found.memoryTypeBits, memory)) ? found.size : 0;
}

std::uint64_t Device::imageCost(std::uint32_t width, std::uint32_t height, VkFormat format) const {
  const VkImageCreateInfo info = imageInfo(width, height, format);
  auto asked = structure<VkDeviceImageMemoryRequirements>(VK_STRUCTURE_TYPE_DEVICE_IMAGE_MEMORY_REQUIREMENTS);
  asked.pCreateInfo = &info;
  auto needs = structure<VkMemoryRequirements2>(VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2);
  vkGetDeviceImageMemoryRequirements(device_, &asked, &needs);
  const VkMemoryRequirements& found = needs.memoryRequirements;
  return inBudget(memoryType(found.memoryTypeBits, Memory::Device)) ? found.size : 0;
}

DeviceMemory Device::allocate(const VkMemoryRequirements& needs, std::uint32_t type, VkMemoryAllocateFlags flags,
                              const char* what) const {
  const std::uint32_t heap = facts_.memory.memoryTypes[type].heapIndex;
  const std::uint64_t heapBytes = facts_.memory.memoryHeaps[heap].size;
  const std::string numbers =
      fmt::format("{} bytes asked for {}, heap {} of {} has {} bytes, one allocation at most {}", needs.size, what,
                  heap, name(), heapBytes, facts_.maxMemoryAllocationSize);
  // Asking for more than these is invalid use of Vulkan, so the answer that a driver might give is given here.
  if (needs.size > heapBytes || needs.size > facts_.maxMemoryAllocationSize)
    throw DeviceError(DeviceFault::Refused, fmt::format("vkAllocateMemory would fail: {}", numbers));
  auto flagsInfo = structure<VkMemoryAllocateFlagsInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO);
  flagsInfo.flags = flags;
  auto info = structure<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  info.pNext = &flagsInfo;
  info.allocationSize = needs.size;
  info.memoryTypeIndex = type;
  if (inBudget(type) && needs.size > budget_.room())
    throw DeviceError(
        DeviceFault::Refused,
        fmt::format("{} bytes asked for {}, and {} of the {} that may be held on {} are taken; --device-memory sets "
                    "that limit, heap {} has {} bytes",
                    needs.size, what, budget_.held(), budget_.limit(), name(), heap, heapBytes));
  DeviceMemory memory;
  memory.memory_ = DeviceHandle<VkDeviceMemory, &vkFreeMemory>(device_);
  VkResult result = fault(DeviceCall::Allocate);
  if (result == VK_SUCCESS) result = vkAllocateMemory(device_, &info, nullptr, memory.memory_.out());
  vkCheck(result, "vkAllocateMemory", numbers, needs.size);
  if (!inBudget(type)) return memory;
  memory.budget_ = &budget_, memory.bytes_ = needs.size;
  budget_.take(needs.size);
  return memory;
}

Buffer Device::createBuffer(VkDeviceSize bytes, Memory memory) const {
  if (bytes > facts_.maxBufferSize)
    throw DeviceError(DeviceFault::Refused,
                      fmt::format("a buffer of {} bytes is beyond the maxBufferSize of {}, {} bytes; its heap has {}",
                                  bytes, name(), facts_.maxBufferSize, memoryBytes()));
  Buffer buffer;
  buffer.buffer_ = DeviceHandle<VkBuffer, &vkDestroyBuffer>(device_);
  buffer.size_ = bytes;

  const VkBufferCreateInfo info = bufferInfo(bytes);
  vkCheck(vkCreateBuffer(device_, &info, nullptr, buffer.buffer_.out()), "vkCreateBuffer",
          fmt::format("{} bytes", bytes));
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device_, buffer.handle(), &needs);

  const std::uint32_t type = memoryType(needs.memoryTypeBits, memory);
  buffer.memory_ = allocate(needs, type, VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT, "a buffer");
  vkCheck(vkBindBufferMemory(device_, buffer.handle(), buffer.memory_.get(), 0), "vkBindBufferMemory");

  if (isMapped(type, memory))
    vkCheck(vkMapMemory(device_, buffer.memory_.get(), 0, VK_WHOLE_SIZE, 0, &buffer.data_), "vkMapMemory",
            fmt::format("{} bytes", bytes));
  if (settings_.fill && buffer.data_) std::fill_n(static_cast<std::uint8_t*>(buffer.data_), bytes, *settings_.fill);
  auto address = structure<VkBufferDeviceAddressInfo>(VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO);
  address.buffer = buffer.handle();
  buffer.address_ = vkGetBufferDeviceAddress(device_, &address);
  return buffer;
}

TexelView Device::createTexelView(const Buffer& buffer, VkFormat format, std::uint32_t elementBytes) const {
  TexelView view;
  view.view_ = DeviceHandle<VkBufferView, &vkDestroyBufferView>(device_);
  auto info = structure<VkBufferViewCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO);
  info.buffer = buffer.handle();
  info.format = format;
  info.range = std::min(std::max<std::uint64_t>(buffer.size() / elementBytes, 1), mostTexels()) * elementBytes;
  vkCheck(vkCreateBufferView(device_, &info, nullptr, view.view_.out()), "vkCreateBufferView",
          fmt::format("{} bytes", info.range));
  return view;
}

Image2D Device::createImage(std::uint32_t width, std::uint32_t height, VkFormat format) const {
  const std::uint32_t limit = limits().maxImageDimension2D;
  if (width > limit || height > limit)
    throw DeviceError(DeviceFault::Refused,
                      fmt::format("a picture of {} x {} pixels is beyond the maxImageDimension2D of {}, {}", width,
                                  height, name(), limit));
  Image2D image;
  image.image_ = DeviceHandle<VkImage, &vkDestroyImage>(device_);
  image.view_ = DeviceHandle<VkImageView, &vkDestroyImageView>(device_);
  image.format_ = format;
  image.width_ = width;
  image.height_ = height;

  const VkImageCreateInfo info = imageInfo(width, height, format);
  const std::string what = fmt::format("a picture of {} x {} pixels", width, height);
  vkCheck(vkCreateImage(device_, &info, nullptr, image.image_.out()), "vkCreateImage", what);
  VkMemoryRequirements needs;
  vkGetImageMemoryRequirements(device_, image.handle(), &needs);
  image.memory_ = allocate(needs, memoryType(needs.memoryTypeBits, Memory::Device), 0, what.c_str());
  vkCheck(vkBindImageMemory(device_, image.handle(), image.memory_.get(), 0), "vkBindImageMemory", what);

  auto view = structure<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
  view.image = image.handle();
  view.viewType = VK_IMAGE_VIEW_TYPE_2D;
  view.format = format;
  view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  vkCheck(vkCreateImageView(device_, &view, nullptr, image.view_.out()), "vkCreateImageView", what);
  return image;
}

TimestampQueries Device::createTimestampQueries(std::uint32_t spans) const {
  MOTE_CHECK(spans, >, 0u);
  TimestampQueries queries;
  queries.pool_ = DeviceHandle<VkQueryPool, &vkDestroyQueryPool>(device_);
  queries.capacity_ = spans;
  queries.secondsPerTick_ = static_cast<double>(limits().timestampPeriod) * 1e-9;
  queries.tickMask_ = timestampBits_ >= 64 ? ~0ull : (1ull << timestampBits_) - 1;
  auto info = structure<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
  info.queryType = VK_QUERY_TYPE_TIMESTAMP;
  info.queryCount = 2 * spans;
  vkCheck(vkCreateQueryPool(device_, &info, nullptr, queries.pool_.out()), "vkCreateQueryPool");
  queries.reset();
  return queries;
}

}  // namespace mote
