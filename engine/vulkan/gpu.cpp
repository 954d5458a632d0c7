#include "engine/vulkan/gpu.h"

namespace mote {
namespace {

std::unique_ptr<Device> open(const Instance& instance, const DeviceOptions& options, MemoryLimit memory,
                             std::shared_ptr<FaultPlan> faults) {
  const VkPhysicalDevice device = chooseDevice(instance, options.device, options.limits);
  return std::make_unique<Device>(device, readFacts(device, options.limits),
                                  DeviceSettings{options.stageAlways, memory, options.fill, std::move(faults)});
}

}  // namespace

Gpu::Gpu(const DeviceOptions& options)
    : options_(options),
      faults_(options.faults.empty() ? nullptr : std::make_shared<FaultPlan>(options.faults)),
      instance_(std::make_unique<Instance>(options.validate)),
      device_(open(*instance_, options, options.memory, faults_)) {}

void Gpu::reopen(std::uint64_t bytes) {
  close();
  device_ = open(*instance_, options_, {.bytes = bytes}, faults_);
}

}  // namespace mote
