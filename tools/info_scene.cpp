// The scenes' part of `mote info`: what they hold, and an estimate of what their first frame takes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/octree/octree.h"
#include "host/particles/our_channels.h"
#include "host/scene/camera_path.h"
#include "host/scene/frame_path.h"
#include "host/scene/missing_file.h"
#include "host/scene/scene_reader.h"
#include "host/solids/surfaces.h"
#include "shaders/glsl/layout/node.h"
#include "shaders/glsl/layout/sort.h"
#include "shaders/glsl/layout/splat.h"
#include "tools/info.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

/// One source as far as its header or the scene tells.
struct SourceFacts {
  std::uint64_t count = 0;
  std::string from, radius;
  bool color = false, absorption = false, emission = false, velocity = false, id = false;
};

const char* nameOf(Generator generator) {
  switch (generator) {
    case Generator::Ball: return "ball";
    case Generator::Cloud: return "cloud";
    case Generator::Plume: return "plume";
    case Generator::None: break;
  }
  return "none";
}

std::string radiusText(const ParticleSource& source, bool hasChannel) {
  const RadiusRule& rule = source.radius;
  if (rule.kind == RadiusRule::Kind::Number) return fmt::format("{:g}", rule.value);
  if (rule.kind == RadiusRule::Kind::Channel) return fmt::format("channel {} × {:g}", rule.channel, rule.scale);
  return hasChannel ? "channel Radius" : "auto: 1.5 × the mean distance to the nearest 8";
}

SourceFacts fileFacts(const ParticleSource& source, int frame) {
  const std::string path = framePath(source.file, frame);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    throw InputError(path, "", "a particle file", "no such file", nearestNames(source.file, path));
  const std::unique_ptr<ParticleFile> file = openParticleFile(path, samplingOf(source));
  const auto has = [&](const std::string& ours) {
    return file->channel(nameInFile(source, *file, ours).theirs) != nullptr;
  };
  return {.count = file->count(),
          .from = path,
          .radius = radiusText(source, has("Radius")),
          .color = has("Color"),
          .absorption = has("Absorption"),
          .emission = has("Emission"),
          .velocity = has("Velocity"),
          .id = has("ID")};
}

SourceFacts factsOf(const ParticleSource& source, int frame) {
  if (!source.file.empty()) return fileFacts(source, frame);
  return {.count = source.count,
          .from = nameOf(source.generate),
          .radius = radiusText(source, true),
          .velocity = source.generate == Generator::Plume,
          .id = true};
}

/// Bytes that one frame holds at its peak: what grows with the particles or the picture, and the program itself. A test
/// holds the host's against renders.
struct MemoryNeed {
  double host = 0, device = 0;
};

/// What of a scene decides about its memory.
struct MemoryFacts {
  double particles, pixels, lights;
  double share;      ///< of the particles in the octree; "auto" may take all
  double cellNodes;  ///< bytes of nodes a particle in the tree
  bool color, absorption, emission, velocity, id;
  bool moving;       ///< velocities are drawn
  bool curved;       ///< paths in the shutter beside them
  bool rgb, solids;  ///< extinction that is not grey; solids that are seen
  bool ahead;        ///< the next frame's particles load meanwhile

  MemoryFacts(double count, const std::vector<SourceFacts>& sources, const Scene& scene) {
    const auto any = [&](bool SourceFacts::*has) {
      return std::any_of(sources.begin(), sources.end(), [&](const SourceFacts& s) { return s.*has; });
    };
    particles = count;
    pixels = double(scene.output.size.x) * scene.output.size.y;
    lights = scene.defaultLights ? 1 : static_cast<double>(scene.lights.size());
    share = scene.lighting.autoSubsample ? 1 : scene.lighting.subsample;
    // Particles a cell × nodes a particle: between 2 and 7, by how the particles fall into the cells; measured for the
    // three generators, 10⁴ to 10⁶ particles, 8 to 128 a cell.
    const double perCell =
        scene.lighting.particlesPerCell > 0 ? scene.lighting.particlesPerCell : kDefaultParticlesPerCell;
    cellNodes = std::min(2.0, 4 / perCell) * sizeof(layout::Node);
    color = any(&SourceFacts::color), absorption = any(&SourceFacts::absorption);
    emission = any(&SourceFacts::emission), velocity = any(&SourceFacts::velocity), id = any(&SourceFacts::id);
    moving = velocity && (scene.output.velocity || scene.camera.shutter.x != scene.camera.shutter.y);
    curved = scene.camera.shutter.x != scene.camera.shutter.y &&
             std::any_of(scene.particles.begin(), scene.particles.end(),
                         [](const ParticleSource& source) { return source.interpolate == Interpolation::Hermite; });
    const vec3& e = scene.medium.extinction;
    rgb = absorption || e.x != e.y || e.y != e.z;
    ahead = scene.frames.first + scene.frames.step <= scene.frames.last && threadCount() > 1;
    solids = std::any_of(scene.solids.begin(), scene.solids.end(),
                         [](const Solid& solid) { return solid.mode != SolidMode::Hidden; });
  }
  /// Receivers of their own beside those in the tree.
  bool sampled() const { return share < 1; }
  /// The splat of a particle with what full splats have: colours, emission, velocity.
  double splat() const { return sizeof(layout::SplatParticle) + 12.0 * (rgb + emission + moving); }
};

/// Bytes a particle on the host while the picture is drawn, which is when most is held.
double particleBytes(const MemoryFacts& f, const Output& output) {
  const double loaded =
      12 + 4 + 4 + 12.0 * (f.color + f.absorption + f.emission + f.velocity) + 8.0 * f.id + 24.0 * f.curved;
  const double set = loaded * (f.ahead ? 2 : 1) + 4;  // and the optical depth through each
  const double tree = f.share * (6 * 4 + 8 * f.absorption + f.cellNodes) + (f.sampled() ? 5 * 4 : 0);
  const double sort = 8 + 4;                                                                 // (key, index) and order
  const double splats = f.splat() + 12.0 * f.absorption;                                     // and factors of colours
  const double byLight = output.lights ? 12 * f.lights + sizeof(layout::SplatParticle) : 0;  // and one light's splats
  return set + tree + sort + splats + byLight;
}

/// Bytes a pixel of one drawing.
double drawnBytes(const MemoryFacts& f, const Output& output) {
  return 16 + 4.0 * output.depth + 4.0 * output.opticalDepth + 8.0 * output.velocity + 12.0 * f.rgb;
}

/// Bytes a pixel on the host, as if surfaces were all over the picture: while it is drawn, or while they are gathered.
double pixelBytes(const MemoryFacts& f, const Output& output) {
  const double lightLayers = output.lights ? f.lights + f.emission : 0;
  const double layers = 4 * (output.shadow ? f.lights : 0) + 12 * lightLayers;
  const double one = lightLayers > 0 ? 16 + 12.0 * (f.rgb && f.solids) : 0;  // the picture by one light
  const double drawn = drawnBytes(f, output) + layers + one;
  if (!f.solids) return drawn + (output.precision == Precision::Half ? 2 * (4 + 3.0 * f.rgb + 3 * lightLayers) : 0);
  const double surfaces = sizeof(Surface) + 4 + 12 + 16 * f.lights;  // and where a pixel's begin, and their light
  // Two drawings at once, and four depths for the rasteriser; what is written as half comes when all that is gone.
  return std::max(2.0 * sizeof(Surface) + 4, drawn + drawnBytes(f, output) + one + 4 * 4 + surfaces);
}

MemoryNeed memoryNeed(const MemoryFacts& f, const Scene& scene) {
  constexpr double kProgram = 50e6;  // code, libraries (30 MB are OpenVDB's tables), threads
  const double channels = f.absorption ? 3 : 1;
  const double lighting = f.share * (f.cellNodes + 16 + 4 * channels) + 4 + 4 * channels +  // tree, order, result
                          (f.sampled() ? 16 + 4 : 0);
  const double drawing = f.splat() + sizeof(layout::SortPair) + 4;
  const bool layers = scene.output.depth || scene.output.opticalDepth || scene.output.velocity || f.rgb;
  return {.host = kProgram + f.particles * particleBytes(f, scene.output) + f.pixels * pixelBytes(f, scene.output),
          .device = std::max(f.particles * lighting,
                             f.particles * drawing + f.pixels * ((layers ? 40 : 16) + 4.0 * f.solids))};
}

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

/// 0.25 µs a ray on two cores for a million particles (host/lighting/lighting.h); a ray meets the more, the more there
/// are beside each other: N^(1/3) (DESIGN §5).
double raySeconds(double particles) { return 5e-7 * std::cbrt(particles / 1e6) / threadCount(); }

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

Json describeScene(const std::string& path) {
  const Scene scene = readScene(path);
  std::vector<SourceFacts> facts;
  Json sources = Json::array();
  std::uint64_t particles = 0;
  for (const ParticleSource& source : scene.particles) {
    facts.push_back(factsOf(source, scene.frames.first));
    particles += facts.back().count;
    sources.push_back({{source.file.empty() ? "generate" : "file", facts.back().from},
                       {"count", facts.back().count},
                       {"radius", facts.back().radius}});
  }
  const Json lights = lightsJson(scene);
  const auto shadows =
      std::count_if(lights.begin(), lights.end(), [](const Json& l) { return l["casts_shadows"] == true; });
  const double count = static_cast<double>(particles), rays = count * static_cast<double>(shadows);
  const MemoryNeed need = memoryNeed(MemoryFacts(count, facts, scene), scene);
  return {{"file", path},
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
            {"rays", rays},
            {"threads", threadCount()},
            {"lighting_seconds", rays * raySeconds(count)}}}};
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
  row("work", fmt::format("{:.0f} rays a frame, about {:.2g} s with {} threads", estimate["rays"].get<double>(),
                          estimate["lighting_seconds"].get<double>(), estimate["threads"].get<unsigned>()));
}

}  // namespace mote
