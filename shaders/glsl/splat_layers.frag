// Full splats, stage 3 of 3, for the layers: nearest depth, summed optical depth, screen velocity.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "lib/full_splat.glsl"

layout(push_constant, scalar) uniform Push { SplatFullParams params; };

layout(location = 0) flat in uint particle;

layout(constant_id = 0) const float kDepthAlpha = 0.0;  // the least α that counts for the depth layer
layout(constant_id = 1) const float kNoDepth = 0.0;     // blending by minimum keeps what is there

layout(location = 0) out float nearest;       // blended by minimum
layout(location = 1) out float opticalDepth;  // added
layout(location = 2) out vec4 motion;         // blended over: α · velocity [pixels per frame], 0, α

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
  nearest = alpha >= kDepthAlpha ? f.depth : kNoDepth;
  opticalDepth = s.depth;
  motion = vec4(alpha * screenVelocity(scene.particles.at[particle].position, velocity, scene), 0.0, alpha);
}
