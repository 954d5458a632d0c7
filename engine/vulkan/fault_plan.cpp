#include "engine/vulkan/fault_plan.h"

#include <algorithm>
#include <regex>

#include "host/core/error.h"

namespace mote {
namespace {

VkResult resultNamed(const std::string& name) {
  if (name == "lost") return VK_ERROR_DEVICE_LOST;
  return name == "memory" ? VK_ERROR_OUT_OF_DEVICE_MEMORY : VK_ERROR_UNKNOWN;
}

DeviceCall callNamed(const std::string& name, VkResult result) {
  if (name == "open") return DeviceCall::Open;
  if (name == "allocate") return DeviceCall::Allocate;
  if (name == "pipeline") return DeviceCall::Pipeline;
  if (name == "submit") return DeviceCall::Submit;
  if (name == "wait") return DeviceCall::Wait;
  return result == VK_ERROR_OUT_OF_DEVICE_MEMORY ? DeviceCall::Allocate : DeviceCall::Submit;
}

}  // namespace

FaultPlan::FaultPlan(const std::string& plan) {
  static const std::regex form(
      "(lost|memory|refused)(?:-(open|allocate|pipeline|submit|wait))?@(\\d{1,9})(?:x(\\d{1,9}))?");
  for (std::size_t at = 0; at < plan.size();) {
    const std::string one = plan.substr(at, plan.find(',', at) - at);
    std::smatch parts;
    if (!std::regex_match(one, parts, form))
      throw InputError("MOTE_FAULTS", "", "RESULT-CALL@N or RESULT-CALL@NxM", "\"" + one + "\"");
    const VkResult result = resultNamed(parts[1]);
    faults_.push_back(
        {callNamed(parts[2], result), result, std::stoull(parts[3]), parts[4].matched ? std::stoull(parts[4]) : 1});
    at += one.size() + 1;
  }
}

VkResult FaultPlan::next(DeviceCall call) {
  const std::uint64_t number = ++calls_[static_cast<std::size_t>(call)];
  const auto due = std::find_if(faults_.begin(), faults_.end(), [&](const Fault& fault) {
    return fault.call == call && number >= fault.first && number - fault.first < fault.count;
  });
  return due == faults_.end() ? VK_SUCCESS : due->result;
}

}  // namespace mote
