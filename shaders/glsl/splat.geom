// Splats, stage 2 of 3: a footprint becomes a quad that faces the camera; one that covers no pixel centre becomes nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout/splat_params.h"

layout(points) in;
layout(triangle_strip, max_vertices = 4) out;
layout(push_constant, scalar) uniform Push { SplatParams params; };

layout(location = 0) in vec4 centreAndPeakIn[];
layout(location = 1) in vec4 imageAndPixelIn[];
layout(location = 2) in vec4 radianceAndOpacityIn[];
layout(location = 3) in float depthIn[];
layout(location = 4) in vec4 rectangleIn[];

layout(location = 0) flat out vec4 centreAndPeak;
layout(location = 1) flat out vec4 imageAndPixel;
layout(location = 2) flat out vec4 radianceAndOpacity;
layout(location = 3) flat out float depth;

void emitCorner(vec2 corner) {
  // z only has to lie in the view volume; near and far have been decided by the centre's depth.
  gl_Position = vec4(corner / params.camera.imageSize * 2.0 - 1.0, 0.5, 1.0);
  centreAndPeak = centreAndPeakIn[0];
  imageAndPixel = imageAndPixelIn[0];
  radianceAndOpacity = radianceAndOpacityIn[0];
  depth = depthIn[0];
  EmitVertex();
}

void main() {
  const vec4 r = rectangleIn[0];
  if (r.x >= r.z || r.y >= r.w) return;
  emitCorner(r.xy);
  emitCorner(r.zy);
  emitCorner(r.xw);
  emitCorner(r.zw);
}
