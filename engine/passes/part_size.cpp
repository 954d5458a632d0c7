#include "engine/passes/part_size.h"

#include <algorithm>

#include "engine/vulkan/check.h"

namespace mote {

std::uint64_t arraysCost(const Device& device, const std::vector<std::uint64_t>& sizes) {
  std::uint64_t sum = 0;
  for (const std::uint64_t size : sizes) sum += device.bufferCost(size);
  return sum;
}

bool arraysFit(const Device& device, const std::vector<std::uint64_t>& sizes, std::uint64_t reserved) {
  const auto tooLong = [&](std::uint64_t size) { return size > device.maxBufferBytes(); };
  if (std::any_of(sizes.begin(), sizes.end(), tooLong)) return false;
  return arraysCost(device, sizes) + reserved <= device.budget().room();
}

std::uint64_t partThatFits(const Device& device, std::uint64_t count, std::uint64_t least, const ArraySizes& sizes,
                           std::uint64_t reserved, std::string_view what) {
  if (arraysFit(device, sizes(count), reserved)) return count;
  std::uint64_t fits = std::min(least, count), tooMany = count;
  if (!arraysFit(device, sizes(fits), reserved))
    throw DeviceError(
        DeviceFault::Refused,
        fmt::format("{} need {} bytes of memory on {} even in parts, and {} of the {} that may be held there are taken "
                    "(its heap has "
                    "{}); let --device-memory be more, or work with --lighting cpu --raster cpu",
                    what, arraysCost(device, sizes(fits)) + reserved, device.name(), device.budget().held(),
                    device.budget().limit(), device.memoryBytes()));
  while (fits + 1 < tooMany) {
    const std::uint64_t middle = fits + (tooMany - fits) / 2;
    (arraysFit(device, sizes(middle), reserved) ? fits : tooMany) = middle;
  }
  return fits;
}

}  // namespace mote
