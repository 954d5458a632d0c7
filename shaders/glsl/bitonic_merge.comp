// Several steps of a bitonic network in registers (Batcher 1968, in the form whose comparisons all point one way): each
// invocation loads 2^m pairs, does m steps of the network on them and stores them.
//
// Stage s merges sorted blocks of 2^(s-1) into blocks of 2^s in s steps. The first, "flip", compares element i of a
// block with its mirror image; step "disperse" j compares i with i + j, for j = 2^(s-2) … 1. Smaller always goes to the
// smaller index, so elements beyond `count` may be taken for +infinity: no comparison would ever move them. All of them
// are the one pair in slot `count`, which the host sets to the greatest value: addresses are clamped instead of
// guarded, because a branch around each access costs lavapipe half of its speed.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "layout/sort.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint kLog2Elements = 3;  // m
layout(constant_id = 2) const uint kWork = kSortBlocks;
const uint kElements = 1u << kLog2Elements;
layout(push_constant, scalar) uniform Push { SortParams params; };

// A SortPair as one number: key above index. One 64-bit access is 1.6 times as fast on lavapipe as two of 32.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer WidePairBuffer { uint64_t at[]; };

uint64_t pairs[kElements];

void order(uint a, uint b) {
  const uint64_t first = pairs[a], second = pairs[b];
  pairs[a] = min(first, second);
  pairs[b] = max(first, second);
}

// Loops count up by one, as often as a constant says: others are not unrolled by every compiler (Mesa 22.3 knows no
// shifts), and an array that a loop indexes is not kept in registers.
void flip(uint log2Size) {
  const uint size = 1u << log2Size;
  [[unroll]] for (uint i = 0; i < kElements; ++i)
    if ((i & (size >> 1)) == 0) order(i, i ^ (size - 1));
}

void disperse(uint log2Size) {
  [[unroll]] for (uint step = 0; step < kLog2Elements; ++step)
    if (step < log2Size) {
      const uint j = (1u << log2Size) >> (step + 1);
      [[unroll]] for (uint i = 0; i < kElements; ++i)
        if ((i & j) == 0) order(i, i + j);
    }
}

void main() {
  const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  const uint q = group * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
  // The pairs of an invocation stand `stride` apart in a block of stride · kElements; neighbours hold neighbours.
  const uint stride = 1u << params.log2Stride;
  const uint low = q & (stride - 1);
  const uint base = (q >> params.log2Stride) << (params.log2Stride + kLog2Elements);
  if (base + low >= params.count) return;

  uint slots[kElements];
  [[unroll]] for (uint t = 0; t < kElements; ++t) {
    // A flip pairs slot (t, low) with (~t, ~low): holding the mirrored half keeps it and the next steps in here.
    const bool mirrored = kWork == kSortFlip && t >= kElements / 2;
    slots[t] = min(base + t * stride + (mirrored ? stride - 1 - low : low), params.count);
  }
  WidePairBuffer wide = WidePairBuffer(params.pairs);
  [[unroll]] for (uint t = 0; t < kElements; ++t) pairs[t] = wide.at[slots[t]];
  if (kWork == kSortBlocks) {
    [[unroll]] for (uint log2Size = 1; log2Size <= kLog2Elements; ++log2Size) {
      flip(log2Size);
      disperse(log2Size - 1);
    }
  } else if (kWork == kSortFlip) {
    flip(kLog2Elements);
    disperse(kLog2Elements - 1);
  } else {
    disperse(kLog2Elements);
  }
  [[unroll]] for (uint t = 0; t < kElements; ++t) wide.at[slots[t]] = pairs[t];
}
