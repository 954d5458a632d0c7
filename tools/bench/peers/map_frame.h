// Where a map before a light looks: its axes and its plane.
#pragma once
#include <algorithm>

#include "host/core/error.h"
#include "host/core/vec.h"
#include "host/octree/octree.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

/// Axes at the light: z into the scene. A point light's map lies in the plane z = 1 and sees (x / z, y / z), a
/// directional light's sees (x, y).
struct MapFrame {
  bool perspective = false;
  vec3 origin{0};
  vec3 axis[3];  ///< orthonormal: x, y, z

  vec3 local(const vec3& point) const {
    const vec3 p = point - origin;
    return {glm::dot(p, axis[0]), glm::dot(p, axis[1]), glm::dot(p, axis[2])};
  }
  /// Squared distance of the point (x, y, z) of this frame from the ray of the map's point (u, v).
  float squaredDistance(float x, float y, float z, float u, float v) const {
    if (!perspective) return (x - u) * (x - u) + (y - v) * (y - v);
    const float a = y - z * v, b = z * u - x, c = x * v - y * u;  // p × d; no difference of great squares
    return (a * a + b * b + c * c) / (1 + u * u + v * v);
  }
};

/// Throws InputError for a point light within the supports' box: one map cannot see all around it.
inline MapFrame mapFrame(const Octree& tree, const layout::Light& light) {
  const Bounds bounds = tree.bounds();
  MapFrame frame;
  frame.perspective = light.type != layout::kLightDirectional;
  frame.origin = frame.perspective ? light.position : bounds.centre();
  const vec3 forward = frame.perspective ? bounds.centre() - light.position : light.direction;
  const vec3 nearest = glm::clamp(frame.origin, bounds.lo, bounds.hi);
  if (frame.perspective && nearest == frame.origin)
    throw InputError("light", "position", "a place outside of the particles", "one among them");
  frame.axis[2] = glm::normalize(forward);
  const vec3 size = glm::abs(frame.axis[2]);
  const vec3 other = size.x < size.y && size.x < size.z ? vec3(1, 0, 0)
                     : size.y < size.z                  ? vec3(0, 1, 0)
                                                        : vec3(0, 0, 1);
  frame.axis[0] = glm::normalize(glm::cross(other, frame.axis[2]));
  frame.axis[1] = glm::cross(frame.axis[2], frame.axis[0]);
  if (frame.perspective)  // all corners in front: the map's plane is z = 1
    for (int corner = 0; corner < 8; ++corner) {
      const vec3 at(corner & 1 ? bounds.hi.x : bounds.lo.x, corner & 2 ? bounds.hi.y : bounds.lo.y,
                    corner & 4 ? bounds.hi.z : bounds.lo.z);
      if (frame.local(at).z <= 0)
        throw InputError("light", "position", "a place from which all particles lie ahead", "one too near to them");
    }
  return frame;
}

}  // namespace mote
