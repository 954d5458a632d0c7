#include "host/particles/particle_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 15;

/// One thing that must hold of every particle.
struct Check {
  std::string what;      ///< "radius"
  std::string expected;  ///< "a finite number > 0"
  std::size_t count;     ///< particles that have it
  /// The first in [begin, end) for which it does not hold, or end.
  std::function<std::size_t(std::size_t begin, std::size_t end)> firstBad;
  std::function<std::string(std::size_t)> value;
};

bool isFinite(const vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
template <class V>
std::string text(const V& v) {
  return fmt::format("({}, {}, {})", v.x, v.y, v.z);
}
std::string text(float v) { return fmt::format("{}", v); }

template <class T, class Bad>
Check checkOf(const std::vector<T>& values, const char* what, const char* expected, Bad bad) {
  const auto firstBad = [&values, bad](std::size_t begin, std::size_t end) {
    while (begin < end && !bad(values[begin])) ++begin;
    return begin;
  };
  return {what, expected, values.size(), firstBad, [&values](std::size_t i) { return text(values[i]); }};
}

/// In the order in which a particle's flaws are looked for. They hold on to the set's arrays.
std::vector<Check> checksOf(const LoadedSource& loaded) {
  const ParticleSet& set = loaded.set;
  const auto notFinite = [](const vec3& v) { return !isFinite(v); };
  const auto noAmount = [](const vec3& v) { return !isFinite(v) || v.x < 0 || v.y < 0 || v.z < 0; };
  std::vector<Check> checks = {
      checkOf(set.position, "position", "numbers that are finite in float32", notFinite),
      checkOf(set.radius, "radius", "a finite number > 0", [](float r) { return !std::isfinite(r) || r <= 0; }),
      checkOf(set.density, "density", "a finite number ≥ 0", [](float d) { return !std::isfinite(d) || d < 0; }),
      checkOf(set.color, "colour", "numbers that are finite in float32", notFinite),
      checkOf(set.absorption, "absorption", "finite numbers ≥ 0", noAmount),
      checkOf(set.emission, "emission", "finite numbers ≥ 0", noAmount),
      checkOf(set.velocity, "velocity", "numbers that are finite in float32", notFinite),
  };
  if (loaded.centre != dvec3(0))
    checks[0].value = [&loaded](std::size_t i) { return text(dvec3(loaded.set.position[i]) + loaded.centre); };
  return checks;
}

/// Index of the first particle for which it does not hold, or its count.
std::size_t firstBad(const Check& check) {
  std::vector<std::size_t> first((check.count + kGrain - 1) / kGrain, check.count);
  parallelBlocks(check.count, kGrain, [&](std::size_t begin, std::size_t end) {
    const std::size_t bad = check.firstBad(begin, end);
    if (bad < end) first[begin / kGrain] = bad;
  });
  return first.empty() ? check.count : *std::min_element(first.begin(), first.end());
}

/// Which of the file's particles the set's particle i is.
std::uint64_t indexInFile(const LoadedSource& loaded, std::size_t i) {
  return loaded.index.empty() ? i : loaded.index[i];
}

[[noreturn]] void refuse(const LoadedSource& loaded, const Check& check, std::size_t i, const char* when,
                         const std::string& hint = "") {
  throw InputError(loaded.place, fmt::format("particle {}: {}{}", indexInFile(loaded, i), check.what, when),
                   check.expected, check.value(i), hint);
}

/// Marks what is flawed, each particle for its first flaw, and says what there is.
std::string mark(const LoadedSource& loaded, const std::vector<Check>& checks, const char* when,
                 std::vector<std::uint8_t>& flawed) {
  std::string kinds;
  for (const Check& check : checks) {
    const std::size_t first = firstBad(check);
    if (first == check.count) continue;
    std::vector<std::size_t> counts((check.count + kGrain - 1) / kGrain);
    parallelBlocks(check.count, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = check.firstBad(begin, end); i < end; i = check.firstBad(i + 1, end))
        if (!flawed[i]) flawed[i] = 1, ++counts[begin / kGrain];
    });
    std::size_t count = 0;
    for (const std::size_t n : counts) count += n;
    if (count > 0)
      kinds +=
          fmt::format("{}{} whose {}{} is not {} (particle {}: {}{})", kinds.empty() ? "" : "; ", count, check.what,
                      when, check.expected, indexInFile(loaded, first), check.value(first), count > 1 ? ", …" : "");
  }
  return kinds;
}

template <class T>
void keepOnly(std::vector<T>& values, const std::vector<std::uint64_t>& kept) {
  if (values.empty()) return;
  for (std::size_t k = 0; k < kept.size(); ++k) values[k] = values[kept[k]];  // kept[k] ≥ k
  values.resize(kept.size());
}

void leaveOut(LoadedSource& loaded, const std::vector<std::uint8_t>& flawed) {
  std::vector<std::uint64_t> kept;
  kept.reserve(flawed.size());
  for (std::size_t i = 0; i < flawed.size(); ++i)
    if (!flawed[i]) kept.push_back(i);
  ParticleSet& set = loaded.set;
  for (std::vector<vec3>* values : {&set.position, &set.color, &set.absorption, &set.emission, &set.velocity})
    keepOnly(*values, kept);
  keepOnly(set.radius, kept);
  keepOnly(set.density, kept);
  keepOnly(set.id, kept);
  if (loaded.index.empty()) {
    loaded.index = std::move(kept);
  } else {
    keepOnly(loaded.index, kept);
  }
}

}  // namespace

void checkParticles(LoadedSource& loaded, bool strict, const char* when) {
  const std::vector<Check> checks = checksOf(loaded);
  const auto wrong = std::find_if(checks.begin(), checks.end(), [](const Check& c) { return firstBad(c) < c.count; });
  if (wrong == checks.end()) return;
  const std::size_t first = firstBad(*wrong), all = loaded.set.size();
  if (strict) refuse(loaded, *wrong, first, when);
  std::vector<std::uint8_t> flawed(all);
  const std::string kinds = mark(loaded, checks, when, flawed);
  const auto count = static_cast<std::size_t>(std::count(flawed.begin(), flawed.end(), 1));
  if (count == all)
    refuse(loaded, *wrong, first, when, fmt::format("of its {} particles none is fit to be drawn", loaded.count));
  logWarning(fmt::format("{}: {} of {} particles left out: {}; --strict refuses the file", loaded.place, count,
                         loaded.count, kinds));
  leaveOut(loaded, flawed);
}

}  // namespace mote
