// The readers of a scene's parts, one .cpp a noun, and what they share. Internal to host/scene: scene_reader.cpp puts
// the parts together.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "host/scene/json_reader.h"
#include "host/scene/scene.h"

namespace mote {

// Lengths and coordinates stop here, so that squared distances stay finite in single precision.
constexpr double kMaxLength = 1e18;
constexpr Range kCoordinate = between(-kMaxLength, kMaxLength, "scene units");
constexpr Range kLength{.min = 0, .max = kMaxLength, .minOpen = true, .unit = "scene units"};
constexpr Range kShare = between(0, 1);
constexpr Range kDegrees{.unit = "degrees"};

/// Each reads the key of its name from the root into `scene`; problems are noted in the reading.
void readParticles(ObjectReader& root, Scene& scene);
void readMedium(ObjectReader& root, Medium& medium);
void readLights(ObjectReader& root, Scene& scene);
void readLighting(ObjectReader& root, LightingSettings& lighting);
void readSolids(ObjectReader& root, Scene& scene);
void readCamera(ObjectReader& root, Camera& camera);
void readView(ObjectReader& root, const std::filesystem::path& folder, View& view);
void readOutput(ObjectReader& root, const std::filesystem::path& folder, Output& output);
void readFrames(ObjectReader& root, Frames& frames);

/// The folder that a scene's relative paths start from.
std::filesystem::path folderOf(const Scene& scene);
/// A path of the file at `key`, as it is to be opened, with at most one run of # for the frame number.
bool readPath(ObjectReader& object, std::string_view key, std::string& path, const std::filesystem::path& folder);
/// The name at `key` "name": an identifier that is short enough for the channel Transmittance_<name>. `hint`: why.
void readName(ObjectReader& object, std::string& name, std::string_view hint = {});
/// "cpu", "gpu" or "auto" at the key "backend".
void readBackend(ObjectReader& object, Backend& backend);

}  // namespace mote
