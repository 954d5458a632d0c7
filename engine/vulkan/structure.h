// Vulkan's in-structs, zeroed but for their type.
#pragma once
#include <volk.h>

namespace mote {

/// auto info = structure<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO).
template <class T>
T structure(VkStructureType type) {
  T value{};
  value.sType = type;
  return value;
}

}  // namespace mote
