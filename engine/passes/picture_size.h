// What a device can draw at once.
#pragma once
#include <cstdint>

#include "engine/vulkan/device.h"

namespace mote {

/// Throws MachineError with the numbers where the device cannot draw pictures of this size [pixels, ≥ 1].
void requirePictureFits(const Device& device, std::uint32_t width, std::uint32_t height);

}  // namespace mote
