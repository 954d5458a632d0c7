#include "host/particles/source_reader.h"

#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "host/core/error.h"
#include "host/particles/generate.h"
#include "host/particles/our_channels.h"
#include "host/particles/wide_positions.h"
#include "host/scene/missing_file.h"

namespace mote {
namespace {

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
  return openParticleFile(path, samplingOf(source));
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

/// Requests all but where a particle is and goes.
void addLooks(const ParticleSource& source, const ParticleFile& file, LoadedSource& loaded,
              std::vector<ChannelRequest>& requests) {
  ParticleSet& set = loaded.set;
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
}

}  // namespace

LoadedSource readSource(const ParticleSource& source, const std::string& path, double framesPerSecond,
                        SourceChannels channels) {
  checkChannelKeys(source);
  const std::unique_ptr<ParticleFile> opened = openFile(source, path);
  const ParticleFile& file = *opened;
  LoadedSource loaded;
  loaded.place = path;
  loaded.units = fileUnits(source, file, framesPerSecond);
  ParticleSet& set = loaded.set;
  std::vector<ChannelRequest> requests;

  const ChannelName position = nameInFile(source, file, "Position"), velocity = nameInFile(source, file, "Velocity");
  if (!wanted(source, file, "Position", position)) throwMissingChannel(source, file, "", position.theirs);
  requireVector(file, position.theirs);
  const bool exact = isWide(file.channel(position.theirs)->type);
  std::vector<dvec3> wide;
  if (exact) {
    requests.push_back({position.theirs, &wide});
  } else {
    requests.push_back({position.theirs, &set.position});
  }
  if (channels == SourceChannels::All) addLooks(source, file, loaded, requests);
  if (wanted(source, file, "Velocity", velocity)) {
    requireVector(file, velocity.theirs);
    requests.push_back({velocity.theirs, &set.velocity});
  }
  if (const auto name = nameInFile(source, file, "ID"); wanted(source, file, "ID", name))
    requests.push_back({name.theirs, &set.id});
  file.read(requests);
  if (exact) loaded.centre = toFloats(wide, set.position);
  loaded.count = set.size();
  if (set.density.empty() && channels == SourceChannels::All) set.density.assign(set.size(), source.density);
  return loaded;
}

LoadedSource generateSource(const ParticleSource& source, int frame) {
  LoadedSource loaded;
  loaded.place = scenePlace(source);
  if (source.radius.kind == RadiusRule::Kind::Channel && source.radius.channel != "Radius")
    throw InputError(loaded.place, "radius/channel", "'Radius', the only one that generated particles have",
                     fmt::format("'{}'", source.radius.channel));
  loaded.set = generateParticles(source.generate, source.count, source.seed, frame);
  loaded.count = loaded.set.size();
  return loaded;
}

}  // namespace mote
