// The full splat: footprint and opacity with a lens, a shutter, an orthographic or an anamorphic camera, surfaces in
// the way, and maps over it (DESIGN §2, thesis §4.7; formulas: layout/splat_scene.h).
//
// Twin of shaders/glsl/lib/full_footprint.glsl, operation by operation.
//
// Lens. At depth z a point's image is a disc of the radius coc = aperture · |z − focus| / focus, in scene units at z.
// The particle's kernel of radius r convolved with it is taken as a plateau: support R = r + coc, flat up to p =
// max(coc − r, 0), then the falloff, stretched to R − p: the kernel itself for coc → 0, a disc with soft edges for coc
// ≫ r. Its integral over the plane is (φ² + 2φw·J0 + w²·J1) π R², φ = p/R, w = 1 − φ, with J1 = ∫F(q)dq and J0 =
// ∫F(s²)ds, so the peak is scaled to keep the cross-section exactly.
//
// Shutter. The centre moves evenly over the image from m − h to m + h; the optical depth at a pixel is the mean of the
// kernel's over that path, ½ ∫ F(q(s)) ds. Where the ray is inside the support, s lies between the roots of q(s) = 1;
// that interval, cut at the path's ends and divided at the closest approach, is integrated by Gauss and Legendre's rule
// with three points on each part: exact for the smooth falloff, whose F(q(s)) is a polynomial of degree 4, and within
// 0.5 % for the others.
#pragma once
#include "host/core/cap.h"
#include "host/core/falloff.h"
#include "host/splat/footprint.h"
#include "shaders/glsl/layout/splat_scene.h"

namespace mote {

struct FullFootprint {
  vec2 middle;      ///< m: image point in the middle of the path
  vec2 pixel;       ///< the same in pixels from the upper left corner
  vec2 halfPath;    ///< h: half of the path, in image coordinates
  float scale;      ///< from image coordinates to units of R at the particle's depth
  float support;    ///< R [scene units]
  float plateau;    ///< φ
  float peakScale;  ///< on the optical depth: what the lens spreads
  float opacity;    ///< factor on α: area ratio of support and least drawn radius
  float depth;      ///< of the centre, along the view axis [scene units]
  vec2 lo, hi;      ///< pixels that it can touch, clipped to the picture
};

/// ∫ F(s²) ds and ∫ F(q) dq over [0, 1].
inline vec2 falloffIntegrals(layout::uint kind) {
  if (kind == layout::kFalloffLinear) return vec2(0.5f, 1.0f / 3);
  if (kind == layout::kFalloffSphere) return vec2(0.785398163f, 2.0f / 3);
  return vec2(8.0f / 15, 1.0f / 3);
}

/// Camera space: x right, y up, z forward.
inline vec3 toCameraSpace(const vec3& position, const layout::SplatCamera& camera) {
  const vec3 p = position - camera.position;
  return vec3((p.x * camera.right.x + p.y * camera.right.y) + p.z * camera.right.z,
              (p.x * camera.up.x + p.y * camera.up.y) + p.z * camera.up.z,
              (p.x * camera.forward.x + p.y * camera.forward.y) + p.z * camera.forward.z);
}

/// Image point; what is nearer than `near` is taken to stand there.
inline vec2 imageOf(const vec3& p, const layout::SplatCamera& camera) {
  if (camera.orthographic != 0) return vec2(p.x, p.y);
  const float z = std::max(p.z, camera.near);
  return vec2(p.x / z, p.y / z);
}

inline vec2 pixelOf(const vec2& image, const layout::SplatCamera& camera) {
  return vec2(0.5f * camera.imageSize.x + image.x / (camera.pixelSize * camera.pixelAspect),
              0.5f * camera.imageSize.y - image.y / camera.pixelSize);
}

/// Interval of one image coordinate that a ball of radius R around image point u at depth z covers.
inline vec2 coveredInterval(float u, float z, float support, const layout::SplatCamera& camera) {
  if (camera.orthographic != 0) return vec2(u - support, u + support);
  return silhouette((u * z) / support, z / support);
}

/// False where nothing of the particle can be seen: centre nearer than `near` or beyond `far`, or all of it off screen.
inline bool makeFullFootprint(const layout::SplatParticle& particle, const vec3& velocity,
                              const layout::SplatScene& scene, FullFootprint& f) {
  const layout::SplatCamera& camera = scene.camera;
  const vec3 p = toCameraSpace(particle.position, camera);
  const float z = p.z;
  if (!(z >= camera.near && z <= camera.far)) return false;
  const float unit = camera.orthographic != 0 ? 1.0f : z;  // of image coordinates, at the particle
  const float edge = camera.pixelSize * std::max(camera.pixelAspect, 1.0f);
  const float radius = std::max(particle.radius, (camera.minRadius * edge) * unit);
  const float ratio = particle.radius / radius;
  f.opacity = ratio * ratio;
  f.depth = z;

  const float confusion = (camera.apertureRadius * std::fabs(z - camera.focusDistance)) / camera.focusDistance;
  f.support = radius + confusion;
  f.scale = unit / f.support;
  f.plateau = std::max(confusion - radius, 0.0f) / f.support;
  const vec2 integrals = falloffIntegrals(camera.falloff);
  const float w = 1.0f - f.plateau;
  const float spread = (f.plateau * f.plateau + ((2.0f * f.plateau) * w) * integrals.x) + (w * w) * integrals.y;
  const float share = radius / f.support;
  f.peakScale = confusion > 0 ? ((share * share) * integrals.y) / spread : 1.0f;

  f.middle = imageOf(p, camera);
  f.halfPath = vec2(0);
  if (scene.moving != 0) {
    const vec2 from = imageOf(toCameraSpace(particle.position + velocity * scene.openTime, scene.open), scene.open);
    const vec2 to = imageOf(toCameraSpace(particle.position + velocity * scene.closeTime, scene.close), scene.close);
    f.middle = 0.5f * (from + to);
    f.halfPath = 0.5f * (to - from);
  }
  f.pixel = pixelOf(f.middle, camera);
  const vec2 a = f.middle - glm::abs(f.halfPath), b = f.middle + glm::abs(f.halfPath);
  const float left = coveredInterval(a.x, z, f.support, camera).x, right = coveredInterval(b.x, z, f.support, camera).y;
  const float bottom = coveredInterval(a.y, z, f.support, camera).x, top = coveredInterval(b.y, z, f.support, camera).y;
  f.lo = glm::max(pixelOf(vec2(left, top), camera) - kFootprintSlack, vec2(0));
  f.hi = glm::min(pixelOf(vec2(right, bottom), camera) + kFootprintSlack, camera.imageSize);
  return f.lo.x < f.hi.x && f.lo.y < f.hi.y;
}

/// False only where no rasteriser draws anything of the particle, fast way or full.
inline bool maybeSeen(const layout::SplatParticle& particle, const vec3& velocity, const layout::SplatScene& scene) {
  FullFootprint full;
  Footprint fast;
  return makeFullFootprint(particle, velocity, scene, full) ||
         (scene.moving == 0 && scene.camera.orthographic == 0 &&
          makeFootprint(particle.position, particle.radius, scene.camera, fast));
}

/// Screen velocity of particle and camera [pixels per frame], y upward.
inline vec2 screenVelocity(const vec3& position, const vec3& velocity, const layout::SplatScene& scene) {
  const vec3 step = velocity * scene.halfFrame;
  const vec2 from = pixelOf(imageOf(toCameraSpace(position - step, scene.before), scene.before), scene.before);
  const vec2 to = pixelOf(imageOf(toCameraSpace(position + step, scene.after), scene.after), scene.after);
  return vec2(to.x - from.x, from.y - to.y);
}

/// The profile at q = (distance / R)².
inline float profile(float q, float plateau, layout::uint kind) {
  if (plateau == 0) return falloff(q, kind);
  const float t = std::max(std::sqrt(q) - plateau, 0.0f) / (1.0f - plateau);
  return falloff(std::min(t * t, 1.0f), kind);
}

/// How the ray of one pixel meets a splat.
struct Crossing {
  float profile;    ///< mean of the profile over the path, ≥ 0
  float nearest;    ///< s of the closest approach
  float q;          ///< … and the distance there
  float rayLength;  ///< √(1 + ε|at|²)
  float closest;    ///< depth at which the ray passes the centre [scene units]
  vec2 offset;      ///< of the pixel from the middle, in image coordinates
};

/// One of the two parts of the path: its width times the mean of the profile over it.
inline float partOfPath(float from, float to, float c0, float c1, float c2, float plateau, layout::uint kind) {
  const float centre = 0.5f * (from + to), reach = (0.5f * (to - from)) * 0.774596669f;  // √(3/5)
  const float a = centre - reach, b = centre + reach;
  const float qa = std::max((c0 + a * c1) + (a * a) * c2, 0.0f);
  const float qm = std::max((c0 + centre * c1) + (centre * centre) * c2, 0.0f);
  const float qb = std::max((c0 + b * c1) + (b * b) * c2, 0.0f);
  const float mean = (profile(qa, plateau, kind) + profile(qb, plateau, kind)) * (5.0f / 18) +
                     profile(qm, plateau, kind) * (8.0f / 18);
  return (to - from) * mean;
}

/// False where the pixel at `at` [pixels; centres at half-integers] is not covered.
inline bool crossSplat(const FullFootprint& f, const vec2& at, const layout::SplatScene& scene, Crossing& c) {
  const layout::SplatCamera& camera = scene.camera;
  const float epsilon = camera.orthographic != 0 ? 0.0f : 1.0f;
  const float ex = (at.x - f.pixel.x) * (camera.pixelSize * camera.pixelAspect);
  const float ey = (f.pixel.y - at.y) * camera.pixelSize;
  const float u = f.middle.x + ex, v = f.middle.y + ey;
  const float facing = 1.0f + epsilon * (f.middle.x * u + f.middle.y * v);
  if (!(facing > 0)) return false;
  const float square = 1.0f + epsilon * (u * u + v * v);
  const float factor = (f.scale * f.scale) / square;
  c.offset = vec2(ex, ey);
  c.rayLength = std::sqrt(square);
  c.closest = epsilon != 0 ? (f.depth * facing) / square : f.depth;
  const float kappa = f.middle.x * ey - f.middle.y * ex;
  if (scene.moving == 0) {
    c.nearest = 0;
    c.q = ((ex * ex + ey * ey) + epsilon * (kappa * kappa)) * factor;
    if (!(c.q < 1)) return false;
    c.profile = profile(c.q, f.plateau, camera.falloff);
    return true;
  }
  // q(s) = a2·s² − 2·a1·s + a0, in units of R².
  const float eta = f.halfPath.x * v - f.halfPath.y * u;
  const float a2 =
      std::max(((f.halfPath.x * f.halfPath.x + f.halfPath.y * f.halfPath.y) + epsilon * (eta * eta)) * factor, 1e-12f);
  const float a1 = ((ex * f.halfPath.x + ey * f.halfPath.y) - epsilon * (kappa * eta)) * factor;
  c.nearest = std::min(std::max(a1 / a2, -1.0f), 1.0f);
  // About the nearest point: nothing cancels there.
  const float dx = ex - c.nearest * f.halfPath.x, dy = ey - c.nearest * f.halfPath.y;
  const float cross = kappa + c.nearest * eta;
  const float c0 = ((dx * dx + dy * dy) + epsilon * (cross * cross)) * factor;
  c.q = c0;
  if (!(c0 < 1)) return false;
  const float c1 = 2.0f * (a2 * c.nearest - a1);  // slope there: 0 unless the nearest point is an end
  const float root = std::sqrt(std::max((0.25f * c1) * c1 + a2 * (1.0f - c0), 0.0f));
  const float from = std::max((-0.5f * c1 - root) / a2, -1.0f - c.nearest);
  const float to = std::min((-0.5f * c1 + root) / a2, 1.0f - c.nearest);
  c.profile = 0.5f * (partOfPath(from, 0.0f, c0, c1, a2, f.plateau, camera.falloff) +
                      partOfPath(0.0f, to, c0, c1, a2, f.plateau, camera.falloff));
  return true;
}

/// Share of the particle before an opaque surface at depth `surface`, along the pixel's ray.
inline float shareBefore(const FullFootprint& f, const Crossing& c, float surface) {
  const float halfChord = f.support * std::sqrt(std::max(1.0f - c.q, 0.0f));
  return cap((surface - c.closest) * c.rayLength, halfChord);
}

/// Where a pixel lies on the sprite: [−1, 1]² over the square around the support, v up, stretched along the path.
inline vec2 spritePoint(const FullFootprint& f, const Crossing& c) {
  const vec2 offset = c.offset * f.scale, path = f.halfPath * f.scale;
  const float length = std::sqrt(path.x * path.x + path.y * path.y);
  if (!(length > 1e-6f)) return offset;
  const vec2 along = path / length;
  const float t = (offset.x * along.x + offset.y * along.y) / (1.0f + length);
  const float n = offset.y * along.x - offset.x * along.y;
  return vec2(t * along.x - n * along.y, t * along.y + n * along.x);
}

/// (1 − e^(−x)) / x, 1 for x = 0.
inline float meanAttenuation(float x) { return x > 1e-6f ? oneMinusExp(x) / x : 1.0f; }

}  // namespace mote
