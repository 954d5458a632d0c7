// What a receiver reads from the light grid: between four nodes and the two edges of its bin, without what its own
// particle put there. One lane a receiver; neighbours read the same blocks.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/grid.glsl"

layout(binding = 0) uniform textureBuffer stored;      // GridPair
layout(binding = 1) uniform utextureBuffer places;     // GridPlaces
layout(binding = 2) uniform utextureBuffer receivers;  // GridReceiver

void main() {
  const uint k =
      (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
  if (k >= params.count) return;
  const uvec4 receiver = texelFetch(receivers, int(k));
  const vec2 xy = uintBitsToFloat(receiver.xy);
  const uint table = receiver.w / kBlockBins, bin = receiver.w % kBlockBins;
  const vec2 below = clamp(floor(xy), 0.0, float(kBlockEdge * (kTileBlocks - 1) - 1)), into = xy - below;
  const uint column = uint(below.x), row = uint(below.y);
  const uvec4 around = texelFetch(places, int(table + row / kBlockEdge * kTileBlocks + column / kBlockEdge));
  vec2 edges[4];
  [[unroll]] for (uint corner = 0; corner < 4; ++corner) {
    const uint c = column + corner % 2, r = row + corner / 2;
    const uvec2 beside = r / kBlockEdge == row / kBlockEdge ? around.xy : around.zw;
    const uint entry = c / kBlockEdge == column / kBlockEdge ? beside.x : beside.y;
    const bool here = (entry & 1u) != 0;  // else all lies before: the last edge of the block that it names
    const uint node = (here ? bin : kBlockBins - 1) * kBlockNodes + r % kBlockEdge * kBlockEdge + c % kBlockEdge;
    edges[corner] = texelFetch(stored, int((entry >> 1) * kBlockPairs + node)).xy;
    edges[corner].x = here ? edges[corner].x : edges[corner].y;
  }
  const vec2 upper = edges[0] + into.x * (edges[1] - edges[0]), lower = edges[2] + into.x * (edges[3] - edges[2]);
  const vec2 both = upper + into.y * (lower - upper);
  const float depth = both.x + uintBitsToFloat(receiver.z) * (both.y - both.x);
  params.depths.at[k] = max(depth - params.depths.at[k], 0.0);
}
