// Full splats, stage 1 of 3: a particle of the sorted order becomes the rectangle that it may cover.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/full_footprint.glsl"

layout(push_constant, scalar) uniform Push { SplatFullParams params; };

layout(location = 0) out vec4 rectangle;  // [pixels]: left, top, right, bottom; empty where nothing is seen
layout(location = 1) out uint particle;

void main() {
  SplatScene scene = params.scene.at[0];
  particle = gl_VertexIndex;
  vec3 velocity = vec3(0.0);
  if (uint64_t(scene.velocity) != 0) velocity = scene.velocity.at[gl_VertexIndex];
  FullFootprint f;
  rectangle = vec4(0.0);
  if (makeFullFootprint(scene.particles.at[gl_VertexIndex], velocity, scene, f))
    rectangle = vec4(ceil(max(f.lo - 0.5, vec2(0.0))), floor(f.hi + 0.5));  // whole pixels, as in splat.vert
}
