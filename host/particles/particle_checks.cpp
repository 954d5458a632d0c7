#include "host/particles/particle_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/core/error.h"
#include "host/core/parallel.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 15;

/// Index of the first particle for which `bad` holds, or `count`.
template <class Bad>
std::size_t firstWhere(std::size_t count, const Bad& bad) {
  std::vector<std::size_t> first((count + kGrain - 1) / kGrain, count);
  parallelBlocks(count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (bad(i)) {
        first[begin / kGrain] = i;
        return;
      }
  });
  return first.empty() ? count : *std::min_element(first.begin(), first.end());
}

bool isFinite(const vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
std::string text(const vec3& v) { return fmt::format("({}, {}, {})", v.x, v.y, v.z); }

void checkVectors(const LoadedSource& loaded, const std::vector<vec3>& values, const char* what, const char* when) {
  const std::size_t i = firstWhere(values.size(), [&](std::size_t k) { return !isFinite(values[k]); });
  if (i < values.size())
    throw InputError(loaded.place, fmt::format("particle {}: {}{}", i, what, when),
                     "numbers that are finite in float32", text(values[i]));
}

void checkScalars(const LoadedSource& loaded, const std::vector<float>& values, const char* what, const char* when,
                  bool zeroAllowed) {
  const auto bad = [&](std::size_t k) {
    return !std::isfinite(values[k]) || values[k] < 0 || (values[k] == 0 && !zeroAllowed);
  };
  const std::size_t i = firstWhere(values.size(), bad);
  if (i < values.size())
    throw InputError(loaded.place, fmt::format("particle {}: {}{}", i, what, when),
                     zeroAllowed ? "a finite number ≥ 0" : "a finite number > 0", fmt::format("{}", values[i]));
}

/// Colours of any brightness.
void checkAmounts(const LoadedSource& loaded, const std::vector<vec3>& values, const char* what, const char* when) {
  const auto bad = [&](std::size_t k) {
    const vec3& v = values[k];
    return !isFinite(v) || v.x < 0 || v.y < 0 || v.z < 0;
  };
  const std::size_t i = firstWhere(values.size(), bad);
  if (i < values.size())
    throw InputError(loaded.place, fmt::format("particle {}: {}{}", i, what, when), "finite numbers ≥ 0",
                     text(values[i]));
}

}  // namespace

void checkParticles(const LoadedSource& loaded, const char* when) {
  checkVectors(loaded, loaded.set.position, "position", when);
  checkScalars(loaded, loaded.set.radius, "radius", when, false);
  checkScalars(loaded, loaded.set.density, "density", when, true);
  checkVectors(loaded, loaded.set.color, "colour", when);
  checkAmounts(loaded, loaded.set.absorption, "absorption", when);
  checkAmounts(loaded, loaded.set.emission, "emission", when);
  checkVectors(loaded, loaded.set.velocity, "velocity", when);
}

}  // namespace mote
