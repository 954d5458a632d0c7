// What a full splat does to a pixel: opacity and radiance of each colour. Twin of shaders/glsl/lib/full_splat.glsl,
// operation by operation.
#pragma once
#include "host/splat/full_footprint.h"
#include "host/splat/splat_set.h"
#include "host/splat/sprite.h"

namespace mote {

struct SplatSample {
  vec3 alpha;   ///< opacity of each colour
  vec3 color;   ///< premultiplied radiance
  float depth;  ///< optical depth that it adds to the pixel's, mean of the colours
};

/// `at` in pixels, `surface` the depth of an opaque surface there. False where the pixel is not covered.
inline bool sampleSplat(const SplatSet& set, const FullFootprint& f, std::size_t index, const vec2& at, float surface,
                        SplatSample& s) {
  Crossing c;
  if (!crossSplat(f, at, set.scene, c)) return false;
  const layout::SplatParticle& particle = set.particles[index];
  float weight = f.peakScale * c.profile;
  weight *= shareBefore(f, c, surface);
  float opacity = f.opacity;
  const vec2 point = spritePoint(f, c);
  if (!set.spriteOpacity.empty())
    opacity *= spriteAt(set.spriteOpacity, set.scene.spriteOpacityWidth, set.scene.spriteOpacityHeight, point);
  vec3 depth(particle.peak * weight);
  if (!set.extinction.empty()) depth *= set.extinction[index];
  s.alpha = opacity * vec3(oneMinusExp(depth.x), oneMinusExp(depth.y), oneMinusExp(depth.z));
  s.color = s.alpha * particle.radiance;
  if (!set.emission.empty()) {
    const vec3 attenuation(meanAttenuation(depth.x), meanAttenuation(depth.y), meanAttenuation(depth.z));
    s.color += (opacity * weight) * (set.emission[index] * attenuation);
  }
  if (!set.spriteColor.empty())
    s.color *= vec3(spriteAt(set.spriteColor, set.scene.spriteColorWidth, set.scene.spriteColorHeight, point));
  s.depth = opacity * (((depth.x + depth.y) + depth.z) / 3.0f);
  return true;
}

}  // namespace mote
