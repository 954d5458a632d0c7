// Full splats, stage 3 of 3: radiance and opacity of each colour, blended over with two sources: what is added, and how
// much of what lies behind it takes.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/full_splat.glsl"

layout(push_constant, scalar) uniform Push { SplatFullParams params; };

layout(location = 0) flat in uint particle;

layout(location = 0, index = 0) out vec4 color;
layout(location = 0, index = 1) out vec4 taken;

void main() {
  SplatScene scene = params.scene.at[0];
  vec3 velocity = vec3(0.0);
  if (uint64_t(scene.velocity) != 0) velocity = scene.velocity.at[particle];
  FullFootprint f;
  SplatSample s;
  // The footprint again, from the same numbers: cheaper than twenty interpolants, and exact.
  if (!makeFullFootprint(scene.particles.at[particle], velocity, scene, f) ||
      !sampleSplat(scene, f, particle, gl_FragCoord.xy, s))
    discard;
  const float alpha = ((s.alpha.x + s.alpha.y) + s.alpha.z) / 3.0;
  color = vec4(params.alphaOnly != 0 ? s.alpha : s.color, alpha);
  taken = vec4(s.alpha, alpha);
}
