// Compiled once for each instruction set by Highway: foreach_target.h includes this file again.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/core/simd_targets.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
//
#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
std::int64_t targetHere() { return HWY_TARGET; }
}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <fmt/ranges.h>

#include "host/core/error.h"
#include "host/core/simd_targets.h"

namespace mote {
HWY_EXPORT(targetHere);

namespace {

std::int64_t limit = 0;  // what the kernels may use, a bit a target; 0: whatever the machine has

/// The bit of the target with that name; throws InputError where this machine has none.
std::int64_t targetNamed(const std::string& place, const std::string& name) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets())
    if (name == hwy::TargetName(target)) return target;
  throw InputError(place, "", fmt::format("one of this machine's instruction sets: {}", fmt::join(simdTargets(), ", ")),
                   "\"" + name + "\"");
}

}  // namespace

std::vector<std::string> simdTargets() {
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) names.emplace_back(hwy::TargetName(target));
  return names;
}

std::string simdTargetInUse() { return hwy::TargetName(HWY_DYNAMIC_DISPATCH(targetHere)()); }

void limitSimdTargets(const std::string& place, const std::string& name) {
  // A better target is a lower bit. Not DisableTargets, which in Highway 1.0.3 changes what SupportedTargets says, and
  // not what is called.
  limit = hwy::SupportedTargets() & ~(targetNamed(place, name) - 1);
  hwy::SetSupportedTargetsForTest(limit);
}

void useSimdTarget(const std::string& name) {
  hwy::SetSupportedTargetsForTest(limit);  // all that there are
  if (!name.empty()) hwy::SetSupportedTargetsForTest(targetNamed("SIMD target", name));
}

}  // namespace mote
#endif
