// The full splat: footprint and opacity. C++ twin: host/splat/full_footprint.h, operation by operation, where everything is
// explained; `precise` keeps the compiler from fusing multiply-adds, which the host does not do either.
#ifndef MOTE_LIB_FULL_FOOTPRINT_GLSL
#define MOTE_LIB_FULL_FOOTPRINT_GLSL
#include "../layout/splat_scene.h"
#include "cap.glsl"
#include "footprint.glsl"

struct FullFootprint {
  vec2 middle;      // m: image point in the middle of the path
  vec2 pixel;       // the same in pixels from the upper left corner
  vec2 halfPath;    // h: half of the path, in image coordinates
  float scale;      // from image coordinates to units of R at the particle's depth
  float support;    // R [scene units]
  float plateau;    // φ
  float peakScale;  // on the optical depth: what the lens spreads
  float opacity;    // factor on α: area ratio of support and least drawn radius
  float depth;      // of the centre, along the view axis [scene units]
  vec2 lo, hi;      // pixels that it can touch, clipped to the picture
};

// ∫ F(s²) ds and ∫ F(q) dq over [0, 1].
vec2 falloffIntegrals(uint kind) {
  if (kind == kFalloffLinear) return vec2(0.5, 1.0 / 3.0);
  if (kind == kFalloffSphere) return vec2(0.785398163, 2.0 / 3.0);
  return vec2(8.0 / 15.0, 1.0 / 3.0);
}

// Camera space: x right, y up, z forward.
vec3 toCameraSpace(vec3 position, SplatCamera camera) {
  precise vec3 p = position - camera.position;
  precise float x = (p.x * camera.right.x + p.y * camera.right.y) + p.z * camera.right.z;
  precise float y = (p.x * camera.up.x + p.y * camera.up.y) + p.z * camera.up.z;
  precise float z = (p.x * camera.forward.x + p.y * camera.forward.y) + p.z * camera.forward.z;
  return vec3(x, y, z);
}

// Image point; what is nearer than `near` is taken to stand there.
vec2 imageOf(vec3 p, SplatCamera camera) {
  if (camera.orthographic != 0) return vec2(p.x, p.y);
  precise float z = max(p.z, camera.near);
  return vec2(p.x / z, p.y / z);
}

vec2 pixelOf(vec2 image, SplatCamera camera) {
  precise float x = 0.5 * camera.imageSize.x + image.x / (camera.pixelSize * camera.pixelAspect);
  precise float y = 0.5 * camera.imageSize.y - image.y / camera.pixelSize;
  return vec2(x, y);
}

// Interval of one image coordinate that a ball of radius R around image point u at depth z covers.
vec2 coveredInterval(float u, float z, float support, SplatCamera camera) {
  if (camera.orthographic != 0) return vec2(u - support, u + support);
  return silhouette((u * z) / support, z / support);
}

// False where nothing of the particle can be seen: centre nearer than `near` or beyond `far`, or all of it off screen.
bool makeFullFootprint(SplatParticle particle, vec3 velocity, SplatScene scene, out precise FullFootprint f) {
  SplatCamera camera = scene.camera;
  precise vec3 p = toCameraSpace(particle.position, camera);
  precise float z = p.z;
  if (!(z >= camera.near && z <= camera.far)) return false;
  precise float unit = camera.orthographic != 0 ? 1.0 : z;  // of image coordinates, at the particle
  precise float edge = camera.pixelSize * max(camera.pixelAspect, 1.0);
  precise float radius = max(particle.radius, (camera.minRadius * edge) * unit);
  precise float ratio = particle.radius / radius;
  f.opacity = ratio * ratio;
  f.depth = z;

  precise float confusion = (camera.apertureRadius * abs(z - camera.focusDistance)) / camera.focusDistance;
  f.support = radius + confusion;
  f.scale = unit / f.support;
  f.plateau = max(confusion - radius, 0.0) / f.support;
  precise vec2 integrals = falloffIntegrals(camera.falloff);
  precise float w = 1.0 - f.plateau;
  precise float spread = (f.plateau * f.plateau + ((2.0 * f.plateau) * w) * integrals.x) + (w * w) * integrals.y;
  precise float share = radius / f.support;
  f.peakScale = confusion > 0.0 ? ((share * share) * integrals.y) / spread : 1.0;

  f.middle = imageOf(p, camera);
  f.halfPath = vec2(0.0);
  if (scene.moving != 0) {
    precise vec2 from = imageOf(toCameraSpace(particle.position + velocity * scene.openTime, scene.open), scene.open);
    precise vec2 to = imageOf(toCameraSpace(particle.position + velocity * scene.closeTime, scene.close), scene.close);
    f.middle = 0.5 * (from + to);
    f.halfPath = 0.5 * (to - from);
  }
  f.pixel = pixelOf(f.middle, camera);
  precise vec2 a = f.middle - abs(f.halfPath), b = f.middle + abs(f.halfPath);
  precise float left = coveredInterval(a.x, z, f.support, camera).x, right = coveredInterval(b.x, z, f.support, camera).y;
  precise float bottom = coveredInterval(a.y, z, f.support, camera).x, top = coveredInterval(b.y, z, f.support, camera).y;
  f.lo = max(pixelOf(vec2(left, top), camera) - kFootprintSlack, vec2(0.0));
  f.hi = min(pixelOf(vec2(right, bottom), camera) + kFootprintSlack, camera.imageSize);
  return f.lo.x < f.hi.x && f.lo.y < f.hi.y;
}

// Screen velocity of particle and camera [pixels per frame], y upward.
vec2 screenVelocity(vec3 position, vec3 velocity, SplatScene scene) {
  precise vec3 step = velocity * scene.halfFrame;
  precise vec2 from = pixelOf(imageOf(toCameraSpace(position - step, scene.before), scene.before), scene.before);
  precise vec2 to = pixelOf(imageOf(toCameraSpace(position + step, scene.after), scene.after), scene.after);
  return vec2(to.x - from.x, from.y - to.y);
}

// The profile at q = (distance / R)².
float profile(float q, float plateau, uint kind) {
  if (plateau == 0.0) return falloff(q, kind);
  precise float t = max(sqrt(q) - plateau, 0.0) / (1.0 - plateau);
  return falloff(min(t * t, 1.0), kind);
}

// How the ray of one pixel meets a splat.
struct Crossing {
  float profile;    // mean of the profile over the path, ≥ 0
  float nearest;    // s of the closest approach
  float q;          // … and the distance there
  float rayLength;  // √(1 + ε|at|²)
  float closest;    // depth at which the ray passes the centre [scene units]
  vec2 offset;      // of the pixel from the middle, in image coordinates
};

// One of the two parts of the path: its width times the mean of the profile over it.
float partOfPath(float from, float to, float c0, float c1, float c2, float plateau, uint kind) {
  precise float centre = 0.5 * (from + to), reach = (0.5 * (to - from)) * 0.774596669;  // √(3/5)
  precise float a = centre - reach, b = centre + reach;
  precise float qa = max((c0 + a * c1) + (a * a) * c2, 0.0);
  precise float qm = max((c0 + centre * c1) + (centre * centre) * c2, 0.0);
  precise float qb = max((c0 + b * c1) + (b * b) * c2, 0.0);
  precise float mean = (profile(qa, plateau, kind) + profile(qb, plateau, kind)) * (5.0 / 18.0) +
                     profile(qm, plateau, kind) * (8.0 / 18.0);
  precise float part = (to - from) * mean;
  return part;
}

// False where the pixel at `at` [pixels; centres at half-integers] is not covered.
bool crossSplat(FullFootprint f, vec2 at, SplatScene scene, out precise Crossing c) {
  SplatCamera camera = scene.camera;
  precise float epsilon = camera.orthographic != 0 ? 0.0 : 1.0;
  precise float ex = (at.x - f.pixel.x) * (camera.pixelSize * camera.pixelAspect);
  precise float ey = (f.pixel.y - at.y) * camera.pixelSize;
  precise float u = f.middle.x + ex, v = f.middle.y + ey;
  precise float facing = 1.0 + epsilon * (f.middle.x * u + f.middle.y * v);
  if (!(facing > 0.0)) return false;
  precise float square = 1.0 + epsilon * (u * u + v * v);
  precise float factor = (f.scale * f.scale) / square;
  c.offset = vec2(ex, ey);
  c.rayLength = sqrt(square);
  c.closest = epsilon != 0.0 ? (f.depth * facing) / square : f.depth;
  precise float kappa = f.middle.x * ey - f.middle.y * ex;
  if (scene.moving == 0) {
    c.nearest = 0.0;
    c.q = ((ex * ex + ey * ey) + epsilon * (kappa * kappa)) * factor;
    if (!(c.q < 1.0)) return false;
    c.profile = profile(c.q, f.plateau, camera.falloff);
    return true;
  }
  // q(s) = a2·s² − 2·a1·s + a0, in units of R².
  precise float eta = f.halfPath.x * v - f.halfPath.y * u;
  precise float a2 = max(((f.halfPath.x * f.halfPath.x + f.halfPath.y * f.halfPath.y) + epsilon * (eta * eta)) * factor, 1e-12);
  precise float a1 = ((ex * f.halfPath.x + ey * f.halfPath.y) - epsilon * (kappa * eta)) * factor;
  c.nearest = min(max(a1 / a2, -1.0), 1.0);
  // About the nearest point: nothing cancels there.
  precise float dx = ex - c.nearest * f.halfPath.x, dy = ey - c.nearest * f.halfPath.y;
  precise float cross = kappa + c.nearest * eta;
  precise float c0 = ((dx * dx + dy * dy) + epsilon * (cross * cross)) * factor;
  c.q = c0;
  if (!(c0 < 1.0)) return false;
  precise float c1 = 2.0 * (a2 * c.nearest - a1);  // slope there: 0 unless the nearest point is an end
  precise float root = sqrt(max((0.25 * c1) * c1 + a2 * (1.0 - c0), 0.0));
  precise float from = max((-0.5 * c1 - root) / a2, -1.0 - c.nearest);
  precise float to = min((-0.5 * c1 + root) / a2, 1.0 - c.nearest);
  c.profile = 0.5 * (partOfPath(from, 0.0, c0, c1, a2, f.plateau, camera.falloff) +
                      partOfPath(0.0, to, c0, c1, a2, f.plateau, camera.falloff));
  return true;
}

// Share of the particle before an opaque surface at depth `surface`, along the pixel's ray.
float shareBefore(FullFootprint f, Crossing c, float surface) {
  precise float halfChord = f.support * sqrt(max(1.0 - c.q, 0.0));
  return cap((surface - c.closest) * c.rayLength, halfChord);
}

// Where a pixel lies on the sprite: [−1, 1]² over the square around the support, v up, stretched along the path.
vec2 spritePoint(FullFootprint f, Crossing c) {
  precise vec2 offset = c.offset * f.scale, path = f.halfPath * f.scale;
  precise float length = sqrt(path.x * path.x + path.y * path.y);
  if (!(length > 1e-6)) return offset;
  precise vec2 along = path / length;
  precise float t = (offset.x * along.x + offset.y * along.y) / (1.0 + length);
  precise float n = offset.y * along.x - offset.x * along.y;
  return vec2(t * along.x - n * along.y, t * along.y + n * along.x);
}

// (1 − e^(−x)) / x, 1 for x = 0.
float meanAttenuation(float x) { return x > 1e-6 ? oneMinusExp(x) / x : 1.0; }

#endif
