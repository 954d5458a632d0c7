// What Vulkan devices there are, what each lacks for Mote, and which one to take.
#pragma once
#include <volk.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace mote {

class Instance;

/// What is asked of a device beyond Vulkan 1.3.
inline constexpr std::array kDeviceExtensions{VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME};

/// One device as `mote devices` prints it.
struct DeviceReport {
  std::string name;
  std::string type;                  // "discrete", "integrated", "virtual", "cpu" or "other"
  std::string apiVersion;            // "1.3.230"
  std::string driver;                // "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"
  std::uint64_t memory = 0;          // bytes of the largest device-local heap
  std::vector<std::string> missing;  // what Mote needs and this device lacks, by name and number; empty: usable
};

/// The limits that are below what Mote's shaders and passes use: "limit NAME: A needed, B there". Texel buffers and
/// pictures may be of any size that Vulkan allows: the light grid is cut to fit, larger pictures are refused.
std::vector<std::string> missingLimits(const VkPhysicalDeviceLimits& limits, std::uint32_t mostSubgroupSize);

/// All devices in the loader's order: the number that `--device` takes is the index. Throws MachineError when a call
/// fails; an empty list is no error. `overrides` as readFacts takes them.
std::vector<DeviceReport> listDevices(const Instance& instance, const std::string& overrides = {});

/// As above with an instance of its own. Throws MachineError when there is no loader or driver.
std::vector<DeviceReport> listDevices();

/// The device that `wanted` names: its number, or a part of its name in any case; empty takes the best usable one
/// (discrete, integrated, virtual, CPU; in that order). Of several that fit a name the first is taken. Throws
/// InputError with the list of devices when none fits, MachineError when there is no device, or when what was chosen
/// lacks something, with the list of it.
VkPhysicalDevice chooseDevice(const Instance& instance, const std::string& wanted, const std::string& overrides = {});

}  // namespace mote
