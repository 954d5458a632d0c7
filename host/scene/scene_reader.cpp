#include "host/scene/scene_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "host/core/error.h"
#include "host/scene/frame_path.h"
#include "host/scene/json_reader.h"

namespace mote {
namespace {

// Lengths and coordinates stop here, so that squared distances stay finite in single precision.
constexpr double kMaxLength = 1e18;
constexpr Range kCoordinate = between(-kMaxLength, kMaxLength, "scene units");
constexpr Range kLength{.min = 0, .max = kMaxLength, .minOpen = true, .unit = "scene units"};
// near · far and far / near, which projections hold, stay finite in single precision.
constexpr Range kNearDepth = between(1e-18, 1e15, "scene units");
constexpr Range kFarDepth{.min = 1e-18, .max = kMaxLength, .minOpen = true, .unit = "scene units"};
constexpr Range kShare = between(0, 1);
// A scene is written by people; what is larger is another kind of file.
constexpr std::size_t kMaxSceneBytes = std::size_t{64} << 20;
// "Transmittance_" + name must fit the 31 characters of a PRT channel name.
constexpr std::size_t kMaxLightName = 17;
// Sine of the least angle between the camera's up and its view direction: below, the picture's upright is rounding
// noise.
constexpr double kLeastUpSine = 1e-6;

/// Keys that ../shared/SCENE.md has and this version does not read.
constexpr LaterWord kLaterKeys[] = {
    {"", "solids"},
    {"/particles/*/channels", "Emission"},
    {"/particles/*/channels", "Absorption"},
    {"/medium", "extinction"},
    {"/medium", "emission_scale"},
    {"/medium/phase", "g"},
    {"/lights/*", "target"},
    {"/lights/*", "inner_angle"},
    {"/lights/*", "outer_angle"},
    {"/lighting", "radius_scale"},
    {"/lighting", "subsample"},
    {"/lighting", "subsample_seed"},
    {"/lighting", "compensate"},
    {"/lighting", "error"},
    {"/lighting", "solid_shadow_intensity"},
    {"/camera", "height"},
    {"/camera", "shutter"},
    {"/camera", "aperture_radius"},
    {"/camera", "focus_distance"},
    {"/view", "radius_scale"},
    {"/view", "sprite_color"},
    {"/view", "sprite_opacity"},
};

/// A path of the file at `key`, as it is to be opened. A relative one is relative to the scene's folder.
bool readPath(ObjectReader& object, std::string_view key, std::string& path, const std::filesystem::path& folder) {
  std::string given;
  if (!object.text(key, given)) return false;
  path = (folder / given).string();  // an absolute path replaces the folder
  try {
    framePath(path, 1);
  } catch (const InputError&) {
    object.problem(key, "at most one run of # for the frame number", quotedForMessage(given), "as in plume.####.prt");
  }
  return true;
}

void readFormatVersion(ObjectReader& root) {
  int version = 1;
  if (root.integer("mote", version, 0, 1'000'000) && version != 1)
    root.problem("mote", "1, the version of the scene format", std::to_string(version),
                 fmt::format("this is Mote {}", MOTE_VERSION));
}

void readRadius(ObjectReader& source, RadiusRule& rule) {
  const JsonNode* node = source.find("radius");
  ObjectReader byChannel = source.objectIfAny("radius", "a radius rule");
  byChannel.text("channel", rule.channel);
  byChannel.number("scale", rule.scale, above(0));
  byChannel.finish();
  if (!node) return;
  if (node->kind == JsonNode::Kind::Object) {
    rule.kind = RadiusRule::Kind::Channel;
  } else if (node->kind == JsonNode::Kind::Number) {
    rule.kind = RadiusRule::Kind::Number;
    source.number("radius", rule.value, kLength);
  } else if (node->kind != JsonNode::Kind::String || node->text != "auto") {
    source.problem("radius", R"(a number > 0, {"channel":…, "scale":…} or "auto")", node->shown());
  }
}

void readChannels(ObjectReader& source, std::map<std::string, std::string>& channels) {
  ObjectReader object = source.object("channels", "the channel names");
  for (const char* ours : {"Position", "Radius", "Density", "Color", "Velocity", "ID"}) {
    std::string theirs;
    if (object.text(ours, theirs)) channels[ours] = theirs;
  }
  object.finish();
}

ParticleSource readParticleSource(ObjectReader& object, const std::filesystem::path& folder) {
  ParticleSource source;
  source.pointer = object.pointer();
  const bool fromFile = object.has("file"), generated = object.has("generate");
  readPath(object, "file", source.file, folder);
  object.choice<Generator>("generate", source.generate,
                           {{"ball", Generator::Ball}, {"cloud", Generator::Cloud}, {"plume", Generator::Plume}});
  object.integer<std::uint64_t>("count", source.count, 1, 4'000'000'000, "particles");
  object.integer<std::uint64_t>("seed", source.seed, 0, std::numeric_limits<std::uint64_t>::max());
  readRadius(object, source.radius);
  readChannels(object, source.channels);
  object.number("density", source.density, atLeast(0));
  object.vector("color", source.color, kShare);
  object.vector("translate", source.translate, kCoordinate);
  object.vector("rotate", source.rotate, {.unit = "degrees"});
  object.number("scale", source.scale, above(0));

  if (fromFile && generated) {
    object.problem("generate", R"(either "file" or "generate")", "both");
  } else if (!fromFile && !generated) {
    object.problem("", R"("file" or "generate")", "neither");
  } else if (generated && !object.has("count")) {
    object.problem("", R"("count" beside "generate")", "none");
  }
  object.onlyWhere(!fromFile || generated, "count", R"("count" only beside "generate")");
  object.onlyWhere(!fromFile || generated, "seed", R"("seed" only beside "generate")");
  object.onlyWhere(!generated || fromFile, "channels", R"("channels" only beside "file")");
  object.finish();
  return source;
}

void readParticles(ObjectReader& root, Scene& scene) {
  const std::filesystem::path folder = std::filesystem::path(scene.path).parent_path();
  std::vector<ObjectReader> sources = root.list("particles", "a particle source");
  for (ObjectReader& source : sources) scene.particles.push_back(readParticleSource(source, folder));
  constexpr std::string_view kExpected = R"("particles" with at least one source)";
  if (!root.has("particles")) {
    root.problem("", kExpected, "none", R"(for example "particles": [{"file": "x.prt"}])");
  } else if (sources.empty()) {
    root.problem("particles", kExpected, "none");
  }
}

void readPhase(ObjectReader& medium) {
  ObjectReader phase = medium.object("phase", "the phase function");
  bool isotropic = true;
  phase.choice<bool>("type", isotropic, {{"isotropic", true}}, {"henyey_greenstein", "rayleigh"});
  phase.finish();
}

void readMedium(ObjectReader root, Medium& medium) {
  ObjectReader object = root.object("medium", "the medium");
  object.choice<DensityMode>("density_mode", medium.densityMode,
                             {{"cross_section", DensityMode::CrossSection}, {"peak", DensityMode::Peak}});
  object.number("density_scale", medium.densityScale, atLeast(0));
  float opticalDepth = 4;
  const bool calibrated = object.number("optical_depth", opticalDepth, above(0));
  if (calibrated || !object.has("density_scale")) medium.opticalDepth = opticalDepth;
  object.choice<Falloff>("falloff", medium.falloff,
                         {{"smooth", Falloff::Smooth}, {"linear", Falloff::Linear}, {"sphere", Falloff::Sphere}});
  object.vector("albedo", medium.albedo, kShare);
  readPhase(object);
  if (object.has("density_scale") && object.has("optical_depth"))
    object.problem("optical_depth", R"(either "density_scale" or "optical_depth")", "both",
                   "optical_depth chooses the scale itself");
  object.finish();
}

bool isIdentifier(std::string_view name) {
  const auto letter = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_'; };
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  return !name.empty() && letter(name.front()) &&
         std::all_of(name.begin(), name.end(), [&](char c) { return letter(c) || digit(c); });
}

void readLightName(ObjectReader& object, std::string& name) {
  if (!object.text("name", name)) return;
  if (!isIdentifier(name) || name.size() > kMaxLightName)
    object.problem(
        "name", fmt::format("a name of 1 to {} letters, digits and _ that does not begin with a digit", kMaxLightName),
        quotedForMessage(name), "it becomes the channel Transmittance_<name>");
}

void readDirection(ObjectReader& object, vec3& direction) {
  if (!object.vector("direction", direction, kCoordinate)) return;
  const dvec3 given(direction);
  const double length = std::sqrt(given.x * given.x + given.y * given.y + given.z * given.z);
  if (length > 0) {
    direction = vec3(given / length);
  } else {
    object.problem("direction", "a direction that is not zero", "[0, 0, 0]");
  }
}

LightSource readLight(ObjectReader& object, std::size_t index) {
  LightSource light;
  light.name = fmt::format("light{}", index);
  readLightName(object, light.name);
  object.choice<LightType>("type", light.type, {{"point", LightType::Point}, {"directional", LightType::Directional}},
                           {"spot"});
  object.vector("position", light.position, kCoordinate);
  readDirection(object, light.direction);
  object.vector("color", light.color, atLeast(0));
  object.number("intensity", light.strength, atLeast(0, "W/sr"));
  object.number("irradiance", light.strength, atLeast(0, "W/m²"));
  object.number("decay", light.decay, between(0, 2));
  object.number("shadow_density", light.shadowDensity, atLeast(0));
  object.boolean("casts_shadows", light.castsShadows);

  const bool point = light.type == LightType::Point;
  object.onlyWhere(point, "position", R"("position" only in point lights)", "a directional light has a direction");
  object.onlyWhere(point, "intensity", R"("intensity" only in point lights)", "a directional light has an irradiance");
  object.onlyWhere(point, "decay", R"("decay" only in point lights)");
  object.onlyWhere(!point, "direction", R"("direction" only in directional lights)", "a point light has a position");
  object.onlyWhere(!point, "irradiance", R"("irradiance" only in directional lights)",
                   "a point light has an intensity");
  object.finish();
  return light;
}

void readLights(ObjectReader& root, Scene& scene) {
  scene.defaultLights = !root.has("lights");
  std::vector<ObjectReader> objects = root.list("lights", "a light");
  for (std::size_t i = 0; i < objects.size(); ++i) {
    LightSource light = readLight(objects[i], i);
    const auto earlier = std::find_if(scene.lights.begin(), scene.lights.end(),
                                      [&](const LightSource& other) { return other.name == light.name; });
    if (earlier != scene.lights.end())
      objects[i].problem("name", "a name that no other light has", quotedForMessage(light.name),
                         fmt::format("/lights/{} has it", earlier - scene.lights.begin()));
    scene.lights.push_back(std::move(light));
  }
}

void readBackend(ObjectReader& object, Backend& backend) {
  object.choice<Backend>("backend", backend, {{"cpu", Backend::Cpu}, {"gpu", Backend::Gpu}, {"auto", Backend::Auto}});
}

void readLighting(ObjectReader& root, LightingSettings& lighting) {
  ObjectReader object = root.object("lighting", "the lighting settings");
  readBackend(object, lighting.backend);
  object.number("cutoff", lighting.cutoff, {.min = 0, .max = 1, .maxOpen = true});
  object.choice<Endpoint>("endpoint", lighting.endpoint, {{"soft", Endpoint::Soft}, {"clamp", Endpoint::Clamp}});
  const JsonNode* cell = object.find("particles_per_cell");
  if (cell && cell->kind == JsonNode::Kind::Number) {
    object.integer<std::uint32_t>("particles_per_cell", lighting.particlesPerCell, 1, 1'000'000);
  } else if (cell && (cell->kind != JsonNode::Kind::String || cell->text != "auto")) {
    object.problem("particles_per_cell", R"(a whole number from 1 to 1000000 or "auto")", cell->shown());
  }
  object.finish();
}

void checkCameraAxes(ObjectReader& object, const Camera& camera) {
  const dvec3 up(camera.up);
  if (up == dvec3(0)) return object.problem("up", "a direction that is not zero", "[0, 0, 0]");
  if (camera.fitted) return;  // fitDefaults() chooses a view direction that is not along up
  const dvec3 view = dvec3(camera.target) - dvec3(camera.position);
  const std::string_view blame = object.has("target") ? "target" : "position";
  if (view == dvec3(0))
    return object.problem(blame, "a target that is not the camera's position", "both at the same place");
  const double sine = glm::length(glm::cross(glm::normalize(up), glm::normalize(view)));
  if (sine < kLeastUpSine)
    object.problem(object.has("up") ? "up" : blame, "an up direction that is not along the view direction",
                   fmt::format("[{}, {}, {}]", camera.up.x, camera.up.y, camera.up.z),
                   fmt::format("the camera looks along [{}, {}, {}]", view.x, view.y, view.z));
}

void readCamera(ObjectReader& root, Camera& camera) {
  ObjectReader object = root.object("camera", "the camera");
  bool perspective = true;
  object.choice<bool>("type", perspective, {{"perspective", true}}, {"orthographic"});
  object.vector("position", camera.position, kCoordinate);
  object.vector("target", camera.target, kCoordinate);
  object.vector("up", camera.up, kCoordinate);
  object.number("fov", camera.fov, {.min = 0, .max = 180, .minOpen = true, .maxOpen = true, .unit = "degrees"});
  object.number("near", camera.near, kNearDepth);
  object.number("far", camera.far, kFarDepth);
  camera.fitted = !object.has("position") && !object.has("target");
  camera.fittedDepths = camera.fitted && !object.has("near") && !object.has("far");
  checkCameraAxes(object, camera);
  if (!camera.fittedDepths && camera.near >= camera.far)
    object.problem(object.has("far") ? "far" : "near", "near < far",
                   fmt::format("near {} and far {}", camera.near, camera.far));
  object.finish();
}

void readView(ObjectReader& root, View& view) {
  ObjectReader object = root.object("view", "the view settings");
  readBackend(object, view.backend);
  object.finish();
}

void readOutput(ObjectReader& root, const std::string& scenePath, Output& output) {
  const std::filesystem::path folder = std::filesystem::path(scenePath).parent_path();
  output.file = (folder / output.file).string();
  ObjectReader object = root.object("output", "the output");
  readPath(object, "file", output.file, folder);
  object.pair("size", output.size, 1, 16384, "pixels");
  object.choice<Precision>("precision", output.precision, {{"half", Precision::Half}, {"float", Precision::Float}});
  object.choice<Compression>("compression", output.compression,
                             {{"none", Compression::None},
                              {"rle", Compression::Rle},
                              {"zips", Compression::Zips},
                              {"zip", Compression::Zip},
                              {"piz", Compression::Piz}});
  constexpr std::string_view kLayers[] = {"Z"};
  std::vector<bool> layers(1);
  object.words("aovs", layers, kLayers, {"shadow", "lights", "velocity", "optical_depth"});
  output.depth = layers[0];
  object.finish();
}

void readFrames(ObjectReader& root, Frames& frames) {
  ObjectReader object = root.object("frames", "the frame range");
  object.integer("first", frames.first, -kMaxFrame, kMaxFrame);
  frames.last = frames.first;
  object.integer("last", frames.last, -kMaxFrame, kMaxFrame);
  object.integer("step", frames.step, 1, kMaxFrame);
  object.number("fps", frames.fps, above(0, "frames per second"));
  if (frames.last < frames.first)
    object.problem("last", fmt::format("a last frame >= the first, {}", frames.first), std::to_string(frames.last));
  object.finish();
}

Scene readWhole(ObjectReader& root, const std::string& path) {
  Scene scene;
  scene.path = path;
  readFormatVersion(root);
  readParticles(root, scene);
  readMedium(root, scene.medium);
  readLights(root, scene);
  readLighting(root, scene.lighting);
  readCamera(root, scene.camera);
  readView(root, scene.view);
  readOutput(root, path, scene.output);
  readFrames(root, scene.frames);
  root.finish();
  return scene;
}

/// What tells other kinds of files from a scene, with a sentence for each.
void refuseOtherFiles(std::string_view text, const std::string& path) {
  if (text.starts_with("\xc0PRT"))
    throw InputError(path, "", "a scene", "a particle file",
                     fmt::format(R"(write a scene that names it: {{"particles":[{{"file":"{}"}}]}})", path));
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
    throw InputError(path, "", "UTF-8 text", "UTF-16 text", "save it as UTF-8");
}

std::string readText(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) throw InputError(fmt::format("{}: cannot read the scene: {}", path, std::strerror(errno)));
  std::string text;
  char block[1 << 16];
  for (std::size_t size; (size = std::fread(block, 1, sizeof block, file.get())) > 0;) {
    text.append(block, size);
    refuseOtherFiles(text, path);
    if (text.size() > kMaxSceneBytes)
      throw InputError(path, "", fmt::format("a scene of at most {} bytes", kMaxSceneBytes), "more");
  }
  if (std::ferror(file.get()))
    throw InputError(fmt::format("{}: cannot read the scene: {}", path, std::strerror(errno)));
  return text;
}

}  // namespace

Scene readScene(const std::string& path, std::span<const std::string> overrides) {
  return parseScene(readText(path), path, overrides);
}

Scene parseScene(std::string_view text, const std::string& path, std::span<const std::string> overrides) {
  refuseOtherFiles(text, path);
  JsonDocument document(path, text);
  for (const std::string& override : overrides) document.set(override);
  JsonReading reading(document, kLaterKeys);
  ObjectReader root(reading, "the scene");
  Scene scene = readWhole(root, path);
  reading.throwFirst();
  return scene;
}

std::map<std::string, std::vector<std::string>> knownSceneKeys() {
  // Absent objects are asked for their keys too; only the elements of arrays must be there.
  const JsonDocument document("", R"({"particles": [{}], "lights": [{}]})");
  JsonReading reading(document, kLaterKeys);
  ObjectReader root(reading, "the scene");
  readWhole(root, "");
  return reading.keysAskedFor();
}

}  // namespace mote
