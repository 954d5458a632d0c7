// What the grid_*.comp share. C++ twins: host/lighting/grid_tile.h and grid_fill_simd.cpp, operation by operation.
#ifndef MOTE_LIB_GRID_GLSL
#define MOTE_LIB_GRID_GLSL
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "../layout/grid.h"

// Two neighbouring words at once: on lavapipe a load costs by its number, not by its size.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer WordPairBuffer { uint64_t at[]; };

layout(local_size_x_id = 0) in;  // a multiple of every subgroup size that the device may choose
layout(constant_id = 1) const uint kFalloff = 0;

layout(push_constant, scalar) uniform Push { GridParams params; };

uint invocationOfDispatch() {
  return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
}

/// Share of a particle that lies before its centre plus x radii of depth.
float depthShare(float x) {
  const float a = min(abs(x), 1.0), a2 = a * a;
  const float part = 0.9 * a - 0.5 * (a2 * a) + 0.1 * (a2 * a2 * a2);
  return x < 0.0 ? 0.5 - part : 0.5 + part;
}

uvec2 loadPair(WordPairBuffer from, uint index) { return unpack32(from.at[index]); }
vec2 loadFloats(WordPairBuffer from, uint index) { return uintBitsToFloat(loadPair(from, index)); }

const uint kKernelPairs = 6;  // of a GridKernel
const uint kReceiverPairs = 3;

float between(float from, float to, float at) { return from + at * (to - from); }

#endif
