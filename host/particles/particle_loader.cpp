#include "host/particles/particle_loader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/particles/particle_checks.h"
#include "host/particles/placement.h"
#include "host/particles/source_reader.h"
#include "host/particles/sub_frames.h"
#include "host/scene/frame_path.h"
#include "host/scene/origin.h"
#include "host/scene/sequence.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 15;

template <class T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
  std::vector<T>().swap(from);
}

/// What Color leaves of 1: the absorption with which Density is the whole extinction (where medium.albedo is 1).
std::vector<vec3> restOfColor(const ParticleSet& set, const vec3& uniformColor) {
  if (set.color.empty()) return std::vector<vec3>(set.size(), glm::max(vec3(0), vec3(1) - uniformColor));
  std::vector<vec3> rest(set.size());
  parallelBlocks(set.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) rest[i] = glm::max(vec3(0), vec3(1) - set.color[i]);
  });
  return rest;
}

/// Gives every part what any part has, so that the arrays can be appended.
void alignChannels(const std::vector<ParticleSource>& sources, std::vector<LoadedSource>& parts, vec3& uniformColor) {
  const auto any = [&](auto&& has) { return std::any_of(parts.begin(), parts.end(), has); };
  const bool velocity = any([](const LoadedSource& p) { return !p.set.velocity.empty(); });
  // Where particles were left out the index no longer says which is which from frame to frame: that in the file does.
  const bool id = any([](const LoadedSource& p) { return !p.set.id.empty() || !p.index.empty(); });
  const bool curved = any([](const LoadedSource& p) { return !p.set.shutterVelocity.empty(); });
  const bool absorption = any([](const LoadedSource& p) { return !p.set.absorption.empty(); });
  const bool emission = any([](const LoadedSource& p) { return !p.set.emission.empty(); });
  uniformColor = sources[0].color;
  bool color = any([](const LoadedSource& p) { return p.hasColor; });
  for (const ParticleSource& source : sources) color = color || source.color != uniformColor;
  std::size_t before = 0;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    ParticleSet& set = parts[k].set;
    if (color && !parts[k].hasColor) set.color.assign(set.size(), sources[k].color);
    if (absorption && set.absorption.empty()) set.absorption = restOfColor(set, sources[k].color);
    if (emission && set.emission.empty()) set.emission.assign(set.size(), vec3(0));
    if (velocity && set.velocity.empty()) set.velocity.assign(set.size(), vec3(0));
    if (curved && set.shutterVelocity.empty()) {
      set.shutterVelocity = set.velocity;
      set.shutterShift.assign(set.size(), vec3(0));
    }
    if (id && set.id.empty()) {
      set.id.resize(set.size());
      const std::vector<std::uint64_t>& index = parts[k].index;
      for (std::size_t i = 0; i < set.size(); ++i) set.id[i] = before + (index.empty() ? i : index[i]);
    }
    before += parts[k].count;
  }
}

ParticleSet merged(const std::vector<ParticleSource>& sources, std::vector<LoadedSource>& parts) {
  vec3 uniformColor(1);
  alignChannels(sources, parts, uniformColor);
  ParticleSet all = std::move(parts[0].set);
  for (std::size_t k = 1; k < parts.size(); ++k) {
    ParticleSet& set = parts[k].set;
    append(all.position, set.position);
    append(all.radius, set.radius);
    append(all.density, set.density);
    append(all.color, set.color);
    append(all.absorption, set.absorption);
    append(all.emission, set.emission);
    append(all.velocity, set.velocity);
    append(all.id, set.id);
    append(all.shutterVelocity, set.shutterVelocity);
    append(all.shutterShift, set.shutterShift);
  }
  all.uniformColor = uniformColor;
  return all;
}

// A float32's steps at a particle may be this share of the mean radius: what is drawn and what rays meet is then off by
// less than the noise of the particles themselves.
constexpr double kSpacingShare = 1e-3;

/// What all sources are measured from together, so that they stay in register: (0, 0, 0) unless float32 is too coarse
/// for their radii there, and finer elsewhere.
dvec3 bestOrigin(const std::vector<LoadedSource>& parts, const std::vector<Placement>& places) {
  SceneBox box;
  double radii = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const ParticleSet& set = parts[k].set;
    box.add(sceneBox(parts[k], places[k]));
    radii += static_cast<double>(radiusRange(set).mean) * places[k].scale * static_cast<double>(set.size());
    count += set.size();
  }
  if (box.empty()) return dvec3(0);
  const dvec3 far = glm::max(glm::abs(box.lo), glm::abs(box.hi));
  const double farthest = std::max({far.x, far.y, far.z}), radius = radii / static_cast<double>(count);
  const double step = std::exp2(std::floor(std::log2(farthest)) - 23);  // of float32 there
  if (!(step > kSpacingShare * radius)) return dvec3(0);
  const dvec3 origin = originOf(box.lo, box.hi, radius);
  if (origin != dvec3(0))
    logWarning(
        fmt::format("coordinates reach {:g}, where float32 goes in steps of {:g} and the mean radius is {:g}: all "
                    "are measured from ({}, {}, {}) instead (\"origin\")",
                    farthest, step, radius, origin.x, origin.y, origin.z));
  return origin;
}

}  // namespace

ParticleSet loadParticles(const std::vector<ParticleSource>& sources, int frame, const LoadRules& rules,
                          std::vector<std::string>* openedFiles) {
  if (sources.empty()) throw InputError("particles", "", "at least one source", "none");
  std::vector<LoadedSource> parts;
  std::vector<Placement> places;
  std::vector<int> frames;  // of the files, which may be held
  for (const ParticleSource& source : sources) {
    frames.push_back(source.file.empty() ? frame : fileFrame(source.file, frame, rules.missing));
    const std::string path = source.file.empty() ? "" : framePath(source.file, frames.back());
    if (openedFiles && !path.empty()) openedFiles->push_back(path);
    LoadedSource loaded =
        path.empty() ? generateSource(source, frame) : readSource(source, path, rules.framesPerSecond);
    checkParticles(loaded, rules.strict, "");
    applyRadiusRule(source, loaded);
    places.push_back(placementOf(source, rules.densityMode, loaded));
    parts.push_back(std::move(loaded));
  }
  const dvec3 origin = rules.origin ? *rules.origin : bestOrigin(parts, places);
  std::string empty;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    moveIntoScene(places[k], origin, parts[k]);
    checkParticles(parts[k], rules.strict, " in the scene");  // what was finite in the file may not be after scaling
    if (sources[k].interpolate == Interpolation::Hermite && rules.shutter.x != rules.shutter.y)
      interpolateShutter(sources[k], rules, frames[k], parts[k], openedFiles);
    if (parts[k].set.size() == 0) empty += fmt::format("{}{}", empty.empty() ? "" : ", ", parts[k].place);
  }
  ParticleSet all = merged(sources, parts);
  all.origin = origin;
  if (all.size() == 0) throw InputError(empty, "", "at least one particle", "none");
  if (!empty.empty()) logWarning(fmt::format("{}: holds no particles in frame {}", empty, frame));
  return all;
}

}  // namespace mote
