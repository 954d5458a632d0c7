#include "engine/vulkan/physical_device.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "engine/vulkan/check.h"
#include "engine/vulkan/instance.h"
#include "engine/vulkan/structure.h"
#include "host/core/error.h"

namespace mote {
namespace {

std::vector<VkPhysicalDevice> enumerate(const Instance& instance) {
  std::uint32_t count = 0;
  vkCheck(vkEnumeratePhysicalDevices(instance.handle(), &count, nullptr), "vkEnumeratePhysicalDevices");
  std::vector<VkPhysicalDevice> devices(count);
  if (count > 0)
    vkCheck(vkEnumeratePhysicalDevices(instance.handle(), &count, devices.data()), "vkEnumeratePhysicalDevices");
  return devices;
}

std::string versionText(std::uint32_t version) {
  return fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version),
                     VK_API_VERSION_PATCH(version));
}

std::string typeName(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU: return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU: return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU: return "virtual";
    case VK_PHYSICAL_DEVICE_TYPE_CPU: return "cpu";
    default: return "other";
  }
}

int score(const std::string& type) {
  constexpr std::array kBestFirst{"discrete", "integrated", "virtual", "cpu", "other"};
  return static_cast<int>(std::find(kBestFirst.begin(), kBestFirst.end(), type) - kBestFirst.begin());
}

std::uint64_t deviceMemory(VkPhysicalDevice device) {
  VkPhysicalDeviceMemoryProperties memory;
  vkGetPhysicalDeviceMemoryProperties(device, &memory);
  std::uint64_t largest = 0;
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i)
    if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
      largest = std::max<std::uint64_t>(largest, memory.memoryHeaps[i].size);
  return largest;
}

void needFeatures(VkPhysicalDevice device, std::vector<std::string>& missing) {
  auto v13 = structure<VkPhysicalDeviceVulkan13Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES);
  auto v12 = structure<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
  auto features = structure<VkPhysicalDeviceFeatures2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2);
  features.pNext = &v12;
  v12.pNext = &v13;
  vkGetPhysicalDeviceFeatures2(device, &features);
  const auto need = [&](VkBool32 has, const char* name) {
    if (!has) missing.push_back(fmt::format("feature {}", name));
  };
  need(features.features.geometryShader, "geometryShader");
  need(features.features.independentBlend, "independentBlend");
  need(features.features.dualSrcBlend, "dualSrcBlend");
  need(features.features.fullDrawIndexUint32, "fullDrawIndexUint32");
  need(features.features.shaderInt64, "shaderInt64");
  need(v12.bufferDeviceAddress, "bufferDeviceAddress");
  need(v12.scalarBlockLayout, "scalarBlockLayout");
  need(v12.hostQueryReset, "hostQueryReset");
  need(v13.dynamicRendering, "dynamicRendering");
  need(v13.synchronization2, "synchronization2");
  need(v13.maintenance4, "maintenance4");
}

void needExtensions(VkPhysicalDevice device, std::vector<std::string>& missing) {
  std::uint32_t count = 0;
  vkCheck(vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr),
          "vkEnumerateDeviceExtensionProperties");
  std::vector<VkExtensionProperties> there(count);
  vkCheck(vkEnumerateDeviceExtensionProperties(device, nullptr, &count, there.data()),
          "vkEnumerateDeviceExtensionProperties");
  for (const char* needed : kDeviceExtensions)
    if (std::none_of(there.begin(), there.end(),
                     [&](const VkExtensionProperties& e) { return std::string_view(e.extensionName) == needed; }))
      missing.push_back(fmt::format("extension {}", needed));
}

void needSubgroups(VkPhysicalDevice device, std::vector<std::string>& missing) {
  auto subgroups = structure<VkPhysicalDeviceSubgroupProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES);
  auto properties = structure<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
  properties.pNext = &subgroups;
  vkGetPhysicalDeviceProperties2(device, &properties);
  if (!(subgroups.supportedStages & VK_SHADER_STAGE_COMPUTE_BIT)) missing.push_back("subgroup operations in compute");
  const auto need = [&](VkSubgroupFeatureFlagBits operations, const char* name) {
    if (!(subgroups.supportedOperations & operations)) missing.push_back(fmt::format("subgroup operations: {}", name));
  };
  need(VK_SUBGROUP_FEATURE_BASIC_BIT, "basic");
  need(VK_SUBGROUP_FEATURE_VOTE_BIT, "vote");
  need(VK_SUBGROUP_FEATURE_BALLOT_BIT, "ballot");
  need(VK_SUBGROUP_FEATURE_ARITHMETIC_BIT, "arithmetic");
}

void needFormats(VkPhysicalDevice device, std::vector<std::string>& missing) {
  const auto need = [&](VkFormat format, const char* name) {
    constexpr VkFormatFeatureFlags kNeeded =
        VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BLEND_BIT | VK_FORMAT_FEATURE_TRANSFER_SRC_BIT;
    VkFormatProperties properties;
    vkGetPhysicalDeviceFormatProperties(device, format, &properties);
    if ((properties.optimalTilingFeatures & kNeeded) != kNeeded)
      missing.push_back(fmt::format("blended colour attachments of format {}", name));
  };
  need(VK_FORMAT_R32G32B32A32_SFLOAT, "R32G32B32A32_SFLOAT");
  need(VK_FORMAT_R32_SFLOAT, "R32_SFLOAT");
}

void needQueue(VkPhysicalDevice device, std::vector<std::string>& missing) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  constexpr VkQueueFlags kNeeded = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
  for (const VkQueueFamilyProperties& family : families)
    if ((family.queueFlags & kNeeded) == kNeeded) return;
  missing.push_back("a queue with graphics and compute");
}

DeviceReport report(VkPhysicalDevice device) {
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(device, &properties);
  DeviceReport r;
  r.name = properties.deviceName;
  r.type = typeName(properties.deviceType);
  r.apiVersion = versionText(properties.apiVersion);
  r.memory = deviceMemory(device);
  if (properties.apiVersion < VK_API_VERSION_1_3) {  // what follows may not even be asked of an older device
    r.driver = versionText(properties.driverVersion);
    r.missing.push_back(fmt::format("Vulkan version: 1.3 needed, {} there", r.apiVersion));
    return r;
  }
  auto driver = structure<VkPhysicalDeviceDriverProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES);
  auto more = structure<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
  more.pNext = &driver;
  vkGetPhysicalDeviceProperties2(device, &more);
  r.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
  needFeatures(device, r.missing);
  needExtensions(device, r.missing);
  const std::vector<std::string> limits = missingLimits(properties.limits);
  r.missing.insert(r.missing.end(), limits.begin(), limits.end());
  needSubgroups(device, r.missing);
  needFormats(device, r.missing);
  needQueue(device, r.missing);
  return r;
}

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

std::string listed(const std::vector<DeviceReport>& reports) {
  std::string text;
  for (std::size_t i = 0; i < reports.size(); ++i)
    text += fmt::format("{}{}: {} ({})", i ? "; " : "", i, reports[i].name, reports[i].type);
  return text;
}

std::size_t indexOf(const std::vector<DeviceReport>& reports, const std::string& wanted) {
  if (wanted.empty()) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < reports.size(); ++i) {
      const auto rank = [&](std::size_t k) { return std::pair(!reports[k].missing.empty(), score(reports[k].type)); };
      if (rank(i) < rank(best)) best = i;
    }
    return best;
  }
  if (std::all_of(wanted.begin(), wanted.end(), [](unsigned char c) { return std::isdigit(c); })) {
    for (std::size_t i = 0; i < reports.size(); ++i)
      if (std::to_string(i) == wanted) return i;
  } else {
    for (std::size_t i = 0; i < reports.size(); ++i)
      if (lowerCase(reports[i].name).find(lowerCase(wanted)) != std::string::npos) return i;
  }
  throw InputError("--device", "", "the number or a part of the name of a Vulkan device", fmt::format("\"{}\"", wanted),
                   "there are " + listed(reports));
}

}  // namespace

std::vector<std::string> missingLimits(const VkPhysicalDeviceLimits& limits) {
  std::vector<std::string> missing;
  const auto need = [&](std::uint64_t has, std::uint64_t needed, const char* name) {
    if (has < needed) missing.push_back(fmt::format("limit {}: {} needed, {} there", name, needed, has));
  };
  // Every number is what a shader or pass uses. No shader has shared memory.
  need(limits.maxPushConstantsSize, 128, "maxPushConstantsSize");
  need(limits.maxComputeWorkGroupInvocations, 64, "maxComputeWorkGroupInvocations");
  need(limits.maxComputeWorkGroupSize[0], 64, "maxComputeWorkGroupSize[0]");
  need(limits.maxColorAttachments, 2, "maxColorAttachments");
  need(limits.maxGeometryOutputVertices, 4, "maxGeometryOutputVertices");
  need(limits.maxTexelBufferElements, 1 << 22, "maxTexelBufferElements");  // of GridDevice: 64 MiB of kernels
  if (!limits.timestampComputeAndGraphics) missing.push_back("limit timestampComputeAndGraphics");
  return missing;
}

std::vector<DeviceReport> listDevices(const Instance& instance) {
  std::vector<DeviceReport> reports;
  for (VkPhysicalDevice device : enumerate(instance)) reports.push_back(report(device));
  return reports;
}

std::vector<DeviceReport> listDevices() { return listDevices(Instance(false)); }

VkPhysicalDevice chooseDevice(const Instance& instance, const std::string& wanted) {
  const std::vector<VkPhysicalDevice> devices = enumerate(instance);
  if (devices.empty())
    throw MachineError("no Vulkan device; install mesa-vulkan-drivers or use --lighting cpu --raster cpu");
  std::vector<DeviceReport> reports;
  for (VkPhysicalDevice device : devices) reports.push_back(report(device));
  const std::size_t index = indexOf(reports, wanted);
  if (!reports[index].missing.empty())
    throw MachineError(
        fmt::format("the Vulkan device {} ({}) lacks what Mote needs: {}; use --lighting cpu --raster cpu", index,
                    reports[index].name, fmt::join(reports[index].missing, "; ")));
  return devices[index];
}

}  // namespace mote
