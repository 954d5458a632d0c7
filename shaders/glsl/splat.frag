// Splats, stage 3 of 3: opacity of the particle at the pixel's centre (DESIGN §2, view), premultiplied, for blending over.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout/splat_params.h"
#include "lib/footprint.glsl"

layout(constant_id = 0) const uint kFalloff = kFalloffSmooth;
layout(constant_id = 1) const float kDepthAlpha = 0.0;  // the least α that counts for the depth layer
layout(constant_id = 2) const float kNoDepth = 0.0;     // blending by minimum keeps what is there
layout(push_constant, scalar) uniform Push { SplatParams params; };

layout(location = 0) flat in vec4 centreAndPeak;
layout(location = 1) flat in vec4 imageAndPixel;
layout(location = 2) flat in vec4 radianceAndOpacity;
layout(location = 3) flat in float depth;

layout(location = 0) out vec4 color;
layout(location = 1) out float nearest;  // dropped where the target has no depth layer

void main() {
  // From the pixel's exact centre, not from an interpolated coordinate: that would be relative to the picture's corner on
  // some devices and lose the digits of small splats.
  const float q = footprintDistance(centreAndPeak.xyz, imageAndPixel.xy, imageAndPixel.zw, gl_FragCoord.xy,
                                    params.camera.pixelSize);
  const float alpha = footprintAlpha(q, centreAndPeak.w, radianceAndOpacity.w, kFalloff);
  color = vec4(alpha * radianceAndOpacity.rgb, alpha);
  nearest = alpha >= kDepthAlpha ? depth : kNoDepth;
}
