#include "host/particles/our_channels.h"

#include <algorithm>
#include <array>

namespace mote {
namespace {

/// The most common names first: Houdini's, Maya's, then those of simulations and scanners.
struct OurChannel {
  std::string_view ours;
  std::array<std::string_view, 6> theirs;
};
constexpr OurChannel kChannels[] = {
    {"Position", {"P", "position", "pos", "Coordinates", "coordinates", "points"}},
    {"Radius", {"pscale", "radius", "radiusPP", "SmoothingLength", "SmoothingLengths", "Hsml"}},
    {"Density", {"density", "Mass", "mass", "Masses", "opacityPP", "masses"}},
    {"Color", {"Cd", "color", "Colour", "colour", "rgbPP", "Cs"}},
    {"Absorption", {"absorption"}},
    {"Emission", {"emission"}},
    {"Velocity", {"v", "velocity", "vel", "Velocities", "velocities", "velocityPP"}},
    {"ID", {"id", "particleId", "ParticleIDs", "ids", "particle_id", "Ids"}},
};

}  // namespace

std::string ourChannels() {
  std::string names;
  for (const OurChannel& channel : kChannels) {
    const bool last = &channel == std::end(kChannels) - 1;
    names += (names.empty() ? "" : last ? " or " : ", ") + std::string(channel.ours);
  }
  return names;
}

bool isOurChannel(std::string_view name) {
  return std::any_of(std::begin(kChannels), std::end(kChannels), [&](const auto& c) { return c.ours == name; });
}

std::vector<std::string_view> namesInFiles(std::string_view ours) {
  std::vector<std::string_view> names;
  for (const OurChannel& channel : kChannels)
    if (channel.ours == ours) {
      names.push_back(channel.ours);
      for (const std::string_view theirs : channel.theirs)
        if (!theirs.empty()) names.push_back(theirs);
    }
  return names;
}

ChannelName nameInFile(const ParticleSource& source, const ParticleFile& file, const std::string& ours) {
  const auto asked = source.channels.find(ours);
  if (asked != source.channels.end()) return {asked->second, true};
  for (const std::string_view name : namesInFiles(ours))
    if (file.channel(name)) return {std::string(name), false};
  return {ours, false};
}

std::string ourNameOf(const ParticleFile& file, const std::string& theirs) {
  for (const OurChannel& channel : kChannels)
    if (const std::string ours(channel.ours); nameInFile({}, file, ours).theirs == theirs) return ours;
  return "";
}

VolumeSampling samplingOf(const ParticleSource& source) {
  VolumeSampling sampling{.count = {}, .seed = source.seed, .grid = source.grid};
  if (source.count > 0) sampling.count = source.count;
  return sampling;
}

}  // namespace mote
