#include "engine/vulkan/gpu.h"

namespace mote {
namespace {

std::unique_ptr<Device> open(const Instance& instance, const DeviceOptions& options) {
  const VkPhysicalDevice device = chooseDevice(instance, options.device, options.limits);
  return std::make_unique<Device>(device, readFacts(device, options.limits),
                                  DeviceSettings{options.stageAlways, options.memory, options.fill});
}

}  // namespace

Gpu::Gpu(const DeviceOptions& options)
    : instance_(std::make_unique<Instance>(options.validate)), device_(open(*instance_, options)) {}

}  // namespace mote
