#include "engine/vulkan/gpu.h"

namespace mote {

Gpu::Gpu(const DeviceOptions& options)
    : instance_(std::make_unique<Instance>(options.validate)),
      device_(std::make_unique<Device>(chooseDevice(*instance_, options.device), options.stageAlways, options.memory,
                                       options.fill)) {}

}  // namespace mote
