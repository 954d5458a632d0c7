#include "host/particles/sub_frames.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/particles/particle_checks.h"
#include "host/particles/placement.h"
#include "host/particles/source_reader.h"
#include "host/scene/frame_path.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 14;
constexpr std::size_t kNone = ~std::size_t{0};

/// (ID, index), sorted: the same for any number of threads.
std::vector<std::pair<std::uint64_t, std::size_t>> sortedIds(const std::vector<std::uint64_t>& ids) {
  std::vector<std::pair<std::uint64_t, std::size_t>> sorted(ids.size());
  parallelBlocks(ids.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) sorted[i] = {ids[i], i};
  });
  tbb::parallel_sort(sorted.begin(), sorted.end());
  return sorted;
}

/// For each of the first, which of the second has its ID: kNone where none has, or several have, here or there.
std::vector<std::size_t> matched(const std::vector<std::uint64_t>& here, const std::vector<std::uint64_t>& there) {
  const auto a = sortedIds(here), b = sortedIds(there);
  std::vector<std::size_t> match(here.size(), kNone);
  const auto endOfRun = [](const auto& sorted, std::size_t i) {
    const std::uint64_t id = sorted[i].first;
    while (i < sorted.size() && sorted[i].first == id) ++i;
    return i;
  };
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const std::size_t nextI = endOfRun(a, i), nextJ = endOfRun(b, j);
    if (a[i].first == b[j].first && nextI == i + 1 && nextJ == j + 1) match[a[i].second] = b[j].second;
    const bool first = a[i].first <= b[j].first, second = b[j].first <= a[i].first;
    if (first) i = nextI;
    if (second) j = nextJ;
  }
  return match;
}

/// A frame beside, in the scene's space about the same origin.
struct Beside {
  double time;  ///< relative to the frame [s]
  LoadedSource loaded;
  Placement place;
  dvec3 shift;
  std::vector<std::size_t> match;  ///< by particle of the frame

  dvec3 position(std::size_t i) const { return place.linear * dvec3(loaded.set.position[i]) + shift; }
  dvec3 velocity(std::size_t i) const { return place.linear * dvec3(loaded.set.velocity[i]) * place.velocity; }
};

void requireMotion(const ParticleSource& source, const LoadedSource& loaded) {
  const auto require = [&](bool has, const char* channel) {
    if (!has)
      throw InputError(scenePlace(source), "interpolate",
                       fmt::format("a file with the channel {}, which \"hermite\" goes by", channel),
                       fmt::format("{}, which has none", loaded.place), R"("velocity" needs no other frames)");
  };
  if (loaded.count == 0) return;
  require(!loaded.set.velocity.empty(), "Velocity");
  require(!loaded.set.id.empty(), "ID");
}

/// None where there is no such file: at the ends of a sequence.
std::optional<Beside> readBeside(const ParticleSource& source, const LoadRules& rules, int frame, int step,
                                 const LoadedSource& here, std::vector<std::string>* openedFiles) {
  const std::string path = framePath(source.file, frame + step);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    logVerbose(fmt::format("{}: no such file; particles of frame {} go along their velocity there", path, frame));
    return std::nullopt;
  }
  if (openedFiles) openedFiles->push_back(path);
  Beside beside{step / rules.framesPerSecond,
                readSource(source, path, rules.framesPerSecond, SourceChannels::Motion),
                {},
                {},
                {}};
  requireMotion(source, beside.loaded);
  if (beside.loaded.set.size() > 0) checkParticles(beside.loaded, rules.strict, "");
  beside.place = placementOf(source, rules.densityMode, beside.loaded);
  beside.shift = beside.place.shift - here.centre;
  beside.match = matched(here.set.id, beside.loaded.set.id);
  return beside;
}

/// From the particle's place at the frame's time to that at `time`.
dvec3 displacement(const dvec3& position, const dvec3& velocity, const Beside* beside, std::size_t i, double time) {
  const std::size_t match = beside ? beside->match[i] : kNone;
  if (match == kNone) return velocity * time;
  const dvec3 there = beside->position(match) - position, thereVelocity = beside->velocity(match);
  const double length = std::abs(beside->time);
  if (std::abs(time) > length) return there + thereVelocity * (time - beside->time);
  if (time < 0) return hermiteAt(there, thereVelocity, dvec3(0), velocity, length, time + length);
  return hermiteAt(dvec3(0), velocity, there, thereVelocity, length, time);
}

bool isFinite(const vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

dvec3 hermiteAt(const dvec3& x0, const dvec3& v0, const dvec3& x1, const dvec3& v1, double length, double time) {
  const double s = time / length, r = 1 - s;
  return r * r * (1 + 2 * s) * x0 + s * s * (3 - 2 * s) * x1 + (length * s * r) * (r * v0 - s * v1);
}

void interpolateShutter(const ParticleSource& source, const LoadRules& rules, int frame, LoadedSource& loaded,
                        std::vector<std::string>* openedFiles) {
  if (!hasFramePattern(source.file))
    throw InputError(scenePlace(source), "interpolate", "\"hermite\" only where the file's name has a frame number",
                     source.file, "as in plume.####.prt");
  requireMotion(source, loaded);
  const double opens = rules.shutter.x, closes = rules.shutter.y;
  std::optional<Beside> before, after;
  if (opens < 0) before = readBeside(source, rules, frame, -1, loaded, openedFiles);
  if (closes > 0) after = readBeside(source, rules, frame, 1, loaded, openedFiles);
  ParticleSet& set = loaded.set;
  set.shutterVelocity.resize(set.size());
  set.shutterShift.resize(set.size());
  parallelBlocks(set.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const dvec3 position(set.position[i]), velocity(set.velocity[i]);
      const auto at = [&](double time) {
        const std::optional<Beside>& beside = time < 0 ? before : after;
        return displacement(position, velocity, beside ? &*beside : nullptr, i, time);
      };
      const dvec3 first = at(opens), mean = (at(closes) - first) / (closes - opens);
      set.shutterVelocity[i] = vec3(mean);
      set.shutterShift[i] = vec3(first - mean * opens);
      // What is beyond float32 beside is drawn as if it were not there.
      if (!isFinite(set.shutterVelocity[i]) || !isFinite(set.shutterShift[i]))
        set.shutterVelocity[i] = set.velocity[i], set.shutterShift[i] = vec3(0);
    }
  });
}

}  // namespace mote
