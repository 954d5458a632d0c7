// Turns a VkResult that is not success into an error that names the call, the result and the numbers.
#pragma once
#include <volk.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "host/core/error.h"

namespace mote {

/// What a device refused, as far as it decides what can be done about it (engine/recovery.h).
enum class DeviceFault {
  Memory,   ///< its memory ran out: smaller parts may fit
  Lost,     ///< VK_ERROR_DEVICE_LOST: it must be opened anew
  Refused,  ///< anything else: a limit, what does not fit even in parts, a driver's bug
};

/// Every failure of a Vulkan device.
class DeviceError : public MachineError {
 public:
  /// `bytes`: of device memory that were asked for when it ran out; 0 where that is not known.
  DeviceError(DeviceFault fault, const std::string& message, std::uint64_t bytes = 0)
      : MachineError(message), fault_(fault), bytes_(bytes) {}
  DeviceFault fault() const { return fault_; }
  std::uint64_t bytes() const { return bytes_; }

 private:
  DeviceFault fault_;
  std::uint64_t bytes_;
};

/// "VK_ERROR_OUT_OF_DEVICE_MEMORY"; "VkResult -1234" for what this Mote does not know.
std::string resultName(VkResult result);

/// Throws DeviceError "CALL failed: RESULT (detail)" unless `result` is VK_SUCCESS. `detail` holds the numbers.
void vkCheck(VkResult result, std::string_view call, std::string_view detail = {}, std::uint64_t bytes = 0);

}  // namespace mote
