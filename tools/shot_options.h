// The flags that say which pictures of a scene are made: of `mote render`, and of the farm that runs it.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tools/render.h"

namespace mote {

struct ShotOptions {
  SceneOptions scene;
  std::string output, frames, size, lighting, raster;  ///< empty: as in the scene
};

/// Adds SCENE and its flags, -o, --frames, --size, --lighting and --raster.
void addShotOptions(CLI::App& command, ShotOptions& options);
/// The scene with everything that they change.
Scene openShot(const ShotOptions& options);
/// The command line that gives the same pictures from any folder, without --frames: the scene first.
std::vector<std::string> argumentsOf(const ShotOptions& options);

/// Throws InputError where a name of pictures has no place for the number of their frame.
void requireFramePattern(const std::string& pattern);

/// A number of stops, or none for "auto". Throws InputError naming --exposure.
std::optional<float> parseExposure(const std::string& text);

}  // namespace mote
