#include "tools/bench/bench_picture.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/image/compare.h"
#include "host/scene/scene_reader.h"
#include "tools/bench/bench_cloud.h"

namespace mote {

Scene benchScene(const nlohmann::json& source, ivec2 size) {
  const nlohmann::json text{{"particles", nlohmann::json::array({source})}, {"medium", {{"optical_depth", 4}}}};
  Scene scene = parseScene(text.dump(), "bench.json");
  const layout::Light light = benchLight();
  scene.defaultLights = false;
  scene.lights = {{.name = "key", .position = dvec3(light.position), .strength = light.power.x, .decay = light.decay}};
  scene.output.size = size;
  return scene;
}

nlohmann::json benchCloudSource(std::uint64_t count) { return {{"generate", "cloud"}, {"count", count}, {"seed", 0}}; }

ivec2 scaledSize(ivec2 full, double share) {
  const double edge = std::sqrt(std::min(share, 1.0));
  return {std::max(1, static_cast<int>(std::lround(full.x * edge))),
          std::max(1, static_cast<int>(std::lround(full.y * edge)))};
}

void addDeviceClock(FrameStats& stats) {
  for (const auto& [stage, seconds] : stats.deviceSeconds) stats.seconds["device_" + stage] = seconds;
}

BenchCheck samePicture(const Image& host, const Image& device) {
  const CompareLimits limits;
  const ImageDifference difference = compareImages(host, device);
  return {fmt::format("pictures differ by RMSE {:.1e} (limit {:.0e}), {:.4f} % within 2/255 (limit {} %)",
                      difference.overall.rmse, limits.rmse, difference.within * 100, limits.within * 100),
          failuresOf(difference).empty()};
}

BenchCheck plausible(const Image& image) {
  const ImageDifference fromBlack = compareImages(image, Image(image.width, image.height, false));
  return {fmt::format("the picture's RMS is {:.3g}, {} pixels are not finite", fromBlack.overall.rmse,
                      fromBlack.overall.notFinite),
          fromBlack.overall.rmse > 0 && fromBlack.overall.notFinite == 0};
}

}  // namespace mote
