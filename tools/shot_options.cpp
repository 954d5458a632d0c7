#include "tools/shot_options.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "host/core/error.h"
#include "host/scene/frame_path.h"

namespace mote {

void addShotOptions(CLI::App& command, ShotOptions& options) {
  addSceneOptions(command, options.scene);
  command.add_option("-o,--output", options.output, "Picture to write; #### is the frame number")->type_name("OUT.exr");
  command.add_option("--frames", options.frames, "Frames A-B, or A-BxS for every S-th")->type_name("A-B[xS]");
  command.add_option("--size", options.size, "Picture size in pixels")->type_name("WxH");
  command.add_option("--lighting", options.lighting, "Where lighting runs: cpu, gpu or auto")->type_name("WHERE");
  command.add_option("--raster", options.raster, "Where splats are drawn: cpu, gpu or auto")->type_name("WHERE");
}

Scene openShot(const ShotOptions& options) {
  Scene scene = openScene(options.scene);
  if (!options.output.empty()) scene.output.file = options.output;
  if (!options.size.empty()) scene.output.size = parseSize(options.size);
  if (!options.frames.empty()) {
    const FrameRange range = parseFrameRange(options.frames);
    scene.frames.first = range.first, scene.frames.last = range.last, scene.frames.step = range.step;
  }
  scene.lighting.backend = parseBackend("--lighting", options.lighting, scene.lighting.backend);
  scene.view.backend = parseBackend("--raster", options.raster, scene.view.backend);
  return scene;
}

std::vector<std::string> argumentsOf(const ShotOptions& options) {
  const auto absolute = [](const std::string& path) { return std::filesystem::absolute(path).string(); };
  std::vector<std::string> arguments{absolute(options.scene.scene)};
  const auto add = [&](const char* flag, const std::string& value) {
    if (!value.empty()) arguments.insert(arguments.end(), {flag, value});
  };
  for (const std::string& change : options.scene.overrides) add("--set", change);
  if (options.scene.strict) arguments.push_back("--strict");
  if (options.scene.missing != "error") add("--missing", options.scene.missing);
  if (!options.output.empty()) add("-o", absolute(options.output));
  add("--size", options.size);
  add("--lighting", options.lighting);
  add("--raster", options.raster);
  return arguments;
}

void requireFramePattern(const std::string& pattern) {
  if (!hasFramePattern(pattern))
    throw InputError(pattern, "", "#### in the name, since there are several frames", "the same name for all of them",
                     "frame.####.exr, for example");
}

std::optional<float> parseExposure(const std::string& text) {
  if (text == "auto") return std::nullopt;
  char* end = nullptr;
  const float value = std::strtof(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(std::abs(value) <= 100))
    throw InputError("--exposure", "", "a number of stops from -100 to 100, or auto", "\"" + text + "\"");
  return value;
}

}  // namespace mote
