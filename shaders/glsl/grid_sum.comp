// Sums what grid_fill.comp put down along the depth: a lane two neighbouring nodes of a strand, eight lanes a strand.
//
// A stored block is what lies before each edge of its bins. Where it has been begun (by a work before, which has the
// same block), this one's sums are added to what is there. Neighbouring lanes load and store side by side.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/grid.glsl"

layout(binding = 0) uniform textureBuffer sums;    // of two nodes each
layout(constant_id = 1) const bool kBegun = true;  // a block may have been begun

const uint kLanes = kBlockNodes / 2;  // a strand

void main() {
  const uint k =
      (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
  if (k >= params.count * kLanes) return;
  const GridStrand strand = params.strands.at[k / kLanes];
  const uint lane = k % kLanes;
  WordPairBuffer stored = WordPairBuffer(params.stored);
  uint last = strand.before;
  const uint end = last * kBlockPairs + (kBlockBins - 1) * kBlockNodes + 2 * lane;
  vec2 carry = vec2(loadFloats(stored, end).y, loadFloats(stored, end + 1).y);  // of both nodes; block 0 is zeros
  for (uint b = strand.first; b < strand.end; ++b) {
    const uint block = params.blocks.at[b];
    const bool begun = kBegun && block == last;
    vec2 all = vec2(0.0);
    [[unroll]] for (uint bin = 0; bin < kBlockBins; ++bin) {
      const uint to = block * kBlockPairs + bin * kBlockNodes + 2 * lane;
      vec2 before = carry, after = carry;
      if (begun) {
        const vec2 one = loadFloats(stored, to), other = loadFloats(stored, to + 1);
        before = vec2(one.x, other.x), after = vec2(one.y, other.y);
      }
      before += all;
      all += texelFetch(sums, int(b * (kBlockPairs / 2) + bin * (kBlockNodes / 2) + lane)).xy;
      after += all;
      stored.at[to] = pack64(floatBitsToUint(vec2(before.x, after.x)));
      stored.at[to + 1] = pack64(floatBitsToUint(vec2(before.y, after.y)));
      if (bin == kBlockBins - 1) carry = after;
    }
    last = block;
  }
}
