#include "host/particles/particle_loader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>
#include <iterator>
#include <optional>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/particles/generate.h"
#include "host/particles/our_channels.h"
#include "host/particles/spacing.h"
#include "host/scene/frame_path.h"
#include "host/scene/missing_file.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 15;

/// A source's particles and the name that messages about them start with.
struct Loaded {
  ParticleSet set;
  std::string place;
  bool hasColor = false;
};

std::string scenePlace(const ParticleSource& source) { return source.pointer.empty() ? "particles" : source.pointer; }

// ---- reading ----

[[noreturn]] void throwMissingChannel(const ParticleSource& source, const ParticleFile& file, const std::string& field,
                                      const std::string& name) {
  throw InputError(scenePlace(source), field, fmt::format("a channel of {}", file.path()), fmt::format("'{}'", name),
                   "it has " + describeChannels(file.channels()));
}

/// True if the file has the channel; InputError if it has not but was asked for it.
bool wanted(const ParticleSource& source, const ParticleFile& file, const std::string& ours, const ChannelName& name) {
  if (file.channel(name.theirs)) return true;
  if (name.asked) throwMissingChannel(source, file, "channels/" + ours, name.theirs);
  return false;
}

void requireVector(const ParticleFile& file, const std::string& name) {
  const Channel* channel = file.channel(name);
  if (channel && channel->arity < 3)
    throw InputError(file.path(), fmt::format("channel '{}'", name), "arity 3",
                     fmt::format("arity {}", channel->arity));
}

void checkChannelKeys(const ParticleSource& source) {
  for (const auto& [ours, theirs] : source.channels)
    if (!isOurChannel(ours)) throw InputError(scenePlace(source), "channels", ourChannels(), fmt::format("'{}'", ours));
}

std::unique_ptr<ParticleFile> openFile(const ParticleSource& source, const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    throw InputError(path, "", "a particle file", "no such file", nearestNames(source.file, path));
  return openParticleFile(path);
}

/// Which channel the radii come from, if any.
std::optional<std::string> radiusChannel(const ParticleSource& source, const ParticleFile& file) {
  const RadiusRule& rule = source.radius;
  if (rule.kind == RadiusRule::Kind::Number) return std::nullopt;
  if (rule.kind == RadiusRule::Kind::Channel) {
    const auto mapped = source.channels.find(rule.channel);
    const std::string name = mapped == source.channels.end() ? rule.channel : mapped->second;
    if (!file.channel(name)) throwMissingChannel(source, file, "radius/channel", name);
    return name;
  }
  const ChannelName name = nameInFile(source, file, "Radius");
  return wanted(source, file, "Radius", name) ? std::optional(name.theirs) : std::nullopt;
}

Loaded readFile(const ParticleSource& source, const std::string& path) {
  checkChannelKeys(source);
  const std::unique_ptr<ParticleFile> opened = openFile(source, path);
  const ParticleFile& file = *opened;
  Loaded loaded;
  loaded.place = path;
  ParticleSet& set = loaded.set;
  std::vector<ChannelRequest> requests;

  const ChannelName position = nameInFile(source, file, "Position"), velocity = nameInFile(source, file, "Velocity");
  if (!wanted(source, file, "Position", position)) throwMissingChannel(source, file, "", position.theirs);
  requireVector(file, position.theirs);
  requests.push_back({position.theirs, &set.position});
  if (const auto radius = radiusChannel(source, file)) requests.push_back({*radius, &set.radius});
  if (const auto name = nameInFile(source, file, "Density"); wanted(source, file, "Density", name))
    requests.push_back({name.theirs, &set.density});
  if (const auto name = nameInFile(source, file, "Color"); wanted(source, file, "Color", name)) {
    requests.push_back({name.theirs, &set.color});
    loaded.hasColor = true;
  }
  if (const auto name = nameInFile(source, file, "Absorption"); wanted(source, file, "Absorption", name))
    requests.push_back({name.theirs, &set.absorption});
  if (const auto name = nameInFile(source, file, "Emission"); wanted(source, file, "Emission", name))
    requests.push_back({name.theirs, &set.emission});
  if (wanted(source, file, "Velocity", velocity)) {
    requireVector(file, velocity.theirs);
    requests.push_back({velocity.theirs, &set.velocity});
  }
  if (const auto name = nameInFile(source, file, "ID"); wanted(source, file, "ID", name))
    requests.push_back({name.theirs, &set.id});
  file.read(requests);
  if (set.density.empty()) set.density.assign(set.size(), source.density);
  return loaded;
}

Loaded generateSource(const ParticleSource& source, int frame) {
  Loaded loaded;
  loaded.place = scenePlace(source);
  if (source.radius.kind == RadiusRule::Kind::Channel && source.radius.channel != "Radius")
    throw InputError(loaded.place, "radius/channel", "'Radius', the only one that generated particles have",
                     fmt::format("'{}'", source.radius.channel));
  loaded.set = generateParticles(source.generate, source.count, source.seed, frame);
  return loaded;
}

// ---- checking ----

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

void checkVectors(const Loaded& loaded, const std::vector<vec3>& values, const char* what, const char* when) {
  const std::size_t i = firstWhere(values.size(), [&](std::size_t k) { return !isFinite(values[k]); });
  if (i < values.size())
    throw InputError(loaded.place, fmt::format("particle {}: {}{}", i, what, when),
                     "numbers that are finite in float32", text(values[i]));
}

void checkScalars(const Loaded& loaded, const std::vector<float>& values, const char* what, const char* when,
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
void checkAmounts(const Loaded& loaded, const std::vector<vec3>& values, const char* what, const char* when) {
  const auto bad = [&](std::size_t k) {
    const vec3& v = values[k];
    return !isFinite(v) || v.x < 0 || v.y < 0 || v.z < 0;
  };
  const std::size_t i = firstWhere(values.size(), bad);
  if (i < values.size())
    throw InputError(loaded.place, fmt::format("particle {}: {}{}", i, what, when), "finite numbers ≥ 0",
                     text(values[i]));
}

void check(const Loaded& loaded, const char* when) {
  checkVectors(loaded, loaded.set.position, "position", when);
  checkScalars(loaded, loaded.set.radius, "radius", when, false);
  checkScalars(loaded, loaded.set.density, "density", when, true);
  checkVectors(loaded, loaded.set.color, "colour", when);
  checkAmounts(loaded, loaded.set.absorption, "absorption", when);
  checkAmounts(loaded, loaded.set.emission, "emission", when);
  checkVectors(loaded, loaded.set.velocity, "velocity", when);
}

// ---- radius and place ----

void applyRadiusRule(const ParticleSource& source, Loaded& loaded) {
  ParticleSet& set = loaded.set;
  switch (source.radius.kind) {
    case RadiusRule::Kind::Number: set.radius.assign(set.size(), source.radius.value); return;
    case RadiusRule::Kind::Channel:
      for (float& r : set.radius) r *= source.radius.scale;
      return;
    case RadiusRule::Kind::Auto: break;
  }
  if (!set.radius.empty() || set.size() == 0) return;
  const double spacing = meanNeighbourDistance(set.position);
  const auto radius = static_cast<float>(kAutoRadiusFactor * spacing);
  if (!(radius > 0) || !std::isfinite(radius))
    throw InputError(loaded.place, "", "particles with distances that a radius can be taken from",
                     set.size() == 1 ? "a single particle"
                                     : fmt::format("{} particles with a mean spacing of {}", set.size(), spacing),
                     fmt::format("give {} a \"radius\": a number", scenePlace(source)));
  set.radius.assign(set.size(), radius);
}

void moveIntoScene(const ParticleSource& source, DensityMode mode, ParticleSet& set) {
  if (source.scale == 1 && source.rotate == vec3(0) && source.translate == vec3(0)) return;  // exact, not merely close
  dmat4 rotation(1);
  for (const int axis : {2, 1, 0}) {  // Rz · Ry · Rx: x is applied first
    dvec3 about(0);
    about[axis] = 1;
    rotation = glm::rotate(rotation, glm::radians(static_cast<double>(source.rotate[axis])), about);
  }
  const double scale = source.scale;
  const glm::dmat3 linear = glm::dmat3(rotation) * scale;
  const dvec3 translate(source.translate);
  const double area = mode == DensityMode::Peak ? 1 : scale * scale;
  parallelBlocks(set.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      set.position[i] = vec3(linear * dvec3(set.position[i]) + translate);
      set.radius[i] = static_cast<float>(set.radius[i] * scale);
      set.density[i] = static_cast<float>(set.density[i] * area);
      if (!set.velocity.empty()) set.velocity[i] = vec3(linear * dvec3(set.velocity[i]));
    }
  });
}

// ---- putting together ----

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
void alignChannels(const std::vector<ParticleSource>& sources, std::vector<Loaded>& parts, vec3& uniformColor) {
  const auto any = [&](auto&& has) { return std::any_of(parts.begin(), parts.end(), has); };
  const bool velocity = any([](const Loaded& p) { return !p.set.velocity.empty(); });
  const bool id = any([](const Loaded& p) { return !p.set.id.empty(); });
  const bool absorption = any([](const Loaded& p) { return !p.set.absorption.empty(); });
  const bool emission = any([](const Loaded& p) { return !p.set.emission.empty(); });
  uniformColor = sources[0].color;
  bool color = any([](const Loaded& p) { return p.hasColor; });
  for (const ParticleSource& source : sources) color = color || source.color != uniformColor;
  std::size_t before = 0;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    ParticleSet& set = parts[k].set;
    if (color && !parts[k].hasColor) set.color.assign(set.size(), sources[k].color);
    if (absorption && set.absorption.empty()) set.absorption = restOfColor(set, sources[k].color);
    if (emission && set.emission.empty()) set.emission.assign(set.size(), vec3(0));
    if (velocity && set.velocity.empty()) set.velocity.assign(set.size(), vec3(0));
    if (id && set.id.empty()) {
      set.id.resize(set.size());
      for (std::size_t i = 0; i < set.size(); ++i) set.id[i] = before + i;
    }
    before += set.size();
  }
}

ParticleSet merged(const std::vector<ParticleSource>& sources, std::vector<Loaded>& parts) {
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
  }
  all.uniformColor = uniformColor;
  return all;
}

}  // namespace

ParticleSet loadParticles(const std::vector<ParticleSource>& sources, int frame, DensityMode mode,
                          std::vector<std::string>* openedFiles) {
  if (sources.empty()) throw InputError("particles", "", "at least one source", "none");
  std::vector<Loaded> parts;
  std::string empty;
  for (const ParticleSource& source : sources) {
    const std::string path = source.file.empty() ? "" : framePath(source.file, frame);
    if (openedFiles && !path.empty()) openedFiles->push_back(path);
    Loaded loaded = path.empty() ? generateSource(source, frame) : readFile(source, path);
    check(loaded, "");
    applyRadiusRule(source, loaded);
    moveIntoScene(source, mode, loaded.set);
    check(loaded, " in the scene");  // what was finite in the file may not be after scaling
    if (loaded.set.size() == 0) empty += fmt::format("{}{}", empty.empty() ? "" : ", ", loaded.place);
    parts.push_back(std::move(loaded));
  }
  ParticleSet all = merged(sources, parts);
  if (all.size() == 0) throw InputError(empty, "", "at least one particle", "none");
  if (!empty.empty()) logWarning(fmt::format("{}: holds no particles in frame {}", empty, frame));
  return all;
}

}  // namespace mote
