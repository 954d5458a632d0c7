// What the grid_*.comp share. C++ twins: tile.h and fill_simd.cpp in host/lighting/grid, operation by operation.
#ifndef MOTE_LIB_GRID_GLSL
#define MOTE_LIB_GRID_GLSL
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "../layout/grid.h"

// Two neighbouring words at once: on lavapipe a load costs by its number, not by its size.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer WordPairBuffer { uint64_t at[]; };

layout(local_size_x_id = 0) in;  // a multiple of every subgroup size that the device may choose

layout(push_constant, scalar) uniform Push { GridParams params; };

uvec2 loadPair(WordPairBuffer from, uint index) { return unpack32(from.at[index]); }
vec2 loadFloats(WordPairBuffer from, uint index) { return uintBitsToFloat(loadPair(from, index)); }

#endif
