// What a receiver reads from the light grid: between four nodes and the two edges of its bin, without what its own
// particle put there. One lane a receiver; neighbours read the same blocks.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/grid.glsl"

const uint kNone = 0xffffffffu;

void main() {
  const uint k = invocationOfDispatch();
  if (k >= params.count) return;
  const GridReceiver r = params.receivers.at[k];
  const vec2 below = clamp(floor(vec2(r.x, r.y)), 0.0, float(kBlockEdge * (kTileBlocks - 1) - 1));
  const vec2 into = vec2(r.x, r.y) - below;
  float before[4], after[4];
  [[unroll]] for (uint corner = 0; corner < 4; ++corner) {
    const uint column = uint(below.x) + (corner & 1u), row = uint(below.y) + (corner >> 1);
    const uint entry = params.table.at[r.table + row / kBlockEdge * kTileBlocks + column / kBlockEdge];
    const uint node = (entry >> 1) * kBlockFloats + row % kBlockEdge * kBlockEdge + column % kBlockEdge;
    const bool here = (entry & 1u) != 0;  // else all edges are the last of what lies before
    before[corner] = params.stored.at[node + (here ? r.bin : kBlockBins) * kBlockNodes];
    after[corner] = params.stored.at[node + (here ? r.bin + 1 : kBlockBins) * kBlockNodes];
  }
  const float near = between(between(before[0], before[1], into.x), between(before[2], before[3], into.x), into.y);
  const float far = between(between(after[0], after[1], into.x), between(after[2], after[3], into.x), into.y);
  const float own = r.self == kNone ? 0.0 : params.own.at[r.self];
  const float depth = between(near, far, r.into);
  params.depths.at[k] = r.self == kNone ? depth : max(depth - own, 0.0);
}
