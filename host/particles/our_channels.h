// Our channels and what they are called in files (docs/formats.md).
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "host/particles/formats/particle_file.h"
#include "host/scene/scene.h"

namespace mote {

/// "Position, Radius, Density …", for messages.
std::string ourChannels();
bool isOurChannel(std::string_view name);
/// One of our channels, and the names that other programs give it, the most common first.
std::vector<std::string_view> namesInFiles(std::string_view ours);

/// The file's name for one of our channels, and whether the scene asked for it by name.
struct ChannelName {
  std::string theirs;
  bool asked = false;
};
/// What the scene says (`channels`); else our own name; else, where the file has none of that name, the first of the
/// names that other programs use.
ChannelName nameInFile(const ParticleSource& source, const ParticleFile& file, const std::string& ours);

/// The one of our channels that a file's channel is, by its name; empty: none.
std::string ourNameOf(const ParticleFile& file, const std::string& theirs);

/// What the scene says of a volume's particles.
VolumeSampling samplingOf(const ParticleSource& source);

}  // namespace mote
