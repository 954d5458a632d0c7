// mote crosscheck: one frame on TBB and in Vulkan, held against each other: light, sort, picture.
#include <CLI/CLI.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/core/log.h"
#include "host/core/output_file.h"
#include "host/image/compare.h"
#include "host/scene/scene_reader.h"
#include "tools/render.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

/// |ΔT| that two early terminations may differ by is the cutoff itself; without it only rounding is left.
constexpr double kRoundingLimit = 2e-5;
constexpr double kWithinLimit = 0.999, kRmseLimit = 1e-3;

struct CrosscheckOptions {
  SceneOptions scene;
  std::string report;
};

/// One backend's results of the frame.
struct Side {
  std::vector<std::vector<float>> transmittance;  ///< one a light, [channel][receiver]
  std::vector<layout::uint> order;
  Image image;
  FrameStats stats;
};

Side run(const Frame& frame, const Scene& scene, Backends backends, Gpu* gpu) {
  Side side;
  Renderer renderer(backends, gpu);
  LightWanted wanted = lightWanted(scene);
  wanted.transmittance = true;
  LitParticles lit = renderer.light(frame, wanted, side.stats);
  side.transmittance = std::move(lit.transmittance);
  side.image = renderer.draw(frame, scene, std::move(lit), side.stats, &side.order);
  return side;
}

struct LightDifference {
  std::string name;
  double worst = 0, mean = 0;
  double transmittance = 0;  ///< mean of the host's
  std::size_t particle = 0;  ///< input index of the worst
};

LightDifference compareLight(const Frame& frame, std::size_t light, const Side& host, const Side& device) {
  LightDifference difference{frame.lightNames[light]};
  const std::vector<float>&a = host.transmittance[light], &b = device.transmittance[light];
  for (std::size_t slot = 0; slot < a.size(); ++slot) {
    double delta = std::abs(double(a[slot]) - double(b[slot]));
    if (!std::isfinite(delta)) delta = std::numeric_limits<double>::infinity();  // not a number on either side
    difference.transmittance += a[slot] / static_cast<double>(a.size());
    difference.mean += delta / static_cast<double>(a.size());
    if (delta > difference.worst)
      difference.worst = delta, difference.particle = frame.density.source()[slot % frame.density.source().size()];
  }
  return difference;
}

Json lightsReport(const std::vector<LightDifference>& lights, double limit) {
  Json report = Json::array();
  for (const LightDifference& light : lights)
    report.push_back({{"light", light.name},
                      {"worst_delta_transmittance", light.worst},
                      {"mean_delta_transmittance", light.mean},
                      {"mean_transmittance", light.transmittance},
                      {"particle", light.particle},
                      {"limit", limit}});
  return report;
}

double meanAlpha(const Image& image) {
  double sum = 0;
  for (const vec4& pixel : image.pixels) sum += pixel.a;
  return sum / static_cast<double>(image.pixels.size());
}

/// Greatest |difference| of the depth layers where both have one; infinite where only one has.
double depthDifference(const Image& a, const Image& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.depth.size(); ++i)
    if (a.depth[i] != b.depth[i]) worst = std::max(worst, std::abs(double(a.depth[i]) - double(b.depth[i])));
  return worst;
}

void crosscheck(const CrosscheckOptions& options, const CommonOptions& common, int& exitCode) {
  Scene scene = readScene(options.scene.scene, options.scene.overrides);
  if (!options.report.empty()) {
    const OutputFile probe(options.report);
  }
  std::unique_ptr<Gpu> gpu;
  chooseBackends(Backend::Gpu, Backend::Gpu, deviceOptions(common), gpu);
  FrameStats stats;
  const Frame frame = prepareFrame(scene, scene.frames.first, stats);
  const Side host = run(frame, scene, {false, false}, nullptr);
  const Side device = run(frame, scene, {true, true}, gpu.get());
  requireNoValidationMessages(gpu.get());

  const double limit =
      scene.lighting.cutoff > 0 ? std::max<double>(scene.lighting.cutoff, kRoundingLimit) : kRoundingLimit;
  std::vector<LightDifference> lights;
  bool same = true;
  for (std::size_t light = 0; light < frame.lights.size(); ++light) {
    lights.push_back(compareLight(frame, light, host, device));
    const bool within = lights.back().worst <= limit;
    same = same && within;
    fmt::print("light {}: worst |dT| {:.2e} at particle {}, mean {:.2e}, limit {:.0e}: {}\n", lights.back().name,
               lights.back().worst, lights.back().particle, lights.back().mean, limit, within ? "ok" : "DIFFERS");
  }
  const bool sorted = host.order == device.order;
  const ImageDifference picture = compareImages(host.image, device.image);
  const bool pictures = picture.within >= kWithinLimit && picture.overall.rmse <= kRmseLimit;
  fmt::print("sort: {} particles: {}\n", host.order.size(), sorted ? "identical" : "DIFFERS");
  fmt::print("picture: RMSE {:.2e} (limit {:.0e}), within 2/255: {:.4f} % (limit {} %), max {:.2e}: {}\n",
             picture.overall.rmse, kRmseLimit, picture.within * 100, kWithinLimit * 100, picture.overall.max,
             pictures ? "ok" : "DIFFERS");
  same = same && sorted && pictures;
  if (!options.report.empty()) {
    Json pictureReport = Json::parse(differenceJson(picture));
    pictureReport["mean_alpha"] = meanAlpha(host.image);
    const Json report = {{"version", MOTE_VERSION},
                         {"scene", options.scene.scene},
                         {"device", gpu->device().name()},
                         {"particles", frame.particles.size()},
                         {"cutoff", scene.lighting.cutoff},
                         {"lights", lightsReport(lights, limit)},
                         {"sort_identical", sorted},
                         {"picture", std::move(pictureReport)},
                         {"depth_worst", depthDifference(host.image, device.image)},
                         {"seconds", {{"cpu", host.stats.seconds}, {"gpu", device.stats.seconds}}},
                         {"passed", same}};
    writeWholeFile(options.report, report.dump(2) + "\n");
  }
  exitCode = same ? 0 : 1;
}

}  // namespace

void addCrosscheckCommand(CLI::App& app, const CommonOptions& common, int& exitCode) {
  auto options = std::make_shared<CrosscheckOptions>();
  CLI::App* command =
      app.add_subcommand("crosscheck", "Compare CPU and compute: light, sort and picture; 1 if they differ");
  addSceneOptions(*command, options->scene);
  command->add_option("--report", options->report, "Write the differences as JSON")->type_name("OUT.json");
  command->callback([options, &common, &exitCode] { crosscheck(*options, common, exitCode); });
}

}  // namespace mote
