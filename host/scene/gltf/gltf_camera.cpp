// A camera of a glTF, and its motion as keys.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/scene/frame_path.h"
#include "host/scene/gltf/gltf_parts.h"
#include "host/scene/scene_parts.h"

namespace mote {
namespace {

// Exporters write a frame's seconds in single precision: at an hour they are off by 0.005 frames. Nearer than this to
// a whole frame, or to a key, it is meant.
constexpr double kSnap = 0.01;
// More than an hour; and no more work than that of a rig of twenty.
constexpr double kMostFrames = 100'000, kMostPoses = 2'000'000;

constexpr Range kYfov{.min = 0, .max = kPi, .minOpen = true, .maxOpen = true, .unit = "radians"};

void readDepths(const GltfValue& lens, Camera& camera) {
  const double near = lens.member("znear").number(between(0, kMaxLength));
  const double far = lens.member("zfar").number(kMaxLength, above(near));  // without it, it sees for ever
  camera.near = static_cast<float>(std::clamp(near, 1e-18, 1e15));
  camera.far = static_cast<float>(std::min(far, kMaxLength));
  if (camera.near >= camera.far) lens.refuse("znear < zfar in single precision", fmt::format("{} and {}", near, far));
}

Camera lensOf(const GltfValue& value) {
  Camera camera;
  const std::string type = value.member("type").text();
  if (type == "orthographic") {
    const GltfValue lens = value.member(type);
    camera.projection = Projection::Orthographic;
    const double half = lens.member("ymag").number(between(-0.5 * kMaxLength, 0.5 * kMaxLength));
    camera.height = static_cast<float>(2 * std::abs(half));
    if (!(camera.height > 0)) lens.member("ymag").refuse("a ymag that is not zero", "0");
    readDepths(lens, camera);
  } else if (type == "perspective") {
    const GltfValue lens = value.member(type);
    camera.fov = static_cast<float>(glm::degrees(lens.member("yfov").number(kYfov)));
    if (!(camera.fov > 0 && camera.fov < 180))
      lens.member("yfov").refuse("an angle between 0 and π", "0 or π, rounded");
    readDepths(lens, camera);
  } else {
    value.member("type").refuse("perspective or orthographic", quotedForMessage(type));
  }
  return camera;
}

/// Far targets keep the direction exact in single precision: as far as the origin, which is where a shot's things are.
CameraKey keyOf(const GltfFrame& frame, double at) {
  const double ahead = std::max(1.0, glm::length(frame.position));
  return {.frame = static_cast<float>(at),
          .position = vec3(frame.position),
          .target = vec3(frame.position + ahead * frame.forward),
          .up = vec3(frame.up)};
}

double snapped(double frame) { return std::abs(frame - std::round(frame)) <= kSnap ? std::round(frame) : frame; }

void readMotion(const GltfShot& gltf, std::size_t node, Camera& camera) {
  const double fps = gltf.options.fps, zero = gltf.options.frame, snap = kSnap / fps;
  gltf.animations.load(node);
  const dvec2 span = gltf.animations.span();
  const double first = snapped(zero + span.x * fps), last = snapped(zero + span.y * fps), count = last - first;
  const auto places = static_cast<double>(gltf.animations.loadedNodes());
  if (!(std::abs(first) <= kMaxFrame && std::abs(last) <= kMaxFrame && count < kMostFrames &&
        count * places < kMostPoses))
    gltf.value(node).refuse(fmt::format("a motion of at most {} frames within ±{}", kMostFrames, kMaxFrame),
                            fmt::format("frames {} to {} of {} nodes", first, last, places),
                            "times in a glTF are seconds");
  const auto add = [&](double frame) {
    if (!camera.keys.empty() && static_cast<float>(frame) <= camera.keys.back().frame) return;  // the same, rounded
    const double seconds = (frame - zero) / fps;
    camera.keys.push_back(
        keyOf(frameOf(gltf.animations.worldAt(node, seconds, snap), gltf.value(node), fmt::format(" at {} s", seconds)),
              frame));
  };
  add(first);
  for (double frame = std::floor(first) + 1; frame < last; ++frame) add(frame);
  if (last > first) add(last);
}

/// The nodes of the scene with a camera, in its order.
std::vector<std::size_t> cameraNodes(const GltfShot& gltf) {
  std::vector<std::size_t> found;
  for (const std::size_t i : gltf.nodes.inScene)
    if (gltf.value(i).member("camera")) found.push_back(i);
  return found;
}

std::string nameList(const GltfShot& gltf, const std::vector<std::size_t>& found) {
  constexpr std::size_t kShown = 8;
  std::string text;
  for (std::size_t k = 0; k < std::min(found.size(), kShown); ++k)
    text += fmt::format("{}{}", k > 0 ? ", " : "", quotedForMessage(userName(gltf.nodes.all[found[k]])));
  return found.size() > kShown ? text + ", ..." : text;
}

}  // namespace

void importCamera(const GltfShot& gltf, ImportedShot& shot) {
  const GltfValue cameras = gltf.file.list("cameras");
  const std::vector<std::size_t> found = cameraNodes(gltf);
  const std::string& wanted = gltf.options.cameraName;
  const auto cameraOf = [&](std::size_t node) {
    return cameras.item(gltf.value(node).member("camera").index(cameras.size(), "cameras"));
  };
  const auto chosen = std::find_if(found.begin(), found.end(), [&](std::size_t node) {
    const GltfNode& each = gltf.nodes.all[node];
    return wanted.empty() || each.name == wanted || userName(each) == wanted ||
           cameraOf(node).member("name").text() == wanted;
  });
  if (chosen == found.end()) {
    if (wanted.empty()) return;
    throw InputError(gltf.file.path(), "", fmt::format("a camera {} in its scene", quotedForMessage(wanted)),
                     found.empty() ? "none" : nameList(gltf, found));
  }
  if (wanted.empty() && found.size() > 1)
    logWarning(fmt::format(R"({}: of its {} cameras ({}) the first is taken; "camera" of "import" names another)",
                           gltf.file.path(), found.size(), nameList(gltf, found)));
  Camera camera = lensOf(cameraOf(*chosen));
  if (gltf.animations.moves(*chosen)) readMotion(gltf, *chosen, camera);
  const CameraKey rest = camera.keys.empty() ? keyOf(frameOf(gltf.nodes.all[*chosen].world, gltf.value(*chosen), ""), 0)
                                             : camera.keys.front();
  camera.position = *rest.position, camera.target = *rest.target, camera.up = *rest.up;
  shot.camera = std::move(camera);
}

}  // namespace mote
