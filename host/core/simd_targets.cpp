#include "host/core/simd_targets.h"

#include <fmt/ranges.h>
#include <hwy/targets.h>

#include <cstdint>

#include "host/core/error.h"

namespace mote {
namespace {

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

void limitSimdTargets(const std::string& place, const std::string& name) {
  hwy::DisableTargets(targetNamed(place, name) - 1);  // a better one is a lower bit
}

void useSimdTarget(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);  // all of the machine's
  if (!name.empty()) hwy::SetSupportedTargetsForTest(targetNamed("SIMD target", name));
}

}  // namespace mote
