#include "engine/vulkan/fault_plan.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <utility>

#include "host/core/error.h"

namespace mote {
namespace {

constexpr std::pair<std::string_view, VkResult> kResults[] = {{"lost", VK_ERROR_DEVICE_LOST},
                                                              {"memory", VK_ERROR_OUT_OF_DEVICE_MEMORY},
                                                              {"refused", VK_ERROR_UNKNOWN}};
constexpr std::pair<std::string_view, DeviceCall> kCalls[] = {{"open", DeviceCall::Open},
                                                              {"allocate", DeviceCall::Allocate},
                                                              {"pipeline", DeviceCall::Pipeline},
                                                              {"submit", DeviceCall::Submit},
                                                              {"wait", DeviceCall::Wait}};

template <class T, std::size_t N>
std::optional<T> named(const std::pair<std::string_view, T> (&all)[N], std::string_view name) {
  for (const auto& [each, value] : all)
    if (each == name) return value;
  return {};
}

/// Digits and nothing else.
std::optional<std::uint64_t> countIn(std::string_view text) {
  std::uint64_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return count;
}

DeviceCall usualCall(VkResult result) {
  return result == VK_ERROR_OUT_OF_DEVICE_MEMORY ? DeviceCall::Allocate : DeviceCall::Submit;
}

}  // namespace

FaultPlan::FaultPlan(const std::string& plan) {
  for (std::size_t at = 0; at < plan.size();) {
    const std::string_view one = std::string_view(plan).substr(at, plan.find(',', at) - at);
    const std::size_t sign = std::min(one.find('@'), one.size());
    const std::string_view what = one.substr(0, sign), when = one.substr(std::min(sign + 1, one.size()));
    const std::size_t dash = std::min(what.find('-'), what.size()), times = std::min(when.find('x'), when.size());
    const std::optional<VkResult> result = named(kResults, what.substr(0, dash));
    const std::optional<DeviceCall> call =
        dash == what.size() ? usualCall(result.value_or(VK_SUCCESS)) : named(kCalls, what.substr(dash + 1));
    const std::optional<std::uint64_t> first = countIn(when.substr(0, times));
    const std::optional<std::uint64_t> count = times == when.size() ? 1 : countIn(when.substr(times + 1));
    if (!result || !call || !first || !count)
      throw InputError("MOTE_FAULTS", "", "RESULT-CALL@N or RESULT-CALL@NxM", "\"" + std::string(one) + "\"");
    faults_.push_back({*call, *result, *first, *count});
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
