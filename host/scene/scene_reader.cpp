#include "host/scene/scene_reader.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "host/core/error.h"
#include "host/scene/scene_parts.h"
#include "host/scene/scene_settings.h"

namespace mote {
namespace {

// A scene is written by people; what is larger is another kind of file.
constexpr std::size_t kMaxSceneBytes = std::size_t{64} << 20;

void readFormatVersion(ObjectReader& root) {
  int version = 1;
  if (root.integer("mote", version, 0, 1'000'000) && version != 1)
    root.problem("mote", "1, the version of the scene format", std::to_string(version),
                 fmt::format("this is Mote {}", MOTE_VERSION));
}

void readOrigin(ObjectReader& root, std::optional<dvec3>& origin) {
  const JsonNode* node = root.find("origin");
  if (!node || (node->kind == JsonNode::Kind::String && node->text == "auto")) return;
  dvec3 point(0);
  if (node->kind != JsonNode::Kind::Array) {
    root.problem("origin", R"([x, y, z] or "auto")", node->shown());
  } else if (root.vector("origin", point, kCoordinate)) {
    origin = point;
  }
}

Scene readWhole(ObjectReader& root, const std::string& path) {
  Scene scene;
  scene.path = path;
  const std::filesystem::path folder = folderOf(scene);
  readFormatVersion(root);
  readFrames(root, scene);
  const bool camera = readImport(root, scene);
  readParticles(root, scene);
  readMedium(root, scene.medium);
  readLights(root, scene);
  readLighting(root, scene.lighting);
  readSolids(root, scene);
  readCamera(root, scene.camera, camera);
  readView(root, folder, scene.view);
  readOutput(root, folder, scene.output);
  readOrigin(root, scene.origin);
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
  JsonReading reading(document);
  ObjectReader root(reading, "the scene");
  Scene scene = readWhole(root, path);
  reading.throwFirst();
  scene.settings = sceneSettings(document.root());
  return scene;
}

std::map<std::string, std::vector<std::string>> knownSceneKeys() {
  // Absent objects are asked for their keys too; only the elements of arrays must be there.
  const JsonDocument document("", R"({"particles": [{}], "lights": [{}], "solids": [{}], "camera": {"keys": [{}]}})");
  JsonReading reading(document);
  ObjectReader root(reading, "the scene");
  readWhole(root, "");
  return reading.keysAskedFor();
}

}  // namespace mote
