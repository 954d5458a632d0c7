// "import": camera, lights and solids from a glTF file.
#include "host/scene/frame_path.h"
#include "host/scene/gltf/gltf_import.h"
#include "host/scene/scene_parts.h"

namespace mote {
namespace {

/// Returns whether there is a file to read.
bool readFile(ObjectReader& object, std::string_view key, const std::filesystem::path& folder, std::string& file) {
  std::string given;
  if (!object.text(key, given)) return false;
  file = (folder / given).string();
  if (!hasFramePattern(file)) return true;
  object.problem(key, "one file for all frames", quotedForMessage(given), "its camera may move within the file");
  return false;
}

/// true, false, or the name of one.
void readCameraChoice(ObjectReader& object, ImportOptions& options) {
  const JsonNode* node = object.find("camera");
  if (node && node->kind == JsonNode::Kind::String) {
    object.text("camera", options.cameraName);
  } else if (node && node->kind != JsonNode::Kind::Boolean) {
    object.problem("camera", "true, false or the name of a camera", node->shown());
  } else {
    object.boolean("camera", options.camera);
  }
}

}  // namespace

bool readImport(ObjectReader& root, Scene& scene) {
  ImportOptions options;
  options.fps = static_cast<double>(scene.frames.fps);
  const std::filesystem::path folder = folderOf(scene);
  const JsonNode* node = root.find("import");
  ObjectReader object = root.objectIfAny("import", "the import");
  const bool isObject = node && node->kind == JsonNode::Kind::Object;
  bool there = false;
  if (node && node->kind == JsonNode::Kind::String) {
    there = readFile(root, "import", folder, options.file);
  } else if (node && !isObject) {
    root.problem("import", "a glTF file, or an object with one", node->shown());
  }
  if (isObject && !object.has("file")) object.problem("", R"("file", the glTF file)", "none");
  there |= readFile(object, "file", folder, options.file);
  readCameraChoice(object, options);
  object.boolean("lights", options.lights);
  object.boolean("solids", options.solids);
  object.choice<double>("light_units", options.lumensPerWatt, {{"standard", kLumensPerWatt}, {"unitless", 1}});
  float frame = 0;
  object.number("frame", frame, between(-kMaxFrame, kMaxFrame, "frames"));
  options.frame = static_cast<double>(frame);
  object.finish();
  if (!there || object.hasProblems()) return false;

  ImportedShot shot = importGltf(options);
  scene.imported = std::move(shot.files);
  scene.lights = std::move(shot.lights);
  scene.solids = std::move(shot.solids);
  if (shot.camera) scene.camera = std::move(*shot.camera);
  return shot.camera.has_value();
}

}  // namespace mote
