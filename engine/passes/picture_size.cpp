#include "engine/passes/picture_size.h"

#include <algorithm>

#include "engine/vulkan/check.h"

namespace mote {

void requirePictureFits(const Device& device, std::uint32_t width, std::uint32_t height) {
  const VkPhysicalDeviceLimits& limits = device.limits();
  const std::uint32_t most =
      std::min({limits.maxImageDimension2D, limits.maxFramebufferWidth, limits.maxFramebufferHeight,
                limits.maxViewportDimensions[0], limits.maxViewportDimensions[1]});
  if (width > most || height > most)
    throw DeviceError(DeviceFault::Refused,
                      fmt::format("a picture of {} × {} pixels is too large for {}, which draws at most {} × {}; "
                                  "use a smaller picture or --raster cpu",
                                  width, height, device.name(), most, most));
}

}  // namespace mote
