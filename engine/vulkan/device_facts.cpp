#include "engine/vulkan/device_facts.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <string_view>
#include <type_traits>

#include "engine/vulkan/check.h"
#include "engine/vulkan/structure.h"
#include "host/core/error.h"

namespace mote {
namespace {

std::vector<std::string> extensionsOf(VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vkCheck(vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr),
          "vkEnumerateDeviceExtensionProperties");
  std::vector<VkExtensionProperties> there(count);
  vkCheck(vkEnumerateDeviceExtensionProperties(device, nullptr, &count, there.data()),
          "vkEnumerateDeviceExtensionProperties");
  std::vector<std::string> names;
  for (const VkExtensionProperties& extension : there) names.emplace_back(extension.extensionName);
  return names;
}

VkFormatFeatureFlags formatFeatures(VkPhysicalDevice device, VkFormat format) {
  VkFormatProperties properties;
  vkGetPhysicalDeviceFormatProperties(device, format, &properties);
  return properties.optimalTilingFeatures;
}

void readProperties(VkPhysicalDevice device, DeviceFacts& facts) {
  auto driver = structure<VkPhysicalDeviceDriverProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES);
  auto buffers =
      structure<VkPhysicalDeviceMaintenance4Properties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES);
  auto allocations =
      structure<VkPhysicalDeviceMaintenance3Properties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES);
  auto subgroups = structure<VkPhysicalDeviceSubgroupProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES);
  auto sizes = structure<VkPhysicalDeviceSubgroupSizeControlProperties>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_PROPERTIES);
  auto pushed = structure<VkPhysicalDevicePushDescriptorPropertiesKHR>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PUSH_DESCRIPTOR_PROPERTIES_KHR);
  driver.pNext = &buffers;
  buffers.pNext = &allocations;
  allocations.pNext = &subgroups;
  subgroups.pNext = &sizes;
  const auto& names = facts.extensions;
  if (std::find(names.begin(), names.end(), VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME) != names.end())
    sizes.pNext = &pushed;
  auto properties = structure<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
  properties.pNext = &driver;
  vkGetPhysicalDeviceProperties2(device, &properties);
  facts.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
  facts.maxBufferSize = buffers.maxBufferSize;
  facts.maxMemoryAllocationSize = allocations.maxMemoryAllocationSize;
  if (subgroups.supportedStages & VK_SHADER_STAGE_COMPUTE_BIT) facts.subgroupOperations = subgroups.supportedOperations;
  facts.subgroupSize = subgroups.subgroupSize;
  facts.leastSubgroupSize = std::min(subgroups.subgroupSize, std::max(sizes.minSubgroupSize, 1u));
  facts.mostSubgroupSize = std::max(subgroups.subgroupSize, sizes.maxSubgroupSize);
  facts.maxPushDescriptors = pushed.maxPushDescriptors;
}

void readFeatures(VkPhysicalDevice device, DeviceFacts& facts) {
  facts.features12 = structure<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
  facts.features13 = structure<VkPhysicalDeviceVulkan13Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES);
  auto features = structure<VkPhysicalDeviceFeatures2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2);
  features.pNext = &facts.features12;
  facts.features12.pNext = &facts.features13;
  vkGetPhysicalDeviceFeatures2(device, &features);
  facts.features = features.features;
  facts.features12.pNext = nullptr;
}

// ---- overrides ----

constexpr const char* kWhere = "MOTE_LIMITS";

std::uint64_t numberIn(std::string_view name, std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size())
    throw InputError(kWhere, name, "a whole number", fmt::format("\"{}\"", text));
  return value;
}

template <class T>
void lower(T& answer, std::uint64_t value) {
  if (static_cast<double>(value) < static_cast<double>(answer)) answer = static_cast<T>(value);
}

VkPhysicalDeviceType typeNamed(std::string_view text) {
  if (text == "cpu") return VK_PHYSICAL_DEVICE_TYPE_CPU;
  if (text == "discrete") return VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
  if (text == "integrated") return VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU;
  if (text == "virtual") return VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU;
  if (text == "other") return VK_PHYSICAL_DEVICE_TYPE_OTHER;
  throw InputError(kWhere, "deviceType", "cpu, discrete, integrated, virtual or other", fmt::format("\"{}\"", text));
}

std::uint32_t versionIn(std::string_view text) {
  const std::size_t dot = std::min(text.find('.'), text.size() - 1);
  return VK_MAKE_API_VERSION(0, static_cast<std::uint32_t>(numberIn("apiVersion", text.substr(0, dot))),
                             static_cast<std::uint32_t>(numberIn("apiVersion", text.substr(dot + 1))), 0);
}

/// Limits, features and sizes that are a number of their own, by Vulkan's name. True where there is one.
bool overrideNumber(DeviceFacts& f, std::string_view name, std::uint64_t value) {
  VkPhysicalDeviceLimits& l = f.properties.limits;
  const auto in = [&](std::string_view known, auto&... answers) {
    if (name != known) return false;
    (lower(answers, value), ...);
    return true;
  };
#define MOTE_LIMIT(field) in(#field, l.field)
#define MOTE_FEATURE(from, field) in(#field, f.from.field)
  return MOTE_LIMIT(maxImageDimension2D) || MOTE_LIMIT(maxTexelBufferElements) || MOTE_LIMIT(maxStorageBufferRange) ||
         MOTE_LIMIT(maxPushConstantsSize) || MOTE_LIMIT(maxMemoryAllocationCount) ||
         MOTE_LIMIT(maxBoundDescriptorSets) || MOTE_LIMIT(maxPerStageDescriptorSampledImages) ||
         MOTE_LIMIT(maxPerStageResources) || MOTE_LIMIT(maxDescriptorSetSampledImages) ||
         MOTE_LIMIT(maxVertexOutputComponents) || MOTE_LIMIT(maxGeometryInputComponents) ||
         MOTE_LIMIT(maxGeometryOutputComponents) || MOTE_LIMIT(maxGeometryOutputVertices) ||
         MOTE_LIMIT(maxGeometryTotalOutputComponents) || MOTE_LIMIT(maxFragmentInputComponents) ||
         MOTE_LIMIT(maxFragmentOutputAttachments) || MOTE_LIMIT(maxFragmentDualSrcAttachments) ||
         MOTE_LIMIT(maxFragmentCombinedOutputResources) || MOTE_LIMIT(maxComputeSharedMemorySize) ||
         in("maxComputeWorkGroupCount", l.maxComputeWorkGroupCount[0], l.maxComputeWorkGroupCount[1],
            l.maxComputeWorkGroupCount[2]) ||
         MOTE_LIMIT(maxComputeWorkGroupInvocations) ||
         in("maxComputeWorkGroupSize", l.maxComputeWorkGroupSize[0], l.maxComputeWorkGroupSize[1]) ||
         MOTE_LIMIT(maxDrawIndexedIndexValue) || MOTE_LIMIT(maxFramebufferWidth) || MOTE_LIMIT(maxFramebufferHeight) ||
         in("maxViewportDimensions", l.maxViewportDimensions[0], l.maxViewportDimensions[1]) ||
         MOTE_LIMIT(maxColorAttachments) || MOTE_LIMIT(timestampComputeAndGraphics) ||
         in("maxPointSize", l.pointSizeRange[1]) || MOTE_FEATURE(features, geometryShader) ||
         MOTE_FEATURE(features, independentBlend) || MOTE_FEATURE(features, dualSrcBlend) ||
         MOTE_FEATURE(features, fullDrawIndexUint32) || MOTE_FEATURE(features, shaderInt64) ||
         MOTE_FEATURE(features, shaderFloat64) || MOTE_FEATURE(features, largePoints) ||
         MOTE_FEATURE(features12, bufferDeviceAddress) || MOTE_FEATURE(features12, scalarBlockLayout) ||
         MOTE_FEATURE(features12, hostQueryReset) || MOTE_FEATURE(features13, dynamicRendering) ||
         MOTE_FEATURE(features13, synchronization2) || MOTE_FEATURE(features13, maintenance4) ||
         in("maxBufferSize", f.maxBufferSize) || in("maxMemoryAllocationSize", f.maxMemoryAllocationSize) ||
         in("maxPushDescriptors", f.maxPushDescriptors) || in("R32G32B32A32_SFLOAT", f.rgba32f) ||
         in("R32_SFLOAT", f.r32f);
#undef MOTE_FEATURE
#undef MOTE_LIMIT
}

void overrideOne(DeviceFacts& f, std::string_view name, std::string_view text) {
  if (name == "deviceType") {
    f.properties.deviceType = typeNamed(text);
  } else if (name == "apiVersion") {
    f.properties.apiVersion = std::min(f.properties.apiVersion, versionIn(text));
  } else if (const std::uint64_t value = numberIn(name, text); name == "heap") {
    for (std::uint32_t i = 0; i < f.memory.memoryHeapCount; ++i)
      if (f.memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) lower(f.memory.memoryHeaps[i].size, value);
  } else if (name == "subgroupOperations") {
    f.subgroupOperations &= static_cast<VkSubgroupFeatureFlags>(value);
  } else if (name == "minSubgroupSize") {
    lower(f.leastSubgroupSize, value);
  } else if (name == "maxSubgroupSize") {
    f.mostSubgroupSize = std::max(f.mostSubgroupSize, static_cast<std::uint32_t>(value));
  } else if (name.starts_with("VK_")) {
    if (value == 0) std::erase(f.extensions, name);
  } else if (!overrideNumber(f, name, value)) {
    throw InputError(kWhere, "", "the name of a limit, feature or extension that Mote asks for",
                     fmt::format("\"{}\"", name));
  }
}

}  // namespace

std::uint64_t DeviceFacts::memoryBytes() const {
  std::uint64_t largest = 0;
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i)
    if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
      largest = std::max<std::uint64_t>(largest, memory.memoryHeaps[i].size);
  return largest;
}

DeviceFacts readFacts(VkPhysicalDevice device, const std::string& overrides) {
  DeviceFacts facts;
  vkGetPhysicalDeviceProperties(device, &facts.properties);
  vkGetPhysicalDeviceMemoryProperties(device, &facts.memory);
  facts.extensions = extensionsOf(device);
  if (facts.properties.apiVersion >= VK_API_VERSION_1_3) {
    readProperties(device, facts);
    readFeatures(device, facts);
    facts.rgba32f = formatFeatures(device, VK_FORMAT_R32G32B32A32_SFLOAT);
    facts.r32f = formatFeatures(device, VK_FORMAT_R32_SFLOAT);
  }
  for (std::string_view rest = overrides; !rest.empty();) {
    const std::string_view one = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(one.size() + 1, rest.size()));
    const std::size_t equals = one.find('=');
    if (equals == std::string_view::npos || equals + 1 == one.size())
      throw InputError(kWhere, "", "NAME=NUMBER,…", fmt::format("\"{}\"", one));
    overrideOne(facts, one.substr(0, equals), one.substr(equals + 1));
  }
  return facts;
}

}  // namespace mote
