// mote crosscheck: one frame on TBB and in Vulkan, held against each other: light, sort, picture, every layer.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/core/log.h"
#include "host/core/output_file.h"
#include "host/image/compare.h"
#include "tools/render.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

/// |ΔT| that two early terminations may differ by is the cutoff itself; without it only rounding is left.
constexpr double kRoundingLimit = 2e-5;

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
    difference.transmittance += a[slot];
    difference.mean += delta;
    if (delta > difference.worst)
      difference.worst = delta, difference.particle = frame.density.source()[slot % frame.density.source().size()];
  }
  if (!a.empty()) difference.transmittance /= static_cast<double>(a.size());
  if (!a.empty()) difference.mean /= static_cast<double>(a.size());
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

/// Channels beside R G B A that the scene asks for; neither side may leave one out.
std::vector<std::string> wantedChannels(const Frame& frame, const Scene& scene) {
  const Output& output = scene.output;
  std::vector<std::string> names;
  const auto add = [&](const std::string& base, std::initializer_list<const char*> parts) {
    for (const char* part : parts) names.push_back(base + part);
  };
  if (!frame.extinction.grey()) add("A", {"R", "G", "B"});
  if (output.depth) add("Z", {""});
  if (output.opticalDepth) add("optical_depth", {""});
  if (output.velocity) add("velocity", {".x", ".y"});
  for (const std::string& light : frame.lightNames) {
    if (output.shadow) add("shadow." + light, {""});
    if (output.lights) add("light." + light, {".R", ".G", ".B"});
  }
  if (output.lights && !frame.particles.emission.empty() && scene.medium.emissionScale > 0)
    add("emission", {".R", ".G", ".B"});
  return names;
}

/// Channels that are looked at together: AR AG AB, light.<name>, velocity, …
std::string groupOf(const std::string& channel) {
  if (channel == "AR" || channel == "AG" || channel == "AB") return "AR AG AB";
  for (const char* part : {".R", ".G", ".B", ".x", ".y"})
    if (channel.ends_with(part)) return channel.substr(0, channel.size() - 2);
  return channel;
}

/// The worst of a group's channels, and what is wrong with any of them.
struct LayerGroup {
  std::string name;
  LayerDifference worst{};  ///< each number the worst of all channels'
  std::vector<std::string> failures{};
};

std::vector<LayerGroup> layerGroups(const ImageDifference& picture) {
  std::vector<LayerGroup> groups;
  for (const LayerDifference& layer : picture.layers) {
    const std::string name = groupOf(layer.name);
    auto group = std::find_if(groups.begin(), groups.end(), [&](const LayerGroup& g) { return g.name == name; });
    if (group == groups.end()) group = groups.insert(groups.end(), LayerGroup{.name = name, .worst = layer});
    LayerDifference& worst = group->worst;
    worst.channel.max = std::max(worst.channel.max, layer.channel.max);
    worst.channel.rmse = std::max(worst.channel.rmse, layer.channel.rmse);
    worst.channel.notFinite = std::max(worst.channel.notFinite, layer.channel.notFinite);
    worst.unmatched = std::max(worst.unmatched, layer.unmatched);
    worst.within = std::min(worst.within, layer.within);
    worst.scale = std::max(worst.scale, layer.scale), worst.level = std::max(worst.level, layer.level);
    for (std::string& failure : failuresOf(layer)) group->failures.push_back(std::move(failure));
  }
  return groups;
}

Json layersReport(const std::vector<LayerGroup>& groups) {
  Json report = Json::array();
  for (const LayerGroup& group : groups)
    report.push_back({{"layer", group.name},
                      {"worst", group.worst.channel.max},
                      {"rmse", group.worst.channel.rmse},
                      {"scale", group.worst.scale},
                      {"level", group.worst.level},
                      {"within", group.worst.within},
                      {"unmatched", group.worst.unmatched},
                      {"not_finite", group.worst.channel.notFinite},
                      {"passed", group.failures.empty()}});
  return report;
}

/// What the two sides made of the frame, judged.
struct Verdict {
  double limit = 0;  ///< of |ΔT|
  std::vector<LightDifference> lights;
  bool sorted = false;
  ImageDifference picture;
  std::vector<LayerGroup> groups;
  std::vector<std::string> failures;  ///< empty: the same
};

Verdict judge(const Frame& frame, const Scene& scene, const Side& host, const Side& device) {
  Verdict verdict;
  verdict.limit = std::max<double>(scene.lighting.cutoff, kRoundingLimit);
  for (std::size_t light = 0; light < frame.lights.size(); ++light) {
    verdict.lights.push_back(compareLight(frame, light, host, device));
    const LightDifference& found = verdict.lights.back();
    if (!(found.worst <= verdict.limit))
      verdict.failures.push_back(
          fmt::format("light {}: |dT| of {:.2e} exceeds {:.0e}", found.name, found.worst, verdict.limit));
  }
  verdict.sorted = host.order == device.order;
  if (!verdict.sorted) verdict.failures.push_back("the particles are not in the same order");
  verdict.picture = compareImages(host.image, device.image);
  for (std::string& failure : failuresOf(verdict.picture)) verdict.failures.push_back(std::move(failure));
  verdict.groups = layerGroups(verdict.picture);
  for (const std::string& name : wantedChannels(frame, scene)) {
    const auto& layers = verdict.picture.layers;
    if (std::none_of(layers.begin(), layers.end(), [&](const LayerDifference& l) { return l.name == name; }))
      verdict.failures.push_back(fmt::format("{}: asked for, and not in both pictures", name));
  }
  return verdict;
}

void print(const Verdict& verdict, std::size_t particles) {
  const CompareLimits limits;
  const auto word = [](bool good) { return good ? "ok" : "DIFFERS"; };
  for (const LightDifference& light : verdict.lights)
    fmt::print("light {}: worst |dT| {:.2e} at particle {}, mean {:.2e}, limit {:.0e}: {}\n", light.name, light.worst,
               light.particle, light.mean, verdict.limit, word(light.worst <= verdict.limit));
  fmt::print("sort: {} particles: {}\n", particles, verdict.sorted ? "identical" : "DIFFERS");
  const ImageDifference& picture = verdict.picture;
  const bool alike =
      picture.within >= limits.within && picture.overall.rmse <= limits.rmse && picture.overall.notFinite == 0;
  fmt::print("picture: RMSE {:.2e} (limit {:.0e}), within 2/255: {:.4f} % (limit {} %), max {:.2e}: {}\n",
             picture.overall.rmse, limits.rmse, picture.within * 100, limits.within * 100, picture.overall.max,
             word(alike));
  for (const LayerGroup& group : verdict.groups)
    fmt::print("layer {}: RMSE {:.2e}, within 2/255 of {:.2g}: {:.4f} % (limit {} %), max {:.2e}: {}\n", group.name,
               group.worst.channel.rmse, group.worst.scale, group.worst.within * 100, limits.within * 100,
               group.worst.channel.max, word(group.failures.empty()));
  for (const std::string& failure : verdict.failures) fmt::print("differs: {}\n", failure);
}

void crosscheck(const CrosscheckOptions& options, const CommonOptions& common, int& exitCode) {
  Scene scene = openScene(options.scene);
  if (!options.report.empty()) {
    const OutputFile probe(options.report);
  }
  std::unique_ptr<Gpu> gpu;
  chooseBackends(Backend::Gpu, Backend::Gpu, deviceOptions(common), gpu);
  FrameStats stats;
  Frame frame = prepareFrame(scene, scene.frames.first, stats);
  frame.error = {};  // exact sums on both sides
  const Side host = run(frame, scene, {false, false}, nullptr);
  const Side device = run(frame, scene, {true, true}, gpu.get());
  requireNoValidationMessages(gpu.get());

  const Verdict verdict = judge(frame, scene, host, device);
  print(verdict, host.order.size());
  if (!options.report.empty()) {
    Json pictureReport = Json::parse(differenceJson(verdict.picture));
    pictureReport["mean_alpha"] = meanAlpha(host.image);
    const Json report = {{"version", MOTE_VERSION},
                         {"scene", options.scene.scene},
                         {"device", gpu->device().name()},
                         {"particles", frame.particles.size()},
                         {"in_octree", frame.density.tree().particleCount()},
                         {"octree_nodes", frame.density.tree().nodeCount()},
                         {"cutoff", scene.lighting.cutoff},
                         {"lights", lightsReport(verdict.lights, verdict.limit)},
                         {"sort_identical", verdict.sorted},
                         {"picture", std::move(pictureReport)},
                         {"layers", layersReport(verdict.groups)},
                         {"seconds", {{"cpu", host.stats.seconds}, {"gpu", device.stats.seconds}}},
                         {"failures", verdict.failures},
                         {"passed", verdict.failures.empty()}};
    writeWholeFile(options.report, report.dump(2) + "\n");
  }
  exitCode = verdict.failures.empty() ? 0 : 1;
}

}  // namespace

void addCrosscheckCommand(CLI::App& app, const CommonOptions& common, int& exitCode) {
  auto options = std::make_shared<CrosscheckOptions>();
  CLI::App* command =
      app.add_subcommand("crosscheck", "Compare CPU and compute: light, sort, picture and layers; 1 if they differ");
  addSceneOptions(*command, options->scene);
  command->add_option("--report", options->report, "Write the differences as JSON")->type_name("OUT.json");
  command->callback([options, &common, &exitCode] { crosscheck(*options, common, exitCode); });
}

}  // namespace mote
