// Is anything between a point and a light? The any-hit walk over a SolidTree, one ray at a time.
//
// shaders/glsl/lib/solid_walk.glsl is its twin, operation by operation, so that host and device decide alike. The
// triangle test is that of Woop, Benthin and Wald 2013 ("Watertight Ray/Triangle Intersection", JCGT 2(1)): corners are
// sheared so that the ray runs along z from the origin, and three edge functions say on which side of each edge it
// passes. An edge's function is computed from the same numbers in both of its triangles, and rounding can make it 0 but
// never turn its sign; as 0 counts as inside, no ray slips between two triangles. Both sides of a triangle count.
//
// Shearing moves a corner by up to 6e-7 of its distance from the origin, by rounding; so boxes grow by 1e-6 of the
// distance of the tree's farthest corner, else a neighbour's box could be missed by a ray that the shear gives to it.
// Coordinates between about 1e-15 and 1e15 keep clear of float's ends.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "host/core/vec.h"
#include "shaders/glsl/layout/light.h"
#include "shaders/glsl/layout/solid.h"

namespace mote {

constexpr float kBoxSlack = 1e-6f;     ///< of the distance of the tree's farthest corner, see above
constexpr float kSlabSlack = 1e-6f;    ///< of a slab's far end: three roundings of 6e-8 each, on both ends
constexpr float kLeastSlope = 1e-18f;  ///< stands for a direction's 0, so that its inverse is finite
constexpr float kEndless = 1e30f;      ///< end of a directional light's ray

/// From the point at t = 0 to the light at t = 1; toward a directional light without an end.
struct SolidRay {
  vec3 origin, direction, inverse;
  float end;     // of t, for the boxes
  bool bounded;  // true: t < 1
  int kx, ky, kz;
  vec3 shear;   // of x and y with z, and the scale of z
  float slack;  // by which boxes grow [scene units]
};

/// `lo`, `hi`: the tree's box.
inline SolidRay makeSolidRay(const vec3& origin, const vec3& lightPosition, const vec3& lightDirection,
                             layout::uint lightType, const vec3& lo, const vec3& hi) {
  SolidRay ray;
  ray.origin = origin;
  ray.bounded = lightType != layout::kLightDirectional;
  ray.direction = ray.bounded ? lightPosition - origin : -lightDirection;
  ray.end = ray.bounded ? 1.0f : kEndless;
  const vec3 d = ray.direction;
  const vec3 size(std::abs(d.x), std::abs(d.y), std::abs(d.z));
  for (int k = 0; k < 3; ++k) ray.inverse[k] = 1.0f / (size[k] < kLeastSlope ? kLeastSlope : d[k]);
  // z is the longest axis; the others keep their turn whichever way the ray runs.
  ray.kz = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const bool forward = d[ray.kz] >= 0.0f;
  const int next = ray.kz == 2 ? 0 : ray.kz + 1, last = ray.kz == 0 ? 2 : ray.kz - 1;
  ray.kx = forward ? next : last;
  ray.ky = forward ? last : next;
  const float z = size[ray.kz] < kLeastSlope ? kLeastSlope : d[ray.kz];
  ray.shear = vec3(d[ray.kx] / z, d[ray.ky] / z, 1.0f / z);
  float farthest = 0.0f;
  for (int k = 0; k < 3; ++k)
    farthest = std::max(farthest, std::max(std::abs(lo[k] - origin[k]), std::abs(hi[k] - origin[k])));
  ray.slack = kBoxSlack * farthest;
  return ray;
}

/// True if the ray may meet something in the box; never false if it does.
inline bool touchesBox(const SolidRay& ray, const vec3& lo, const vec3& hi) {
  float enter = 0.0f, leave = ray.end;
  for (int k = 0; k < 3; ++k) {
    const float a = ((lo[k] - ray.origin[k]) - ray.slack) * ray.inverse[k];
    const float b = ((hi[k] - ray.origin[k]) + ray.slack) * ray.inverse[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave + kSlabSlack * std::abs(leave);
}

/// A corner as the sheared ray sees it; z is its t.
inline vec3 shearedCorner(const SolidRay& ray, const vec3& corner) {
  const vec3 p = corner - ray.origin;
  const float z = p[ray.kz];
  return {p[ray.kx] - ray.shear.x * z, p[ray.ky] - ray.shear.y * z, ray.shear.z * z};
}

inline float least(float a, float b, float c) { return std::min(a, std::min(b, c)); }
inline float most(float a, float b, float c) { return std::max(a, std::max(b, c)); }

/// True if the triangle takes the light: 0 < t < end.
inline bool blocks(const SolidRay& ray, const layout::Triangle& triangle) {
  const vec3 a = shearedCorner(ray, triangle.a);
  const vec3 b = shearedCorner(ray, triangle.b);
  const vec3 c = shearedCorner(ray, triangle.c);
  const float u = c.x * b.y - c.y * b.x;
  const float v = a.x * c.y - a.y * c.x;
  const float w = b.x * a.y - b.y * a.x;
  if (!((u >= 0.0f && v >= 0.0f && w >= 0.0f) || (u <= 0.0f && v <= 0.0f && w <= 0.0f))) return false;
  if (u == 0.0f || v == 0.0f || w == 0.0f) {
    // A zero may be a small number's rounding, and a triangle seen edge-on has nothing else: its box decides as well.
    if (least(a.x, b.x, c.x) > 0.0f || most(a.x, b.x, c.x) < 0.0f) return false;
    if (least(a.y, b.y, c.y) > 0.0f || most(a.y, b.y, c.y) < 0.0f) return false;
  }
  const float determinant = (u + v) + w;
  if (determinant == 0.0f) {  // edge-on: all of its depths
    return most(a.z, b.z, c.z) > 0.0f && !(ray.bounded && least(a.z, b.z, c.z) >= 1.0f);
  }
  const float scaled = (u * a.z + v * b.z) + w * c.z;  // t · determinant
  const float t = determinant < 0.0f ? -scaled : scaled;
  return t > 0.0f && (!ray.bounded || t < std::abs(determinant));
}

/// True if any of the triangles blocks the ray. `nodes` as in layout/node.h, nodeCount without the sentinel.
inline bool anyBlocks(const layout::Node* nodes, layout::uint nodeCount, const layout::Triangle* triangles,
                      const SolidRay& ray) {
  for (layout::uint index = 0; index < nodeCount;) {
    const layout::Node& node = nodes[index];
    if (!touchesBox(ray, node.lo, node.hi)) {
      index = node.skip;
      continue;
    }
    ++index;
    if (node.skip != index) continue;
    for (layout::uint slot = node.first; slot < nodes[index].first; ++slot)
      if (blocks(ray, triangles[slot])) return true;
  }
  return false;
}

}  // namespace mote
