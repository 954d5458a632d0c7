// Turns a VkResult that is not success into a MachineError that names the call, the result and the numbers.
#pragma once
#include <volk.h>

#include <string>
#include <string_view>

namespace mote {

/// "VK_ERROR_OUT_OF_DEVICE_MEMORY"; "VkResult -1234" for what this Mote does not know.
std::string resultName(VkResult result);

/// Throws MachineError "CALL failed: RESULT (detail)" unless `result` is VK_SUCCESS. `detail` holds the numbers.
void vkCheck(VkResult result, std::string_view call, std::string_view detail = {});

}  // namespace mote
