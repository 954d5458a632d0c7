// What one particle covers on the picture, and its opacity at a pixel (DESIGN §2, view; formulas: layout/splat.h).
// C++ twin: host/splat/footprint.h, operation by operation, where everything is explained; `precise` keeps the compiler
// from fusing multiply-adds, which the host does not do either.
#ifndef MOTE_LIB_FOOTPRINT_GLSL
#define MOTE_LIB_FOOTPRINT_GLSL
#include "../layout/splat.h"
#include "falloff.glsl"

const float kFootprintSlack = 1.0 / 64.0;  // [pixels]
const float kUnbounded = 1e30;

struct Footprint {
  vec3 centre;    // camera space, in units of the effective radius
  float depth;    // of the centre, along the view axis [scene units]
  vec2 image;     // (u0, v0), the centre's image point at depth 1
  vec2 pixel;     // the same in pixels from the upper left corner
  float opacity;  // factor on alpha: area ratio of support and effective radius
  vec2 lo;        // pixels that it can touch, clipped to the picture …
  vec2 hi;        // … upper left and lower right corner
};

// 1 − e^(−x) for x ≥ 0, to a relative error of 3e-7 also where x is tiny.
float oneMinusExp(float opticalDepth) {
  precise float x = min(opticalDepth, 40.0);
  precise float n = floor(x * 1.44269504 + 0.5);
  precise float y = (n * 0.693359375 - x) + n * -2.12194440e-4;
  precise float p = 1.0 / 720.0 + y * (1.0 / 5040.0);
  p = 1.0 / 120.0 + y * p;
  p = 1.0 / 24.0 + y * p;
  p = 1.0 / 6.0 + y * p;
  p = 0.5 + y * p;
  p = y + (y * y) * p;
  float power = intBitsToFloat((127 - int(n)) << 23);
  precise float result = (1.0 - power) - power * p;
  return result;
}

// Interval of u = x / z of the rays that meet a ball of radius 1 around (x, z), z > 0.
vec2 silhouette(float x, float z) {
  precise float square = x * x + z * z;
  if (square <= 1.00001) return vec2(-kUnbounded, kUnbounded);
  precise float h = sqrt(square - 1.0);
  precise float below = z * h + x;
  precise float above = z * h - x;
  precise float lo = x * h - z;
  precise float hi = x * h + z;
  return vec2(below > 0.0 ? lo / below : -kUnbounded, above > 0.0 ? hi / above : kUnbounded);
}

// False where nothing of the particle can be seen.
bool makeFootprint(vec3 position, float radius, SplatCamera camera, out Footprint f) {
  precise vec3 p = position - camera.position;
  precise float x = (p.x * camera.right.x + p.y * camera.right.y) + p.z * camera.right.z;
  precise float y = (p.x * camera.up.x + p.y * camera.up.y) + p.z * camera.up.z;
  precise float z = (p.x * camera.forward.x + p.y * camera.forward.y) + p.z * camera.forward.z;
  if (!(z >= camera.near && z <= camera.far)) return false;
  precise float effective = max(radius, (camera.minRadius * camera.pixelSize) * z);
  precise float ratio = radius / effective;
  f.opacity = ratio * ratio;
  f.depth = z;
  f.centre = vec3(x / effective, y / effective, z / effective);
  f.image = vec2(x / z, y / z);
  precise vec2 middle = 0.5 * camera.imageSize;
  precise float px = middle.x + f.image.x / camera.pixelSize;
  precise float py = middle.y - f.image.y / camera.pixelSize;
  f.pixel = vec2(px, py);
  vec2 u = silhouette(f.centre.x, f.centre.z);
  vec2 v = silhouette(f.centre.y, f.centre.z);
  precise vec2 lo = vec2(middle.x + u.x / camera.pixelSize, middle.y - v.y / camera.pixelSize) - kFootprintSlack;
  precise vec2 hi = vec2(middle.x + u.y / camera.pixelSize, middle.y - v.x / camera.pixelSize) + kFootprintSlack;
  f.lo = max(lo, vec2(0.0));
  f.hi = min(hi, camera.imageSize);
  return f.lo.x < f.hi.x && f.lo.y < f.hi.y;
}

// q = b² / r'² of the ray through `at` [pixels; centres at half-integers, as gl_FragCoord]; 2 where the particle is behind.
float footprintDistance(vec3 centre, vec2 image, vec2 pixel, vec2 at, float pixelSize) {
  precise float dx = (at.x - pixel.x) * pixelSize;
  precise float dy = (pixel.y - at.y) * pixelSize;
  precise float u = image.x + dx;
  precise float v = image.y + dy;
  precise float facing = centre.x * u + (centre.y * v + centre.z);
  if (!(facing > 0.0)) return 2.0;
  precise float cx = centre.z * dy;
  precise float cy = centre.z * dx;
  precise float cz = centre.x * dy - centre.y * dx;
  precise float across = (cy * cy + cz * cz) + cx * cx;
  precise float along = u * u + (v * v + 1.0);
  precise float q = across / along;
  return q;
}

// Opacity where q < 1; 0 beyond the support.
float footprintAlpha(float q, float peak, float opacity, uint kind) {
  if (!(q < 1.0)) return 0.0;
  return opacity * oneMinusExp(peak * falloff(q, kind));
}

#endif
