// Is anything between a point and a light? The any-hit walk over the tree of solids.
// C++ twin: host/solids/solid_walk.h, operation by operation, where everything is explained; `precise` keeps the compiler
// from fusing multiply-adds, which the host does not do either.
#ifndef MOTE_LIB_SOLID_WALK_GLSL
#define MOTE_LIB_SOLID_WALK_GLSL
#include "../layout/solid.h"

const float kBoxSlack = 1e-6;
const float kSlabSlack = 1e-6;
const float kLeastSlope = 1e-18;
const float kEndless = 1e30;

struct SolidRay {
  vec3 origin, direction, inverse;
  float end;
  bool bounded;
  int kx, ky, kz;
  vec3 shear;
  float slack;
};

SolidRay makeSolidRay(vec3 origin, vec3 lightPosition, vec3 lightDirection, uint lightType, vec3 lo, vec3 hi) {
  SolidRay ray;
  ray.origin = origin;
  ray.bounded = lightType != kLightDirectional;
  precise vec3 toLight = lightPosition - origin;
  const vec3 d = ray.bounded ? toLight : -lightDirection;
  ray.direction = d;
  ray.end = ray.bounded ? 1.0 : kEndless;
  const vec3 size = abs(d);
  precise vec3 inverse = 1.0 / mix(d, vec3(kLeastSlope), lessThan(size, vec3(kLeastSlope)));
  ray.inverse = inverse;
  ray.kz = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const bool forward = d[ray.kz] >= 0.0;
  const int next = ray.kz == 2 ? 0 : ray.kz + 1;
  const int last = ray.kz == 0 ? 2 : ray.kz - 1;
  ray.kx = forward ? next : last;
  ray.ky = forward ? last : next;
  const float z = size[ray.kz] < kLeastSlope ? kLeastSlope : d[ray.kz];
  precise vec3 shear = vec3(d[ray.kx] / z, d[ray.ky] / z, 1.0 / z);
  ray.shear = shear;
  precise vec3 below = lo - origin;
  precise vec3 above = hi - origin;
  const vec3 reach = max(abs(below), abs(above));
  precise float slack = kBoxSlack * max(reach.x, max(reach.y, reach.z));
  ray.slack = slack;
  return ray;
}

bool touchesBox(SolidRay ray, vec3 lo, vec3 hi) {
  precise vec3 a = ((lo - ray.origin) - ray.slack) * ray.inverse;
  precise vec3 b = ((hi - ray.origin) + ray.slack) * ray.inverse;
  const vec3 first = min(a, b);
  const vec3 last = max(a, b);
  const float enter = max(max(first.x, 0.0), max(first.y, first.z));
  const float leave = min(min(last.x, ray.end), min(last.y, last.z));
  precise float limit = leave + kSlabSlack * abs(leave);
  return enter <= limit;
}

vec3 shearedCorner(SolidRay ray, vec3 corner) {
  precise vec3 p = corner - ray.origin;
  const float z = p[ray.kz];
  precise vec3 sheared = vec3(p[ray.kx] - ray.shear.x * z, p[ray.ky] - ray.shear.y * z, ray.shear.z * z);
  return sheared;
}

float least(float a, float b, float c) { return min(a, min(b, c)); }
float most(float a, float b, float c) { return max(a, max(b, c)); }

bool blocks(SolidRay ray, Triangle triangle) {
  const vec3 a = shearedCorner(ray, triangle.a);
  const vec3 b = shearedCorner(ray, triangle.b);
  const vec3 c = shearedCorner(ray, triangle.c);
  precise float u = c.x * b.y - c.y * b.x;
  precise float v = a.x * c.y - a.y * c.x;
  precise float w = b.x * a.y - b.y * a.x;
  if (!((u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0))) return false;
  if (u == 0.0 || v == 0.0 || w == 0.0) {
    if (least(a.x, b.x, c.x) > 0.0 || most(a.x, b.x, c.x) < 0.0) return false;
    if (least(a.y, b.y, c.y) > 0.0 || most(a.y, b.y, c.y) < 0.0) return false;
  }
  precise float determinant = (u + v) + w;
  if (determinant == 0.0) return most(a.z, b.z, c.z) > 0.0 && !(ray.bounded && least(a.z, b.z, c.z) >= 1.0);
  precise float scaled = (u * a.z + v * b.z) + w * c.z;
  const float t = determinant < 0.0 ? -scaled : scaled;
  return t > 0.0 && (!ray.bounded || t < abs(determinant));
}

bool anyBlocks(NodeBuffer nodes, uint nodeCount, TriangleBuffer triangles, SolidRay ray) {
  uint index = 0;
  while (index < nodeCount) {
    const Node node = nodes.at[index];
    if (!touchesBox(ray, node.lo, node.hi)) {
      index = node.skip;
      continue;
    }
    ++index;
    if (node.skip != index) continue;
    const uint end = nodes.at[index].first;
    for (uint slot = node.first; slot < end; ++slot)
      if (blocks(ray, triangles.at[slot])) return true;
  }
  return false;
}

#endif
