#include "host/scene/origin.h"

#include <cmath>

namespace mote {
namespace {

// An axis is left as it is where moving it wins less than three bits.
constexpr double kFar = 8;
// Of a point's distance, where there is no extent to go by: its rest then has 2⁻⁴⁰ of it, more than a float32 resolves.
constexpr double kPointShare = 0x1p-40;

}  // namespace

dvec3 originOf(const dvec3& lo, const dvec3& hi, double least) {
  const dvec3 extent = 0.5 * (hi - lo), far = glm::max(glm::abs(lo), glm::abs(hi));
  const double half = std::max({extent.x, extent.y, extent.z, least, kPointShare * std::max({far.x, far.y, far.z})});
  dvec3 origin(0);
  if (!(half > 0) || !std::isfinite(half)) return origin;
  const double step = std::exp2(std::ceil(std::log2(half)));
  for (int axis = 0; axis < 3; ++axis)
    if (far[axis] > kFar * half) origin[axis] = std::round((0.5 * lo[axis] + 0.5 * hi[axis]) / step) * step;
  return origin;
}

void moveOrigin(Scene& scene, const dvec3& origin) {
  const dvec3 step = origin - scene.movedBy;
  scene.origin = scene.movedBy = origin;
  if (step == dvec3(0)) return;
  scene.camera.position -= step, scene.camera.target -= step;
  for (CameraKey& key : scene.camera.keys) {
    if (key.position) *key.position -= step;
    if (key.target) *key.target -= step;
  }
  for (LightSource& light : scene.lights) light.position -= step;
}

}  // namespace mote
