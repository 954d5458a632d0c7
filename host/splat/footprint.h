// What one particle covers on the picture, and its opacity at a pixel (DESIGN §2, view; formulas: layout/splat.h).
//
// Twin of shaders/glsl/lib/footprint.glsl and falloff.glsl, operation by operation, so that CPU and GPU differ by no
// more than the GPU's division and square root. Lengths are divided by the effective radius at once, r' = max(r,
// minRadius pixels): then b²/r'² = |e × δ|² / |w|² with e = d / r', and neither tiny nor huge scenes leave float's
// range.
//
// δ is taken in pixels, from the particle's image point to the pixel's centre, which loses no digits for particles much
// smaller than their distance. What remains is the rounding of the image point itself, a few 2⁻²⁴ of its distance from
// the picture's centre: below 0.002 pixel in a picture of 16384. Only a particle that reaches the camera from far off
// the axis (|d| / d.z large) has more: about 6e-8 · |d| / d.z of its radius.
#pragma once
#include <bit>
#include <cmath>

#include "host/core/falloff.h"
#include "host/core/vec.h"
#include "shaders/glsl/layout/splat.h"

namespace mote {

/// The exact outline is widened by this against rounding [pixels].
constexpr float kFootprintSlack = 1.0f / 64;
/// Image-plane coordinate beyond any picture (fov < 180° in float gives less than 1e8), far from float's limit.
constexpr float kUnbounded = 1e30f;

struct Footprint {
  vec3 centre;    ///< camera space, in units of the effective radius
  float depth;    ///< of the centre, along the view axis [scene units]
  vec2 image;     ///< (u0, v0), the centre's image point at depth 1
  vec2 pixel;     ///< the same in pixels from the upper left corner
  float opacity;  ///< factor on α: area ratio (r / r')²
  vec2 lo, hi;    ///< pixels that it can touch, clipped to the picture: upper left and lower right corner
};

/// 1 − e^(−x) for x ≥ 0, to a relative error of 3e-7 also where x is tiny: a million thin particles must add up.
/// x = n·ln 2 − y with |y| ≤ ½·ln 2; with p = e^y − 1 (Taylor to y⁷, remainder < 1e-8) the value is (1 − 2⁻ⁿ) − 2⁻ⁿ·p,
/// whose first bracket vanishes for small x. ln 2 in two parts, the first exact in 9 bits (Cody and Waite 1980).
inline float oneMinusExp(float opticalDepth) {
  const float x = std::min(opticalDepth, 40.0f);  // 1 − e^−40 rounds to 1
  const float n = std::floor(x * 1.44269504f + 0.5f);
  const float y = (n * 0.693359375f - x) + n * -2.12194440e-4f;
  float p = 1.0f / 720 + y * (1.0f / 5040);
  p = 1.0f / 120 + y * p;
  p = 1.0f / 24 + y * p;
  p = 1.0f / 6 + y * p;
  p = 0.5f + y * p;
  p = y + (y * y) * p;
  const float power = std::bit_cast<float>((127 - static_cast<int>(n)) << 23);  // 2⁻ⁿ
  return (1.0f - power) - power * p;
}

/// Interval of u = x / z of the rays that meet a ball of radius 1 around (x, z) in its plane, z > 0: the tangents
/// tan(φ ± θ) with tan φ = x / z and sin θ = 1 / |(x, z)|. A tangent at 90° or more leaves its side unbounded; inside
/// the ball (and a little outside, against rounding) both sides are. In space it bounds the rays that meet the ball as
/// their projections meet its disc.
inline vec2 silhouette(float x, float z) {
  const float square = x * x + z * z;
  if (square <= 1.00001f) return {-kUnbounded, kUnbounded};
  const float h = std::sqrt(square - 1.0f);
  const float below = z * h + x;  // ∝ cos(φ − θ)
  const float above = z * h - x;  // ∝ cos(φ + θ)
  const float lo = x * h - z;
  const float hi = x * h + z;
  return {below > 0 ? lo / below : -kUnbounded, above > 0 ? hi / above : kUnbounded};
}

/// False where nothing of the particle can be seen: centre nearer than `near` or beyond `far`, or all of it off screen.
inline bool makeFootprint(const vec3& position, float radius, const layout::SplatCamera& camera, Footprint& f) {
  const vec3 p = position - camera.position;
  const float x = (p.x * camera.right.x + p.y * camera.right.y) + p.z * camera.right.z;
  const float y = (p.x * camera.up.x + p.y * camera.up.y) + p.z * camera.up.z;
  const float z = (p.x * camera.forward.x + p.y * camera.forward.y) + p.z * camera.forward.z;
  if (!(z >= camera.near && z <= camera.far)) return false;
  const float effective = std::max(radius, (camera.minRadius * camera.pixelSize) * z);
  const float ratio = radius / effective;
  f.opacity = ratio * ratio;
  f.depth = z;
  f.centre = vec3(x / effective, y / effective, z / effective);
  f.image = vec2(x / z, y / z);
  const vec2 middle = 0.5f * camera.imageSize;
  f.pixel = vec2(middle.x + f.image.x / camera.pixelSize, middle.y - f.image.y / camera.pixelSize);
  const vec2 u = silhouette(f.centre.x, f.centre.z);
  const vec2 v = silhouette(f.centre.y, f.centre.z);
  const vec2 lo = vec2(middle.x + u.x / camera.pixelSize, middle.y - v.y / camera.pixelSize) - kFootprintSlack;
  const vec2 hi = vec2(middle.x + u.y / camera.pixelSize, middle.y - v.x / camera.pixelSize) + kFootprintSlack;
  f.lo = glm::max(lo, vec2(0));
  f.hi = glm::min(hi, camera.imageSize);
  return f.lo.x < f.hi.x && f.lo.y < f.hi.y;
}

/// q = b² / r'² of the ray through `at` [pixels; pixel centres at half-integers]; 2 where the particle is behind it.
inline float footprintDistance(const vec3& centre, const vec2& image, const vec2& pixel, const vec2& at,
                               float pixelSize) {
  const float dx = (at.x - pixel.x) * pixelSize;
  const float dy = (pixel.y - at.y) * pixelSize;
  const float u = image.x + dx;
  const float v = image.y + dy;
  const float facing = centre.x * u + (centre.y * v + centre.z);
  if (!(facing > 0)) return 2;
  const float cx = centre.z * dy;
  const float cy = centre.z * dx;
  const float cz = centre.x * dy - centre.y * dx;
  const float across = (cy * cy + cz * cz) + cx * cx;
  const float along = u * u + (v * v + 1.0f);
  return across / along;
}

/// Opacity where q < 1; 0 beyond the support.
inline float footprintAlpha(float q, float peak, float opacity, layout::uint kind) {
  if (!(q < 1)) return 0;
  return opacity * oneMinusExp(peak * falloff(q, kind));
}

}  // namespace mote
