#include "engine/vulkan/physical_device.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "engine/vulkan/check.h"
#include "engine/vulkan/device_facts.h"
#include "engine/vulkan/instance.h"
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

void needFeatures(const DeviceFacts& facts, std::vector<std::string>& missing) {
  const auto need = [&](VkBool32 has, const char* name) {
    if (!has) missing.push_back(fmt::format("feature {}", name));
  };
  need(facts.features.geometryShader, "geometryShader");
  need(facts.features.independentBlend, "independentBlend");
  need(facts.features.dualSrcBlend, "dualSrcBlend");
  need(facts.features.fullDrawIndexUint32, "fullDrawIndexUint32");
  need(facts.features.shaderInt64, "shaderInt64");
  need(facts.features12.bufferDeviceAddress, "bufferDeviceAddress");
  need(facts.features12.scalarBlockLayout, "scalarBlockLayout");
  need(facts.features12.hostQueryReset, "hostQueryReset");
  need(facts.features13.dynamicRendering, "dynamicRendering");
  need(facts.features13.synchronization2, "synchronization2");
  need(facts.features13.maintenance4, "maintenance4");
}

void needExtensions(const DeviceFacts& facts, std::vector<std::string>& missing) {
  for (const char* needed : kDeviceExtensions)
    if (std::find(facts.extensions.begin(), facts.extensions.end(), needed) == facts.extensions.end())
      missing.push_back(fmt::format("extension {}", needed));
}

void needSubgroups(const DeviceFacts& facts, std::vector<std::string>& missing) {
  if (facts.subgroupOperations == 0) {
    missing.push_back("subgroup operations in compute");
    return;
  }
  const auto need = [&](VkSubgroupFeatureFlagBits operations, const char* name) {
    if (!(facts.subgroupOperations & operations)) missing.push_back(fmt::format("subgroup operations: {}", name));
  };
  need(VK_SUBGROUP_FEATURE_BASIC_BIT, "basic");
  need(VK_SUBGROUP_FEATURE_VOTE_BIT, "vote");
  need(VK_SUBGROUP_FEATURE_BALLOT_BIT, "ballot");
  need(VK_SUBGROUP_FEATURE_ARITHMETIC_BIT, "arithmetic");
}

void needFormats(const DeviceFacts& facts, std::vector<std::string>& missing) {
  const auto need = [&](VkFormatFeatureFlags has, const char* name) {
    constexpr VkFormatFeatureFlags kNeeded =
        VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BLEND_BIT | VK_FORMAT_FEATURE_TRANSFER_SRC_BIT;
    if ((has & kNeeded) != kNeeded) missing.push_back(fmt::format("blended colour attachments of format {}", name));
  };
  need(facts.rgba32f, "R32G32B32A32_SFLOAT");
  need(facts.r32f, "R32_SFLOAT");
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

DeviceReport report(VkPhysicalDevice device, const std::string& overrides) {
  const DeviceFacts facts = readFacts(device, overrides);
  const VkPhysicalDeviceProperties& properties = facts.properties;
  DeviceReport r;
  r.name = properties.deviceName;
  r.type = typeName(properties.deviceType);
  r.apiVersion = versionText(properties.apiVersion);
  r.memory = facts.memoryBytes();
  if (properties.apiVersion < VK_API_VERSION_1_3) {
    r.driver = versionText(properties.driverVersion);
    r.missing.push_back(fmt::format("Vulkan version: 1.3 needed, {} there", r.apiVersion));
    return r;
  }
  r.driver = facts.driver;
  needFeatures(facts, r.missing);
  needExtensions(facts, r.missing);
  const std::vector<std::string> limits = missingLimits(properties.limits, facts.mostSubgroupSize);
  r.missing.insert(r.missing.end(), limits.begin(), limits.end());
  needSubgroups(facts, r.missing);
  needFormats(facts, r.missing);
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

std::vector<std::string> missingLimits(const VkPhysicalDeviceLimits& limits, std::uint32_t mostSubgroupSize) {
  std::vector<std::string> missing;
  const auto need = [&](std::uint64_t has, std::uint64_t needed, const char* name) {
    if (has < needed) missing.push_back(fmt::format("limit {}: {} needed, {} there", name, needed, has));
  };
  // Every number is what a shader or pass uses. No shader has shared memory.
  need(limits.maxPushConstantsSize, 128, "maxPushConstantsSize");
  const std::uint32_t group = std::max(64u, mostSubgroupSize);  // whole subgroups
  need(limits.maxComputeWorkGroupInvocations, group, "maxComputeWorkGroupInvocations");
  need(limits.maxComputeWorkGroupSize[0], group, "maxComputeWorkGroupSize[0]");
  need(limits.maxColorAttachments, 2, "maxColorAttachments");
  need(limits.maxGeometryOutputVertices, 4, "maxGeometryOutputVertices");
  if (!limits.timestampComputeAndGraphics) missing.push_back("limit timestampComputeAndGraphics");
  return missing;
}

std::vector<DeviceReport> listDevices(const Instance& instance, const std::string& overrides) {
  std::vector<DeviceReport> reports;
  for (VkPhysicalDevice device : enumerate(instance)) reports.push_back(report(device, overrides));
  return reports;
}

std::vector<DeviceReport> listDevices() { return listDevices(Instance(false)); }

VkPhysicalDevice chooseDevice(const Instance& instance, const std::string& wanted, const std::string& overrides) {
  const std::vector<VkPhysicalDevice> devices = enumerate(instance);
  if (devices.empty())
    throw MachineError("no Vulkan device; install mesa-vulkan-drivers or use --lighting cpu --raster cpu");
  std::vector<DeviceReport> reports;
  for (VkPhysicalDevice device : devices) reports.push_back(report(device, overrides));
  const std::size_t index = indexOf(reports, wanted);
  if (!reports[index].missing.empty())
    throw MachineError(
        fmt::format("the Vulkan device {} ({}) lacks what Mote needs: {}; use --lighting cpu --raster cpu", index,
                    reports[index].name, fmt::join(reports[index].missing, "; ")));
  return devices[index];
}

}  // namespace mote
