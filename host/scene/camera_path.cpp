#include "host/scene/camera_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "host/core/error.h"

namespace mote {
namespace {

// Sine of the least angle between the camera's up and its view direction.
constexpr double kLeastUpSine = 1e-6;

template <class T>
struct Knot {
  double frame;
  T value;
};

/// Slope of the segment that begins at knot i.
template <class T>
T slope(const std::vector<Knot<T>>& knots, std::size_t i) {
  return (knots[i + 1].value - knots[i].value) / (knots[i + 1].frame - knots[i].frame);
}

/// Derivative at an inner knot of the parabola through it and its neighbours.
template <class T>
T innerTangent(const std::vector<Knot<T>>& knots, std::size_t i) {
  const double before = knots[i].frame - knots[i - 1].frame, after = knots[i + 1].frame - knots[i].frame;
  return (after * slope(knots, i - 1) + before * slope(knots, i)) / (before + after);
}

template <class T>
T tangent(const std::vector<Knot<T>>& knots, std::size_t i) {
  const std::size_t last = knots.size() - 1;
  if (last == 1) return slope(knots, 0);
  // A parabola's slope over a segment is the mean of its derivatives at both ends.
  if (i == 0) return 2.0 * slope(knots, 0) - innerTangent(knots, 1);
  if (i == last) return 2.0 * slope(knots, last - 1) - innerTangent(knots, last - 1);
  return innerTangent(knots, i);
}

template <class T>
T curveAt(const std::vector<Knot<T>>& knots, double frame) {
  if (frame <= knots.front().frame) return knots.front().value;
  if (frame >= knots.back().frame) return knots.back().value;
  const auto next = std::upper_bound(knots.begin() + 1, knots.end() - 1, frame,
                                     [](double at, const Knot<T>& knot) { return at < knot.frame; });
  const auto i = static_cast<std::size_t>(next - knots.begin()) - 1;
  const Knot<T>&a = knots[i], &b = knots[i + 1];
  const double length = b.frame - a.frame, s = (frame - a.frame) / length, r = 1 - s;
  // Hermite's basis, so that s = 0 gives a's value to the last bit.
  return r * r * (1 + 2 * s) * a.value + s * s * (3 - 2 * s) * b.value +
         (length * s * r) * (r * tangent(knots, i) - s * tangent(knots, i + 1));
}

/// A property through the keys that name it, in double (Wide: double or dvec3); none where no key does.
template <class Wide, class T>
std::optional<T> keyed(const Camera& camera, std::optional<T> CameraKey::*property, double frame) {
  std::vector<Knot<Wide>> knots;
  for (const CameraKey& key : camera.keys)
    if (key.*property) knots.push_back({static_cast<double>(key.frame), Wide(*(key.*property))});
  if (knots.empty()) return std::nullopt;
  return T(curveAt(knots, frame));
}

void requireRange(double value, double below, const char* what, double frame) {
  if (!(value > 0 && value < below))
    throw InputError(
        "/camera/keys", "", fmt::format("a {} > 0{} at every frame", what, std::isfinite(below) ? " and < 180" : ""),
        fmt::format("{} at frame {}", value, frame), "the curve swings past its keys; a key there holds it");
}

}  // namespace

Camera interpolatedCamera(const Camera& camera, double frame) {
  MOTE_CHECK(std::isfinite(frame), ==, true);
  Camera at = camera;
  at.keys.clear();
  at.position = keyed<dvec3>(camera, &CameraKey::position, frame).value_or(camera.position);
  at.target = keyed<dvec3>(camera, &CameraKey::target, frame).value_or(camera.target);
  at.up = keyed<dvec3>(camera, &CameraKey::up, frame).value_or(camera.up);
  at.fov = keyed<double>(camera, &CameraKey::fov, frame).value_or(camera.fov);
  at.height = keyed<double>(camera, &CameraKey::height, frame).value_or(camera.height);
  const auto focus = keyed<double>(camera, &CameraKey::focusDistance, frame);
  if (focus) at.focusDistance = focus;
  return at;
}

Camera cameraAt(const Camera& camera, double frame) {
  Camera at = interpolatedCamera(camera, frame);
  if (const auto fault = viewFault(at))
    throw InputError("/camera/keys", "", fmt::format("{} at frame {}", fault->expected, frame), fault->got,
                     fault->hint);
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  requireRange(static_cast<double>(at.fov), 180, "fov", frame);
  requireRange(static_cast<double>(at.height), kUnbounded, "height", frame);
  if (at.focusDistance) requireRange(static_cast<double>(*at.focusDistance), kUnbounded, "focus_distance", frame);
  return at;
}

float focusDistanceOf(const Camera& camera) {
  if (camera.focusDistance) return *camera.focusDistance;
  return static_cast<float>(glm::distance(camera.position, camera.target));
}

std::optional<ViewFault> viewFault(const Camera& camera) {
  using Blame = ViewFault::Blame;
  const dvec3 up(camera.up), view = camera.target - camera.position;
  if (up == dvec3(0)) return ViewFault{Blame::Up, "a direction that is not zero", "[0, 0, 0]", ""};
  if (view == dvec3(0))
    return ViewFault{Blame::Target, "a target that is not the camera's position", "both at the same place", ""};
  const double sine = glm::length(glm::cross(glm::normalize(up), glm::normalize(view)));
  if (sine >= kLeastUpSine) return std::nullopt;
  return ViewFault{Blame::UpOrTarget, "an up direction that is not along the view direction",
                   fmt::format("[{}, {}, {}]", camera.up.x, camera.up.y, camera.up.z),
                   fmt::format("the camera looks along [{}, {}, {}]", view.x, view.y, view.z)};
}

}  // namespace mote
