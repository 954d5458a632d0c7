#include "tools/resume.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/core/sha256.h"
#include "host/image/exr.h"
#include "host/scene/frame_path.h"
#include "host/scene/sequence.h"

namespace mote {
namespace {

/// Of mote:stats, file by file.
std::vector<FrameInput> recordedInputs(const nlohmann::json& root) {
  std::vector<FrameInput> inputs;
  for (const nlohmann::json& input : root.at("inputs"))
    inputs.push_back({input.at("file").get<std::string>(), input.at("sha256").get<std::string>()});
  return inputs;
}

/// A file that was missing and is there now stands in no record.
bool hasSources(const std::vector<FrameInput>& inputs, const Scene& scene, int frame) {
  return std::all_of(scene.particles.begin(), scene.particles.end(), [&](const ParticleSource& source) {
    if (source.file.empty()) return true;
    const std::string path = framePath(source.file, fileFrame(source.file, frame, scene.inputs.missing));
    return std::any_of(inputs.begin(), inputs.end(), [&](const FrameInput& input) { return input.file == path; });
  });
}

}  // namespace

std::string settingsOf(const Scene& scene) {
  const auto number = [](auto choice) { return static_cast<int>(choice); };
  return sha256OfText(fmt::format("{} lighting {} raster {} {}x{} strict {} hold {} {}", MOTE_VERSION,
                                  number(scene.lighting.backend), number(scene.view.backend), scene.output.size.x,
                                  scene.output.size.y, scene.inputs.strict,
                                  scene.inputs.missing == MissingFrames::Hold, scene.settings));
}

bool isRendered(const std::string& path, const Scene& scene, int frame, const RunStats& run) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return false;
  try {
    const std::map<std::string, std::string> strings = exrStrings(path);
    const auto made = strings.find("mote:settings"), stats = strings.find("mote:stats");
    if (made == strings.end() || stats == strings.end() || made->second != run.settings) return false;
    const nlohmann::json root = nlohmann::json::parse(stats->second);
    const nlohmann::json& by = root.at("settled_by");
    if (run.settledBy ? by != *run.settledBy : !by.is_null()) return false;
    const std::vector<FrameInput> inputs = recordedInputs(root);
    if (!hasSources(inputs, scene, frame)) return false;
    for (const FrameInput& input : inputs)
      if (sha256OfFile(input.file) != input.sha256) return false;
    readExr(path);  // every byte of it
    return true;
  } catch (const InputError&) {
    return false;  // a damaged picture, or a file that is gone: whoever draws the frame says so
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

}  // namespace mote
