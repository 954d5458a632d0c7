// How much a device works on at once: everything where its budget allows, else parts.
#pragma once
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "engine/vulkan/device.h"

namespace mote {

/// Particles that a part has at least: fewer would make more submissions than pictures are worth waiting for.
constexpr std::uint64_t kLeastPart = 1024;

/// Sizes of the arrays [bytes] that `count` elements need on the device together.
using ArraySizes = std::function<std::vector<std::uint64_t>(std::uint64_t count)>;

/// What arrays of these sizes take of the device's budget together.
std::uint64_t arraysCost(const Device& device, const std::vector<std::uint64_t>& sizes);
/// Whether arrays of these sizes can be made now, so that `reserved` bytes of the budget stay.
bool arraysFit(const Device& device, const std::vector<std::uint64_t>& sizes, std::uint64_t reserved = 0);

/// The most of `count` elements whose arrays can be made now, so that `reserved` bytes of the budget stay; sizes grow
/// with the number of elements. Throws MachineError with the numbers, which calls the elements `what`, where not even
/// `least` of them (or all, if there are fewer) fit.
std::uint64_t partThatFits(const Device& device, std::uint64_t count, std::uint64_t least, const ArraySizes& sizes,
                           std::uint64_t reserved, std::string_view what);

}  // namespace mote
