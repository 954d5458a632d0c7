// Splats, stage 1 of 3: a particle of the sorted order becomes its footprint on the picture.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout/splat_params.h"
#include "lib/footprint.glsl"

layout(push_constant, scalar) uniform Push { SplatParams params; };

layout(location = 0) out vec4 centreAndPeak;       // of the footprint, and the optical depth through the centre
layout(location = 1) out vec4 imageAndPixel;       // of the footprint
layout(location = 2) out vec4 radianceAndOpacity;  // of the particle, of the footprint
layout(location = 3) out float depth;              // of the footprint [scene units]
layout(location = 4) out vec4 rectangle;           // [pixels]: left, top, right, bottom; empty where nothing is seen

void main() {
  const SplatParticle particle = params.particles.at[gl_VertexIndex];
  Footprint f;
  if (!makeFootprint(particle.position, particle.radius, params.camera, f)) {
    rectangle = vec4(0.0);
    return;
  }
  centreAndPeak = vec4(f.centre, particle.peak);
  imageAndPixel = vec4(f.image, f.pixel);
  radianceAndOpacity = vec4(particle.radiance, f.opacity);
  depth = f.depth;
  // The pixels whose centre lies inside [lo, hi], exactly those that the host's rasteriser visits. The corners are whole
  // pixels, so the device's rounding of vertex positions (1/16 to 1/256 pixel) neither loses nor adds a pixel centre.
  rectangle = vec4(ceil(max(f.lo - 0.5, vec2(0.0))), floor(f.hi + 0.5));
}
