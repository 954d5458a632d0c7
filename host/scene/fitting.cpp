#include "host/scene/fitting.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/core/error.h"
#include "host/scene/camera_path.h"

namespace mote {
namespace {

// The camera stands 15° above the middle: high enough to show depth, low enough that smoke still rises.
constexpr double kElevation = 15 * kPi / 180;
constexpr double kFilled = 0.9;         // share of the picture's width or height that the box takes
constexpr double kLeastDistance = 1.5;  // of the camera, in radii of the box: it never stands inside
constexpr double kLeastHeight = 0.1;    // of an orthographic picture, in radii: a line seen from its end has no height
constexpr double kLightDistance = 3;    // in radii: far enough that one side is not lit much more than the other

struct Box {
  dvec3 centre;
  double radius;  // half the diagonal, > 0
  std::array<dvec3, 8> corners;
};

Box boxOf(const Bounds& bounds) {
  const dvec3 lo(bounds.lo), hi(bounds.hi);
  Box box{0.5 * (lo + hi), 0.5 * glm::length(hi - lo), {}};
  // A single point far from the origin: closer than this, camera and target would round to the same place.
  const double farthest = std::max({std::abs(box.centre.x), std::abs(box.centre.y), std::abs(box.centre.z)});
  box.radius = std::max(box.radius, 1e-5 * farthest);
  if (box.radius == 0) box.radius = 1;
  for (std::size_t i = 0; i < 8; ++i) box.corners[i] = {i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z};
  return box;
}

/// Any direction at right angles to `up`: toward the viewer where y or z is up, as is usual.
dvec3 front(const dvec3& up) {
  const dvec3 usual = std::abs(up.z) < 0.7 ? dvec3(0, 0, 1) : dvec3(0, -1, 0);
  return glm::normalize(usual - glm::dot(usual, up) * up);
}

/// Width / height of the picture as it is seen.
double aspectOf(const Output& output) {
  return static_cast<double>(output.pixelAspect) * output.size.x / output.size.y;
}

/// The direction from the box to the camera, and what is right and up in the picture.
struct Axes {
  dvec3 toCamera, right, up;
};

Axes axesOf(const Camera& camera) {
  const dvec3 worldUp = glm::normalize(dvec3(camera.up));
  const dvec3 toCamera = std::cos(kElevation) * front(worldUp) + std::sin(kElevation) * worldUp;
  const dvec3 right = glm::normalize(glm::cross(worldUp, toCamera));
  return {toCamera, right, glm::cross(toCamera, right)};
}

/// From the box's centre, so that all of it is in a perspective picture.
double distanceOf(const Axes& axes, const Box& box, float fov, double aspect) {
  const double tanY = std::tan(0.5 * static_cast<double>(fov) * kPi / 180), tanX = tanY * aspect;
  // A corner at (x, y, z) from the centre is seen at depth d − z; it is inside where |x| ≤ tan · (d − z).
  double distance = kLeastDistance * box.radius;
  for (const dvec3& corner : box.corners) {
    const dvec3 offset = corner - box.centre;
    const double z = glm::dot(offset, axes.toCamera);
    distance = std::max({distance, z + std::abs(glm::dot(offset, axes.right)) / (kFilled * tanX),
                         z + std::abs(glm::dot(offset, axes.up)) / (kFilled * tanY)});
  }
  return distance;
}

/// Of an orthographic picture, so that all of the box is in it.
double heightOf(const Axes& axes, const Box& box, double aspect) {
  double half = 0.5 * kLeastHeight * box.radius;
  for (const dvec3& corner : box.corners) {
    const dvec3 offset = corner - box.centre;
    half = std::max({half, std::abs(glm::dot(offset, axes.right)) / aspect, std::abs(glm::dot(offset, axes.up))});
  }
  return 2 * half / kFilled;
}

void fitCamera(Camera& camera, double aspect, const Box& box) {
  const Axes axes = axesOf(camera);
  const bool perspective = camera.projection == Projection::Perspective;
  const double distance = perspective ? distanceOf(axes, box, camera.fov, aspect) : 2 * kLeastDistance * box.radius;
  // Floats, as they are drawn with.
  camera.target = vec3(box.centre);
  camera.position = vec3(box.centre + distance * axes.toCamera);
  if (camera.fittedHeight) camera.height = static_cast<float>(heightOf(axes, box, aspect));
  if (!camera.fittedDepths) return;
  // The nearest corner is at distance/3 or more: generous to both sides, and a depth range that floats resolve.
  camera.near = static_cast<float>(0.01 * distance);
  camera.far = static_cast<float>(distance + 10 * box.radius);
}

LightSource keyLight(const Camera& camera, const Box& box) {
  const dvec3 up = glm::normalize(dvec3(camera.up));
  const dvec3 view = glm::normalize(camera.target - camera.position);
  const dvec3 right = glm::normalize(glm::cross(view, up)), ahead = glm::cross(up, right);
  const double distance = kLightDistance * box.radius;
  LightSource light;
  light.name = "key";
  light.type = LightType::Point;
  // Three-quarter back light: edges glow, and the shadows fall toward the viewer.
  light.position = vec3(box.centre + distance * glm::normalize(-0.7 * right + 0.7 * up + 0.8 * ahead));
  const double d = glm::distance(light.position, box.centre);
  light.strength = static_cast<float>(4 * kPi * d * d);
  return light;
}

}  // namespace

void fitDefaults(Scene& scene, const Bounds& supportBounds) {
  MOTE_CHECK(supportBounds.empty(), ==, false);
  const Box box = boxOf(supportBounds);
  MOTE_CHECK(std::isfinite(box.radius), ==, true);
  Camera& camera = scene.camera;
  if (camera.fitted) fitCamera(camera, aspectOf(scene.output), box);
  const double firstFrame = camera.keys.empty() ? 0 : static_cast<double>(camera.keys.front().frame);
  if (scene.defaultLights) scene.lights = {keyLight(cameraAt(camera, firstFrame), box)};
  camera.fitted = camera.fittedDepths = camera.fittedHeight = scene.defaultLights = false;
}

}  // namespace mote
