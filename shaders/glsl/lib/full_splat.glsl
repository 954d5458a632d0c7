// What a full splat does to a pixel: opacity and radiance of each colour. C++ twin: host/splat/full_splat.h.
#ifndef MOTE_LIB_FULL_SPLAT_GLSL
#define MOTE_LIB_FULL_SPLAT_GLSL
#include "full_footprint.glsl"
#include "sprite.glsl"

struct SplatSample {
  vec3 alpha;    // opacity of each colour
  vec3 color;    // premultiplied radiance
  float depth;   // optical depth that it adds to the pixel's, mean of the colours
};

// `at` in pixels; false where the pixel is not covered.
bool sampleSplat(SplatScene scene, FullFootprint f, uint index, vec2 at, out SplatSample s) {
  Crossing c;
  if (!crossSplat(f, at, scene, c)) return false;
  const SplatParticle particle = scene.particles.at[index];
  precise float weight = f.peakScale * c.profile;
  if (uint64_t(scene.solidDepth) != 0) {
    const float surface = scene.solidDepth.at[uint(at.y) * uint(scene.camera.imageSize.x) + uint(at.x)];
    if (surface == kPixelLeftOut) return false;
    weight *= shareBefore(f, c, surface);
  }
  precise float opacity = f.opacity;
  const vec2 point = spritePoint(f, c);
  if (uint64_t(scene.spriteOpacity) != 0) opacity *= spriteOpacityAt(scene, point);
  precise vec3 depth = vec3(particle.peak * weight);
  if (uint64_t(scene.extinction) != 0) depth *= scene.extinction.at[index];
  s.alpha = opacity * vec3(oneMinusExp(depth.x), oneMinusExp(depth.y), oneMinusExp(depth.z));
  s.color = s.alpha * particle.radiance;
  if (uint64_t(scene.emission) != 0) {
    precise vec3 attenuation =
        vec3(meanAttenuation(depth.x), meanAttenuation(depth.y), meanAttenuation(depth.z));
    s.color += (opacity * weight) * (scene.emission.at[index] * attenuation);
  }
  if (uint64_t(scene.spriteColor) != 0) s.color *= spriteColorAt(scene, point);
  s.depth = opacity * (((depth.x + depth.y) + depth.z) / 3.0);
  return true;
}

#endif
