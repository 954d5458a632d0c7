// Puts kernels down on the light grid and sums along the depth: one subgroup a strand, all groups of bins over 4 × 4 nodes.
//
// A lane takes two particles at a time to all 16 nodes and 4 bins; the 64 sums stay in its registers until the block's
// particles are through. Then they are added up over the lanes, always in the same order, and on what the blocks before
// left. So a particle is loaded once for 64 multiply-adds, stores are side by side, and there is no atomic nor barrier.
//
// On lavapipe (Mesa 22.3) what is loaded inside of a loop costs most, which is why a block is that large, and why kernels
// come as texels (texel_view.h); loops over nodes and bins must unroll, or the sums live in memory.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/grid.glsl"

layout(binding = 0) uniform textureBuffer kernels;   // GridKernel, two texels each
layout(binding = 1) uniform utextureBuffer entries;  // numbers of kernels, block after block
layout(constant_id = 1) const uint kFalloff = 0;
layout(constant_id = 2) const bool kTents = true;     // there may be kernels that are tents …
layout(constant_id = 3) const bool kEllipses = true;  // … or have a falloff on the light's plane …
layout(constant_id = 4) const bool kCurved = true;    // … or near a point light
layout(constant_id = 5) const bool kGoesOn = false;   // the strand's first block has sums already
layout(constant_id = 6) const uint kStoreLanes = 4;   // at most as many as a subgroup has lanes; divides 16
layout(constant_id = 7) const bool kColours = false;

#include "lib/falloff.glsl"

/// The twin of weightOfForm in host/lighting/grid/vectors-inl.h.
float weightOfForm(float q, float slope) {
  if (kFalloff == kFalloffLinear || kFalloff == kFalloffSphere) return falloff(q, kFalloff);
  const float u = 1.0 - q;
  return max(min(u * u, 1.0 - slope * q), 0.0);
}

const uint kChunks = kBlockNodes / kStoreLanes;
const uint kMostChunks = kBlockNodes;
const uint kTurn = 2;  // particles of a lane at once: lavapipe selects what a loop carries anew each time

float sum[kBlockNodes * kBlockBins];  // of the lane's particles, [bin][row][column]
float carry[kMostChunks];             // the lane's nodes of each chunk: what lies before the block

/// Share of a particle that lies before its centre plus x radii of depth.
float depthShare(float x) {
  const float a = min(abs(x), 1.0), a2 = a * a;
  const float part = 0.9 * a - 0.5 * (a2 * a) + 0.1 * (a2 * a2 * a2);
  return x < 0.0 ? 0.5 - part : 0.5 + part;
}

/// GridParticles::slope: the form's greater eigenvalue is 1 / the narrowed square of the radius [1 / cells²].
float slopeOf(GridKernel p) {
  float inverse = p.a;
  if (!kCurved || p.c >= 0.0) inverse = 0.5 * (p.a + p.c + length(vec2(p.a - p.c, p.b)));
  return 1.0 / max(kGridSmoothSupport, 1.0 - kGridSmoothMargin * sqrt(inverse));
}

float weightAt(GridKernel p, float slope, float dx, float dy, float bdy, float cdy2, vec2 uv) {
  const float tent = kTents ? max(1.0 - abs(dx), 0.0) * max(1.0 - abs(dy), 0.0) : 0.0;
  if (!kEllipses && !kCurved) return tent;
  float q = (p.a * dx + bdy) * dx + cdy2;
  if (kCurved) {
    const float across = dx * uv.y - dy * uv.x;
    q = p.c < 0.0 ? p.a * (dx * dx + dy * dy + across * across) / (1.0 + uv.x * uv.x + uv.y * uv.y) : q;
  }
  const float value = weightOfForm(q, slope);
  return kTents && p.c == 0.0 ? tent : value;
}

GridKernel kernelAt(int i) {
  const vec4 place = texelFetch(kernels, 2 * i), form = texelFetch(kernels, 2 * i + 1);
  const float scale = kColours ? form.w * params.peaks.at[i] : form.w;
  return GridKernel(place.x, place.y, place.z, place.w, form.x, form.y, form.z, scale);
}

void addParticles(GridKernel all[kTurn], GridStrand strand, float bin) {
  float share[kTurn][kBlockBins], slope[kTurn];
  [[unroll]] for (uint t = 0; t < kTurn; ++t) {
    const GridKernel p = all[t];
    slope[t] = slopeOf(p);
    float before = depthShare((bin - p.depth) * p.inverseRadius);
    [[unroll]] for (uint k = 0; k < kBlockBins; ++k) {
      const float after = depthShare((bin + float(k + 1) - p.depth) * p.inverseRadius);
      share[t][k] = p.scale * (after - before);
      before = after;
    }
  }
  [[unroll]] for (uint r = 0; r < kBlockEdge; ++r) {
    [[unroll]] for (uint c = 0; c < kBlockEdge; ++c) {
      const vec2 uv = vec2(strand.u + float(c) * params.cell, strand.v + float(r) * params.cell);
      float at[kTurn];
      [[unroll]] for (uint t = 0; t < kTurn; ++t) {
        const GridKernel p = all[t];
        const float dy = (strand.row + float(r)) - p.y, bdy = p.b * dy, cdy2 = p.c * (dy * dy);
        const float dx = (strand.column + float(c)) - p.x;
        at[t] = weightAt(p, slope[t], dx, dy, bdy, cdy2, uv);
      }
      [[unroll]] for (uint k = 0; k < kBlockBins; ++k) {
        float more = at[0] * share[0][k];
        [[unroll]] for (uint t = 1; t < kTurn; ++t) more += at[t] * share[t][k];
        sum[(k * kBlockEdge + r) * kBlockEdge + c] += more;
      }
    }
  }
}

/// The sums over the lanes, added to what lies before; the next block begins where this one ends.
void storeBlock(uint stored, bool goesOn) {
  WordPairBuffer words = WordPairBuffer(params.stored);
  const uint lane = gl_SubgroupInvocationID, to = stored * kBlockPairs + min(lane, kStoreLanes - 1);
  [[unroll]] for (uint chunk = 0; chunk < kChunks; ++chunk) {
    float sums = 0.0;
    [[unroll]] for (uint k = 0; k < kBlockBins; ++k) {
      const uint node = k * kBlockNodes + chunk * kStoreLanes;
      vec2 edges = vec2(carry[chunk]);
      if (kGoesOn && goesOn) edges = loadFloats(words, to + node);
      edges.x += sums;
      float total = 0.0;
      [[unroll]] for (uint j = 0; j < kStoreLanes; ++j) {
        const float one = subgroupAdd(sum[node + j]);
        total = lane == j ? one : total;
      }
      sums += total;
      edges.y += sums;
      if (lane < kStoreLanes) words.at[to + node] = pack64(floatBitsToUint(edges));
      if (k == kBlockBins - 1) carry[chunk] = edges.y;
    }
  }
}

void main() {
  const uint s = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_NumSubgroups + gl_SubgroupID;
  if (s >= params.count) return;
  const GridStrand strand = params.strands.at[s];
  [[unroll]] for (uint chunk = 0; chunk < kChunks; ++chunk) carry[chunk] = 0.0;
  uint b = strand.first;
  do {
    const GridBlock block = params.blocks.at[b];
    [[unroll]] for (uint j = 0; j < kBlockNodes * kBlockBins; ++j) sum[j] = 0.0;
    uint at = block.first + gl_SubgroupInvocationID;
    const uint last = block.end - 1;
    uint begin = block.first;
    do {
      GridKernel all[kTurn];
      [[unroll]] for (uint t = 0; t < kTurn; ++t) {
        all[t] = kernelAt(int(texelFetch(entries, int(min(at, last))).x));
        all[t].scale = at <= last ? all[t].scale : 0.0;
        at += gl_SubgroupSize, begin += gl_SubgroupSize;
      }
      addParticles(all, strand, block.bin);
    } while (begin <= last);
    storeBlock(block.stored, b == strand.first);
    ++b;
  } while (b < strand.end);
}
