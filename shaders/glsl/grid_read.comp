// What a receiver reads from the light grid: between four nodes and the two edges of its bin, without what its own
// particle put there. One lane a receiver; neighbours read the same blocks.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/grid.glsl"

void main() {
  const uint k =
      (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
  if (k >= params.count) return;
  WordPairBuffer words = WordPairBuffer(params.receivers), stored = WordPairBuffer(params.stored),
                 places = WordPairBuffer(params.table);
  const vec2 xy = loadFloats(words, 2 * k);
  const uvec2 along = loadPair(words, 2 * k + 1);
  const uint table = along.y / kBlockBins, bin = along.y % kBlockBins;
  const vec2 below = clamp(floor(xy), 0.0, float(kBlockEdge * (kTileBlocks - 1) - 1)), into = xy - below;
  const uint column = uint(below.x), row = uint(below.y), block = table + column / kBlockEdge;
  const uvec2 entries[2] = {loadPair(places, block + row / kBlockEdge * kTileBlocks),
                            loadPair(places, block + (row + 1) / kBlockEdge * kTileBlocks)};
  vec2 edges[4];
  [[unroll]] for (uint corner = 0; corner < 4; ++corner) {
    const uint c = column + corner % 2, r = row + corner / 2;
    const uint entry = c / kBlockEdge == column / kBlockEdge ? entries[corner / 2].x : entries[corner / 2].y;
    const bool here = (entry & 1u) != 0;  // else all lies before: the last edge of the block that it names
    const uint node = (here ? bin : kBlockBins - 1) * kBlockNodes + r % kBlockEdge * kBlockEdge + c % kBlockEdge;
    edges[corner] = loadFloats(stored, (entry >> 1) * kBlockPairs + node);
    edges[corner].x = here ? edges[corner].x : edges[corner].y;
  }
  const vec2 upper = edges[0] + into.x * (edges[1] - edges[0]), lower = edges[2] + into.x * (edges[3] - edges[2]);
  const vec2 both = upper + into.y * (lower - upper);
  const float depth = both.x + uintBitsToFloat(along.x) * (both.y - both.x);
  params.depths.at[k] = max(depth - params.depths.at[k], 0.0);
}
