// What a scene holds, as far as it and the headers of its files tell.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/core/parallel.h"
#include "host/scene/camera_path.h"
#include "host/scene/frame_path.h"
#include "tools/info.h"
#include "tools/scene_facts.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

/// What takes memory and stands in no header.
Json notCounted(const Scene& scene) {
  Json list = Json::array();
  if (!scene.solids.empty()) list.push_back("the solids' meshes and their tree");
  if (!scene.view.spriteColor.empty() || !scene.view.spriteOpacity.empty()) list.push_back("sprites");
  if (std::any_of(scene.particles.begin(), scene.particles.end(),
                  [](const ParticleSource& source) { return source.generate == Generator::Plume; }))
    list.push_back("the plume generator's flow, 200 MB");
  list.push_back("a Vulkan driver's own");
  return list;
}

const char* nameOf(LightType type) {
  switch (type) {
    case LightType::Point: return "point";
    case LightType::Spot: return "spot";
    case LightType::Directional: return "directional";
  }
  return "";
}

const char* nameOf(SolidMode mode) {
  switch (mode) {
    case SolidMode::Shaded: return "shaded";
    case SolidMode::Holdout: return "holdout";
    case SolidMode::Hidden: return "hidden";
  }
  return "";
}

Json lightsJson(const Scene& scene) {
  if (scene.defaultLights) return {{{"name", "key"}, {"type", "point"}, {"casts_shadows", true}, {"fitted", true}}};
  Json list = Json::array();
  for (const LightSource& light : scene.lights)
    list.push_back({{"name", light.name},
                    {"type", nameOf(light.type)},
                    {"casts_shadows", light.castsShadows && light.shadowDensity > 0}});
  return list;
}

std::string listed(const Json& lights) {
  std::string text;
  for (const Json& light : lights)
    text += fmt::format("{}{} ({}{})", text.empty() ? "" : ", ", light["name"].get<std::string>(),
                        light["type"].get<std::string>(), light.contains("fitted") ? ", fitted to the particles" : "");
  return text.empty() ? "none" : text;
}

Json solidsJson(const Scene& scene) {
  Json list = Json::array();
  for (const Solid& solid : scene.solids)
    list.push_back({{"name", solid.name},
                    {"file", framePath(solid.file, scene.frames.first)},
                    {"mode", nameOf(solid.mode)},
                    {"casts_shadows", solid.castsShadows}});
  return list;
}

/// What the particles or the keys decide stays null.
Json cameraJson(const Camera& camera) {
  const bool perspective = camera.projection == Projection::Perspective;
  Json json = {{"type", perspective ? "perspective" : "orthographic"}};
  if (perspective) json["fov"] = camera.fov;
  if (!perspective) json["height"] = camera.fittedHeight ? Json() : Json(camera.height);
  json["fitted"] = camera.fitted;
  json["keys"] = camera.keys.size();
  json["shutter"] = {camera.shutter.x, camera.shutter.y};
  json["aperture_radius"] = camera.apertureRadius;
  const bool known = camera.focusDistance || (!camera.fitted && camera.keys.empty());
  json["focus_distance"] = known ? Json(focusDistanceOf(camera)) : Json();
  return json;
}

Json approximationsJson(const LightingSettings& lighting) {
  return {{"subsample", lighting.autoSubsample ? Json("auto") : Json(lighting.subsample)},
          {"compensate", lighting.compensate},
          {"radius_scale", lighting.radiusScale},
          {"error", lighting.error}};
}

std::string cameraText(const Json& camera) {
  std::string text = camera["type"].get<std::string>();
  if (camera.contains("fov")) text += fmt::format(", fov {:g}°", camera["fov"].get<double>());
  if (camera.contains("height") && !camera["height"].is_null())
    text += fmt::format(", height {:g}", camera["height"].get<double>());
  if (camera["fitted"] == true) text += ", fitted to the particles";
  const auto keys = camera["keys"].get<std::size_t>();
  if (keys > 0) text += fmt::format(", {} {}", keys, keys == 1 ? "key" : "keys");
  const double opens = camera["shutter"][0].get<double>(), closes = camera["shutter"][1].get<double>();
  if (closes > opens) text += fmt::format(", shutter {:g} to {:g} s", opens, closes);
  const double aperture = camera["aperture_radius"].get<double>();
  if (aperture > 0) text += fmt::format(", aperture radius {:g}", aperture);
  if (aperture > 0)
    text += camera["focus_distance"].is_null() ? ", sharp at the target"
                                               : fmt::format(", sharp at {:g}", camera["focus_distance"].get<double>());
  return text;
}

/// "" where lighting is exact.
std::string approximationsText(const Json& lighting) {
  std::vector<std::string> parts;
  const Json& share = lighting["subsample"];
  const char* total = lighting["compensate"] == true ? "that stand for all" : "alone";
  if (share.is_string()) {
    parts.push_back(fmt::format("the smallest share of the particles with a mean |ΔT| <= {:g} in the octree, {}",
                                lighting["error"].get<double>(), total));
  } else if (share != 1.0) {
    parts.push_back(fmt::format("{:g} % of the particles in the octree, {}", 100 * share.get<double>(), total));
  }
  if (lighting["radius_scale"] != 1.0)
    parts.push_back(fmt::format("radii × {:g}", lighting["radius_scale"].get<double>()));
  return fmt::format("{}", fmt::join(parts, "; "));
}

}  // namespace

Json describeScene(const Scene& scene, int frame) {
  const std::vector<SourceFacts> facts = factsOf(scene, frame);
  Json sources = Json::array();
  for (std::size_t k = 0; k < facts.size(); ++k)
    sources.push_back({{scene.particles[k].file.empty() ? "generate" : "file", facts[k].from},
                       {"count", facts[k].count},
                       {"radius", facts[k].radius}});
  const Json lights = lightsJson(scene);
  const auto shadows =
      std::count_if(lights.begin(), lights.end(), [](const Json& l) { return l["casts_shadows"] == true; });
  const std::uint64_t particles = particlesOf(facts);
  const MemoryNeed need = memoryNeed(scene, facts, loadsAhead(scene));
  return {{"file", scene.path},
          {"kind", "scene"},
          {"particles", particles},
          {"sources", sources},
          {"lights", lights},
          {"solids", solidsJson(scene)},
          {"camera", cameraJson(scene.camera)},
          {"lighting", approximationsJson(scene.lighting)},
          {"size", {scene.output.size.x, scene.output.size.y}},
          {"output", scene.output.file},
          {"frames", {{"first", scene.frames.first}, {"last", scene.frames.last}, {"step", scene.frames.step}}},
          {"estimate",
           {{"host_bytes", std::round(need.host)},
            {"device_bytes", std::round(need.device)},
            {"not_counted", notCounted(scene)},
            {"rays", static_cast<double>(particles) * static_cast<double>(shadows)},
            {"threads", threadCount()}}}};
}

void printScene(const Json& info) {
  const auto row = [](const char* name, const std::string& text) { fmt::print("  {:<12} {}\n", name, text); };
  fmt::print("{}: scene of {} particles\n", info["file"].get<std::string>(), info["particles"].get<std::uint64_t>());
  for (const Json& source : info["sources"]) {
    const bool generated = source.contains("generate");
    row(generated ? "generated" : "file",
        fmt::format("{}: {} particles, radius: {}", source[generated ? "generate" : "file"].get<std::string>(),
                    source["count"].get<std::uint64_t>(), source["radius"].get<std::string>()));
  }
  const Json &frames = info["frames"], &estimate = info["estimate"];
  row("lights", listed(info["lights"]));
  for (const Json& solid : info["solids"])
    row("solid", fmt::format("{}: {}, {}", solid["name"].get<std::string>(), solid["mode"].get<std::string>(),
                             solid["file"].get<std::string>()));
  row("camera", cameraText(info["camera"]));
  if (const std::string text = approximationsText(info["lighting"]); !text.empty()) row("lighting", text);
  row("picture", fmt::format("{} × {}, {}", info["size"][0].get<int>(), info["size"][1].get<int>(),
                             info["output"].get<std::string>()));
  row("frames", fmt::format("{} to {}, every {}", frames["first"].get<int>(), frames["last"].get<int>(),
                            frames["step"].get<int>()));
  row("memory",
      fmt::format("about {}; on a Vulkan device about {}; without {}", bytesText(estimate["host_bytes"].get<double>()),
                  bytesText(estimate["device_bytes"].get<double>()),
                  fmt::join(estimate["not_counted"].get<std::vector<std::string>>(), ", ")));
}

}  // namespace mote
