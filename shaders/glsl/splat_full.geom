// Full splats, stage 2 of 3: the rectangle becomes a quad.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "layout/splat_scene.h"

layout(points) in;
layout(triangle_strip, max_vertices = 4) out;
layout(push_constant, scalar) uniform Push { SplatFullParams params; };

layout(location = 0) in vec4 rectangleIn[];
layout(location = 1) in uint particleIn[];
layout(location = 0) flat out uint particle;

void emitCorner(vec2 corner) {
  gl_Position = vec4(corner / params.scene.at[0].camera.imageSize * 2.0 - 1.0, 0.5, 1.0);
  particle = particleIn[0];
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
