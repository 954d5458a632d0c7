// The readers of a scene's parts, one .cpp a noun, and what they share. Internal to host/scene: scene_reader.cpp puts
// the parts together.
#pragma once
#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "host/scene/json_reader.h"
#include "host/scene/scene.h"

namespace mote {

// Lengths and coordinates stop here, so that squared distances stay finite in single precision.
constexpr double kMaxLength = 1e18;
constexpr Range kCoordinate = between(-kMaxLength, kMaxLength, "scene units");
constexpr Range kLength{.min = 0, .max = kMaxLength, .minOpen = true, .unit = "scene units"};
constexpr Range kShare = between(0, 1);
constexpr Range kDegrees{.unit = "degrees"};
// "Transmittance_" + name must fit the 31 characters of a PRT channel name.
constexpr std::size_t kMaxNameLength = 17;

/// Each reads the key of its name from the root into `scene`; problems are noted in the reading.
void readParticles(ObjectReader& root, Scene& scene);
void readMedium(ObjectReader& root, Medium& medium);
/// Fills in camera, lights and solids from the file that "import" names; the readers of those keys, which come later,
/// change what it brought. Needs scene.frames. Returns whether it brought a camera.
bool readImport(ObjectReader& root, Scene& scene);
void readLights(ObjectReader& root, Scene& scene);
void readLighting(ObjectReader& root, LightingSettings& lighting);
void readSolids(ObjectReader& root, Scene& scene);
/// `imported`: the camera is that of an import, and not one of defaults.
void readCamera(ObjectReader& root, Camera& camera, bool imported);
void readView(ObjectReader& root, const std::filesystem::path& folder, View& view);
void readOutput(ObjectReader& root, const std::filesystem::path& folder, Output& output);
/// Scene::frames, and Scene::shot where the scene names its frames.
void readFrames(ObjectReader& root, Scene& scene);

/// The folder that a scene's relative paths start from.
std::filesystem::path folderOf(const Scene& scene);
/// A path of the file at `key`, as it is to be opened, with at most one run of # for the frame number.
bool readPath(ObjectReader& object, std::string_view key, std::string& path, const std::filesystem::path& folder);
/// The name at `key` "name": an identifier that is short enough for the channel Transmittance_<name>. `hint`: why.
void readName(ObjectReader& object, std::string& name, std::string_view hint = {});
/// The light or solid of that name, or the end.
template <class Named>
auto findNamed(std::vector<Named>& list, std::string_view name) {
  return std::find_if(list.begin(), list.end(), [&](const Named& each) { return each.name == name; });
}
/// "cpu", "gpu" or "auto" at the key "backend".
void readBackend(ObjectReader& object, Backend& backend);

}  // namespace mote
