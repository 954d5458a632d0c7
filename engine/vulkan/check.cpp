#include "engine/vulkan/check.h"

namespace mote {

std::string resultName(VkResult result) {
  switch (result) {
#define MOTE_RESULT(name) \
  case name: return #name;
    MOTE_RESULT(VK_SUCCESS)
    MOTE_RESULT(VK_NOT_READY)
    MOTE_RESULT(VK_TIMEOUT)
    MOTE_RESULT(VK_INCOMPLETE)
    MOTE_RESULT(VK_ERROR_OUT_OF_HOST_MEMORY)
    MOTE_RESULT(VK_ERROR_OUT_OF_DEVICE_MEMORY)
    MOTE_RESULT(VK_ERROR_INITIALIZATION_FAILED)
    MOTE_RESULT(VK_ERROR_DEVICE_LOST)
    MOTE_RESULT(VK_ERROR_MEMORY_MAP_FAILED)
    MOTE_RESULT(VK_ERROR_LAYER_NOT_PRESENT)
    MOTE_RESULT(VK_ERROR_EXTENSION_NOT_PRESENT)
    MOTE_RESULT(VK_ERROR_FEATURE_NOT_PRESENT)
    MOTE_RESULT(VK_ERROR_INCOMPATIBLE_DRIVER)
    MOTE_RESULT(VK_ERROR_TOO_MANY_OBJECTS)
    MOTE_RESULT(VK_ERROR_FORMAT_NOT_SUPPORTED)
    MOTE_RESULT(VK_ERROR_FRAGMENTED_POOL)
    MOTE_RESULT(VK_ERROR_OUT_OF_POOL_MEMORY)
    MOTE_RESULT(VK_ERROR_INVALID_EXTERNAL_HANDLE)
    MOTE_RESULT(VK_ERROR_FRAGMENTATION)
    MOTE_RESULT(VK_ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS)
    MOTE_RESULT(VK_ERROR_UNKNOWN)
#undef MOTE_RESULT
    default: return fmt::format("VkResult {}", static_cast<int>(result));
  }
}

namespace {

DeviceFault faultOf(VkResult result) {
  switch (result) {
    case VK_ERROR_DEVICE_LOST: return DeviceFault::Lost;
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
    case VK_ERROR_MEMORY_MAP_FAILED: return DeviceFault::Memory;
    default: return DeviceFault::Refused;
  }
}

}  // namespace

void vkCheck(VkResult result, std::string_view call, std::string_view detail, std::uint64_t bytes) {
  if (result == VK_SUCCESS) return;
  std::string message = fmt::format("{} failed: {}", call, resultName(result));
  if (!detail.empty()) message += fmt::format(" ({})", detail);
  throw DeviceError(faultOf(result), message, bytes);
}

}  // namespace mote
