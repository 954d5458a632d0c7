// What a physical device says of itself, as far as Mote asks; a test may let it say less.
#pragma once
#include <volk.h>

#include <cstdint>
#include <string>
#include <vector>

namespace mote {

/// One device's answers. Those of Vulkan 1.3 are zero where `properties.apiVersion` is older: such a device may not
/// even be asked.
struct DeviceFacts {
  VkPhysicalDeviceProperties properties{};  ///< name, type, version, limits
  std::string driver;                       ///< "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"
  VkPhysicalDeviceFeatures features{};
  VkPhysicalDeviceVulkan12Features features12{};
  VkPhysicalDeviceVulkan13Features features13{};
  std::vector<std::string> extensions;
  VkSubgroupFeatureFlags subgroupOperations = 0;  ///< in compute shaders
  /// Invocations a subgroup: what shaders usually get, and the least and most that a driver may choose.
  std::uint32_t subgroupSize = 0, leastSubgroupSize = 0, mostSubgroupSize = 0;
  std::uint64_t maxBufferSize = 0, maxMemoryAllocationSize = 0;
  std::uint32_t maxPushDescriptors = 0;
  VkPhysicalDeviceMemoryProperties memory{};
  VkFormatFeatureFlags rgba32f = 0, r32f = 0;  ///< of images with optimal tiling

  /// The largest device-local heap [bytes].
  std::uint64_t memoryBytes() const;
  bool isCpu() const { return properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU; }
};

/// Asks the device. `overrides`, for tests, is a list "NAME=NUMBER,…" of answers to be replaced: limits, features and
/// sizes by Vulkan's name (maxImageDimension2D=4096, shaderFloat64=0), extensions and formats by theirs (=0: not
/// there), `heap` for the bytes of every device-local heap, `subgroupOperations` as bits,
/// deviceType=cpu|discrete|integrated| virtual|other and apiVersion=1.2. A number above the device's own changes
/// nothing, but for minSubgroupSize and maxSubgroupSize: a device may say less than it can, and that it might choose
/// other subgroups. Throws InputError for a name that is not known, MachineError where a call fails.
DeviceFacts readFacts(VkPhysicalDevice device, const std::string& overrides = {});

}  // namespace mote
