// What the commands that take a scene share: how a scene is opened, and how a frame becomes files.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/renderer.h"
#include "tools/command.h"

namespace CLI {
class App;
}

namespace mote {

/// Flags that change a scene before it is used.
struct SceneOptions {
  std::string scene;
  std::vector<std::string> overrides;  ///< --set
  std::string missing = "error";
  bool strict = false;
};

/// Adds SCENE, --set, --strict and --missing.
void addSceneOptions(CLI::App& command, SceneOptions& options);
/// Reads the scene and changes it as the options say. Throws InputError as readScene does.
Scene openScene(const SceneOptions& options);

/// "cpu", "gpu" or "auto"; throws InputError naming `flag` otherwise. Empty keeps `fallback`.
Backend parseBackend(const std::string& flag, const std::string& text, Backend fallback);

/// "1500000", "512M", "1.5G" (K, M, G, T: powers of 1024); none where it is empty. Throws InputError naming `flag`.
std::optional<std::uint64_t> parseMemoryLimit(const std::string& flag, const std::string& text);

/// The device that the flags ask for; throws InputError for a memory limit that is none.
DeviceOptions deviceOptions(const CommonOptions& common);

/// What is the same for all frames of a run. `gpu` may be null.
RunStats runOf(const Scene& scene, const Backends& backends, const Gpu* gpu);

/// Any message of the validation layers makes the run a failure of the machine: throws MachineError with all of them.
void requireNoValidationMessages(const Gpu* gpu);

/// Writes the EXR with camera matrices, frame, fps and the reproducible statistics in its header.
void writeFrameExr(const std::string& path, const Image& image, const Frame& frame, const Scene& scene,
                   const RunStats& run, const FrameStats& stats);

/// Exposure in stops that brings the 99th percentile of the pixels that hold anything to 0.9.
float autoExposure(const Image& image);

}  // namespace mote
