#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "host/core/error.h"
#include "host/image/exr.h"
#include "host/scene/scene_reader.h"
#include "host/splat/splat.h"
#include "tools/render.h"

namespace mote {

void addSceneOptions(CLI::App& command, SceneOptions& options) {
  command.add_option("scene", options.scene, "Scene file (JSON)")->required()->type_name("SCENE");
  command.add_option("--set", options.overrides, "Change a value of the scene: /json/pointer=VALUE; may be repeated")
      ->type_name("/POINTER=VALUE")
      ->expected(1)
      ->take_all();
  command.add_flag("--strict", options.strict,
                   "Refuse particles that are not finite or of no size, instead of leaving them out with a warning");
  command
      .add_option("--missing", options.missing,
                  "What frames without a particle file or a mesh are: error, or hold, which takes the one before")
      ->type_name("error|hold");
}

Scene openScene(const SceneOptions& options) {
  Scene scene = readScene(options.scene, options.overrides);
  scene.inputs.strict = options.strict;
  if (options.missing != "error" && options.missing != "hold")
    throw InputError("--missing", "", "error or hold", "\"" + options.missing + "\"");
  if (options.missing == "hold") scene.inputs.missing = MissingFrames::Hold;
  return scene;
}

Backend parseBackend(const std::string& flag, const std::string& text, Backend fallback) {
  if (text.empty()) return fallback;
  if (text == "cpu") return Backend::Cpu;
  if (text == "gpu") return Backend::Gpu;
  if (text == "auto") return Backend::Auto;
  throw InputError(flag, "", "cpu, gpu or auto", "\"" + text + "\"");
}

namespace {

/// "1500000", "512M", "1.5G" (K, M, G, T: powers of 1024) or "80%"; none for anything else.
std::optional<MemoryLimit> memoryIn(const std::string& text) {
  double value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value, std::chars_format::fixed);
  const std::string unit(end, last);
  constexpr std::string_view kUnits = "KMGT";
  const std::size_t power = unit.size() == 1 ? kUnits.find(unit[0]) : std::string_view::npos;
  const bool known = unit.empty() || unit == "%" || power != std::string_view::npos;
  if (error == std::errc() && known && unit == "%" && value > 0 && value <= 100)
    return MemoryLimit{.share = value / 100};
  const double bytes = power == std::string_view::npos ? value : std::ldexp(value, 10 * (static_cast<int>(power) + 1));
  // A double is exact up to 2⁵³, far more than any device has.
  if (error == std::errc() && known && unit != "%" && bytes >= 1 && bytes <= 0x1p53)
    return MemoryLimit{.bytes = static_cast<std::uint64_t>(bytes)};
  return {};
}

/// Of the device's heap; empty: the default.
MemoryLimit parseDeviceMemory(const std::string& text) {
  if (text.empty()) return {};
  if (const std::optional<MemoryLimit> limit = memoryIn(text)) return *limit;
  throw InputError("--device-memory", "", "bytes (1500000, 512M, 1.5G), or a share of the device's memory up to 100%",
                   "\"" + text + "\"");
}

}  // namespace

std::optional<std::uint64_t> parseMemoryLimit(const std::string& flag, const std::string& text) {
  if (text.empty()) return {};
  if (const std::optional<MemoryLimit> limit = memoryIn(text); limit && limit->bytes) return limit->bytes;
  throw InputError(flag, "", "bytes (1500000, 512M, 1.5G)", "\"" + text + "\"");
}

std::string testSetting(const char* name) {
  const char* const value = std::getenv(name);
  return value ? value : "";
}

DeviceOptions deviceOptions(const CommonOptions& common) {
  return {.device = common.device,
          .validate = common.validate,
          .memory = parseDeviceMemory(common.deviceMemory),
          .limits = testSetting("MOTE_LIMITS"),
          .faults = testSetting("MOTE_FAULTS")};
}

void requireNoValidationMessages(const Gpu* gpu) {
  if (!gpu) return;
  const std::vector<std::string> messages = gpu->validationMessages();
  if (messages.empty()) return;
  std::string text = fmt::format("the Vulkan validation layers report {} messages:", messages.size());
  for (const std::string& message : messages) text += "\n  " + message;
  throw MachineError(text);
}

void writeFrameExr(const std::string& path, const Image& image, const Frame& frame, const Scene& scene,
                   const RunStats& run, const FrameStats& stats) {
  ExrOptions options;
  options.precision = scene.output.precision == Precision::Half ? ExrPrecision::Half : ExrPrecision::Float;
  options.compression = static_cast<ExrCompression>(scene.output.compression);  // the same names in the same order
  options.worldToCamera = worldToCamera(frame.view);
  options.worldToNDC = worldToNdc(frame.view);
  options.framesPerSecond = scene.frames.fps;
  options.frame = frame.number;
  options.pixelAspectRatio = scene.output.pixelAspect;
  options.strings = {{"mote:version", MOTE_VERSION}, {"mote:stats", reproducibleStatsJson(stats)}};
  if (!run.settings.empty()) options.strings["mote:settings"] = run.settings;
  if (const dvec3& o = stats.origin; o != dvec3(0))  // what the matrices' world begins at
    options.strings["mote:origin"] = fmt::format("{} {} {}", o.x, o.y, o.z);
  if (!image.depth.empty())  // others write the distance from the camera, or that to the first of all samples
    options.strings["mote:Z"] = fmt::format(
        "distance along the view axis [scene units] to the nearest particle centre whose splat has an alpha >= 0.001, "
        "or "
        "to the nearest shaded surface; {:g} where there is neither",
        kNoDepth);
  writeExr(path, image, options);
}

float autoExposure(const Image& image) {
  std::vector<float> brightness;
  for (const vec4& pixel : image.pixels) {
    const float greatest = std::max({pixel.r, pixel.g, pixel.b});
    if (pixel.a > 1e-3f && greatest > 0 && std::isfinite(greatest)) brightness.push_back(greatest);
  }
  if (brightness.empty()) return 0;
  const auto percentile = brightness.begin() + static_cast<std::ptrdiff_t>((brightness.size() - 1) * 99 / 100);
  std::nth_element(brightness.begin(), percentile, brightness.end());
  return std::log2(0.9f / *percentile);
}

}  // namespace mote
