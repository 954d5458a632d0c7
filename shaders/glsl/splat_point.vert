// Splats of a few pixels, in two stages: a particle of the sorted order becomes a point that covers its footprint, then
// splat.frag. Beyond the footprint its opacity is 0, so a square draws what the quad of splat.geom does, in three quarters
// of the time on lavapipe.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout/splat_params.h"
#include "lib/footprint.glsl"

layout(push_constant, scalar) uniform Push { SplatParams params; };

layout(location = 0) flat out vec4 centreAndPeak;
layout(location = 1) flat out vec4 imageAndPixel;
layout(location = 2) flat out vec4 radianceAndOpacity;
layout(location = 3) flat out float depth;

void main() {
  gl_Position = vec4(2.0, 2.0, 0.5, 1.0);  // out of the picture
  gl_PointSize = 1.0;
  const SplatParticle particle = params.particles.at[gl_VertexIndex];
  Footprint f;
  if (!makeFootprint(particle.position, particle.radius, params.camera, f)) return;
  centreAndPeak = vec4(f.centre, particle.peak);
  imageAndPixel = vec4(f.image, f.pixel);
  radianceAndOpacity = vec4(particle.radiance, f.opacity);
  depth = f.depth;
  // The rectangle of splat.vert, and a square about its middle with as many pixels as it has in either direction. Whole
  // pixels in x, and in y if both sides are odd or both even; else a pixel more, half on each side.
  const vec2 lo = ceil(max(f.lo - 0.5, vec2(0.0))), hi = floor(f.hi + 0.5), size = hi - lo;
  if (size.x <= 0.0 || size.y <= 0.0) return;
  const float side = max(size.x, size.y);
  const vec2 odd = mod(vec2(side) - size, 2.0);
  const vec2 middle = 0.5 * (lo + hi) - 0.5 * odd;
  gl_Position = vec4(middle / params.camera.imageSize * 2.0 - 1.0, 0.5, 1.0);
  gl_PointSize = side + max(odd.x, odd.y);
}
