// "camera": projection, place, lens and keys.
#include <fmt/format.h>

#include <algorithm>

#include "host/scene/camera_path.h"
#include "host/scene/frame_path.h"
#include "host/scene/scene_parts.h"

namespace mote {
namespace {

// near · far and far / near, which projections hold, stay finite in single precision.
constexpr Range kNearDepth = between(1e-18, 1e15, "scene units");
constexpr Range kFarDepth{.min = 1e-18, .max = kMaxLength, .minOpen = true, .unit = "scene units"};
constexpr Range kFieldOfView{.min = 0, .max = 180, .minOpen = true, .maxOpen = true, .unit = "degrees"};
constexpr Range kFrame = between(-kMaxFrame, kMaxFrame, "frames");

/// Reads a property that may be absent.
void readOptional(ObjectReader& object, std::string_view key, std::optional<float>& value, const Range& range) {
  float read = 0;
  if (object.number(key, read, range)) value = read;
}
template <class Vector>
void readOptional(ObjectReader& object, std::string_view key, std::optional<Vector>& value,
                  const Range& range) requires(Vector::length() == 3) {
  Vector read(0);
  if (object.vector(key, read, range)) value = read;
}

void checkKeysOfProjection(ObjectReader& object, Projection projection) {
  const bool perspective = projection == Projection::Perspective;
  object.onlyWhere(perspective, "fov", R"("fov" only in a perspective camera)", "an orthographic camera has a height");
  object.onlyWhere(!perspective, "height", R"("height" only in an orthographic camera)",
                   "a perspective camera has a fov");
}

CameraKey readKey(ObjectReader& object, Projection projection) {
  CameraKey key;
  if (!object.has("frame")) object.problem("", R"("frame", the frame that the key is at)", "none");
  object.number("frame", key.frame, kFrame);
  readOptional(object, "position", key.position, kCoordinate);
  readOptional(object, "target", key.target, kCoordinate);
  readOptional(object, "up", key.up, kCoordinate);
  readOptional(object, "fov", key.fov, kFieldOfView);
  readOptional(object, "height", key.height, kLength);
  readOptional(object, "focus_distance", key.focusDistance, kLength);
  constexpr std::string_view kProperties[] = {"position", "target", "up", "fov", "height", "focus_distance"};
  if (std::none_of(std::begin(kProperties), std::end(kProperties), [&](auto name) { return object.has(name); }))
    object.problem("", R"(something beside "frame": position, target, up, fov, height or focus_distance)", "nothing");
  checkKeysOfProjection(object, projection);
  object.finish();
  return key;
}

/// Returns whether the frames ascend strictly.
bool readKeys(std::vector<ObjectReader>& objects, Camera& camera) {
  bool ascending = true;
  for (ObjectReader& object : objects) {
    const CameraKey key = readKey(object, camera.projection);
    if (!camera.keys.empty() && key.frame <= camera.keys.back().frame) {
      object.problem("frame", fmt::format("a frame after that of the key before, {}", camera.keys.back().frame),
                     fmt::format("{}", key.frame));
      ascending = false;
    }
    camera.keys.push_back(key);
  }
  return ascending;
}

/// True if the camera or any of its keys says where it stands or what it looks at.
bool isPlaced(const ObjectReader& object, const Camera& camera) {
  return object.has("position") || object.has("target") ||
         std::any_of(camera.keys.begin(), camera.keys.end(),
                     [](const CameraKey& key) { return key.position || key.target; });
}

/// Notes why `camera` has no view at the key of `object` that is to blame. Of a fitted one only a zero up counts:
/// fitDefaults() chooses a view direction that is not along up.
void checkView(ObjectReader& object, const Camera& camera) {
  const auto fault = viewFault(camera);
  if (!fault || (camera.fitted && fault->blame != ViewFault::Blame::Up)) return;
  const bool up =
      fault->blame == ViewFault::Blame::Up || (fault->blame == ViewFault::Blame::UpOrTarget && object.has("up"));
  object.problem(up ? "up" : object.has("target") ? "target" : "position", fault->expected, fault->got, fault->hint);
}

/// Where keys move the view, it is checked at each of them, else as the camera itself has it.
void checkViews(ObjectReader& object, std::vector<ObjectReader>& keyObjects, const Camera& camera) {
  const bool moves = std::any_of(camera.keys.begin(), camera.keys.end(),
                                 [](const CameraKey& key) { return key.position || key.target || key.up; });
  if (!moves) return checkView(object, camera);
  for (std::size_t i = 0; i < keyObjects.size(); ++i)
    checkView(keyObjects[i], interpolatedCamera(camera, static_cast<double>(camera.keys[i].frame)));
}

/// Takes from an import's motion what the scene itself says.
void dropOverridden(const ObjectReader& object, Camera& camera) {
  if (object.has("keys")) camera.keys.clear();
  for (CameraKey& key : camera.keys) {
    if (object.has("position")) key.position.reset();
    if (object.has("target")) key.target.reset();
    if (object.has("up")) key.up.reset();
  }
  std::erase_if(camera.keys, [](const CameraKey& key) { return !key.position && !key.target && !key.up; });
}

/// An import's keys all name the same properties, so each with the camera's own is the view at its frame.
void checkImportedViews(ObjectReader& object, Camera& camera) {
  for (const CameraKey& key : camera.keys) {
    Camera at = camera;
    at.keys.clear();
    at.position = key.position.value_or(camera.position);
    at.target = key.target.value_or(camera.target);
    at.up = key.up.value_or(camera.up);
    checkView(object, at);
  }
}

void readLens(ObjectReader& object, Camera& camera) {
  // Both within a fortnight, so that a frame number may be taken from them.
  if (object.vector("shutter", camera.shutter, between(-1e6, 1e6, "s")) && camera.shutter.x > camera.shutter.y)
    object.problem("shutter", "a time of opening <= that of closing",
                   fmt::format("[{}, {}]", camera.shutter.x, camera.shutter.y));
  object.number("aperture_radius", camera.apertureRadius, between(0, kMaxLength, "scene units"));
  readOptional(object, "focus_distance", camera.focusDistance, kLength);
}

}  // namespace

void readCamera(ObjectReader& root, Camera& camera, bool imported) {
  ObjectReader object = root.object("camera", "the camera");
  object.choice<Projection>("type", camera.projection,
                            {{"perspective", Projection::Perspective}, {"orthographic", Projection::Orthographic}});
  if (imported) dropOverridden(object, camera);
  const std::size_t importedKeys = camera.keys.size();
  object.vector("position", camera.position, kCoordinate);
  object.vector("target", camera.target, kCoordinate);
  object.vector("up", camera.up, kCoordinate);
  object.number("fov", camera.fov, kFieldOfView);
  object.number("height", camera.height, kLength);
  object.number("near", camera.near, kNearDepth);
  object.number("far", camera.far, kFarDepth);
  checkKeysOfProjection(object, camera.projection);
  readLens(object, camera);
  std::vector<ObjectReader> keys = object.list("keys", "a camera key");
  const bool ascending = readKeys(keys, camera);

  camera.fitted = !imported && !isPlaced(object, camera);
  camera.fittedDepths = camera.fitted && !object.has("near") && !object.has("far");
  camera.fittedHeight = camera.fitted && camera.projection == Projection::Orthographic && !object.has("height");
  if (importedKeys > 0)
    checkImportedViews(object, camera);
  else if (ascending)
    checkViews(object, keys, camera);
  if (!camera.fittedDepths && camera.near >= camera.far)
    object.problem(object.has("far") ? "far" : "near", "near < far",
                   fmt::format("near {} and far {}", camera.near, camera.far));
  object.finish();
}

}  // namespace mote
