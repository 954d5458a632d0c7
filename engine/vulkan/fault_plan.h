// Failures of the driver that a test asks for.
#pragma once
#include <volk.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace mote {

/// Calls that can be made to fail: vkCreateDevice, vkAllocateMemory, the creation of a pipeline, vkQueueSubmit2, the
/// wait for what was submitted.
enum class DeviceCall { Open, Allocate, Pipeline, Submit, Wait };

/// Counts calls, and says which are to fail.
class FaultPlan {
 public:
  /// A list "RESULT-CALL@N,…" or "RESULT-CALL@NxM,…": call N, counted from 1, or M calls from the N-th on, fail with
  /// RESULT: lost, memory (out of device memory) or refused (VK_ERROR_UNKNOWN). CALL is open, allocate, pipeline,
  /// submit or wait; "lost@3" means lost-submit@3, "memory@3" memory-allocate@3. Throws InputError for anything else.
  explicit FaultPlan(const std::string& plan);
  /// VK_SUCCESS, or what this call is to fail with.
  VkResult next(DeviceCall call);

 private:
  struct Fault {
    DeviceCall call;
    VkResult result;
    std::uint64_t first, count;
  };
  std::vector<Fault> faults_;
  std::array<std::uint64_t, 5> calls_{};
};

}  // namespace mote
