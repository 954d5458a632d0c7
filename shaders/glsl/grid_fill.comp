// Puts kernels down on the light grid: one lane a work, the particles of one group of bins over 4 × 4 nodes.
//
// A lane takes two particles at a time to all 16 nodes and 4 bins; the 64 sums stay in its registers until they are
// through. So a particle is loaded once for 64 multiply-adds, sums are in the order of the particles on every device,
// and there is no atomic nor barrier, nor anything that lanes tell each other. grid_sum.comp goes on from there.
//
// Neighbouring lanes have about as many particles each (joinWorks). On lavapipe (Mesa 22.3) what is loaded inside of a
// loop costs most, which is why a block is that large, and why kernels come as texels (texel_view.h); loops over nodes
// and bins must unroll, or the sums live in memory. A sum over a subgroup's lanes took 90 cycles for each of the 64.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/grid.glsl"

layout(binding = 0) uniform textureBuffer kernels;   // GridKernel, two texels each
layout(binding = 1) uniform utextureBuffer entries;  // numbers of kernels, two each
layout(constant_id = 1) const uint kFalloff = 0;
layout(constant_id = 2) const bool kTents = true;     // there may be kernels that are tents …
layout(constant_id = 3) const bool kEllipses = true;  // … or have a falloff on the light's plane …
layout(constant_id = 4) const bool kCurved = true;    // … or near a point light
layout(constant_id = 5) const bool kColours = false;

#include "lib/falloff.glsl"

/// The twin of weightOfForm in host/lighting/grid/vectors-inl.h.
float weightOfForm(float q, float slope) {
  if (kFalloff == kFalloffLinear || kFalloff == kFalloffSphere) return falloff(q, kFalloff);
  const float u = 1.0 - q;
  return max(min(u * u, 1.0 - slope * q), 0.0);
}

const uint kTurn = 2;  // particles at once: lavapipe selects what a loop carries anew each time

float sum[kBlockNodes * kBlockBins];  // [bin][row][column]

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

void addParticles(GridKernel all[kTurn], GridWork work) {
  float share[kTurn][kBlockBins], slope[kTurn];
  [[unroll]] for (uint t = 0; t < kTurn; ++t) {
    const GridKernel p = all[t];
    slope[t] = slopeOf(p);
    float before = depthShare((work.bin - p.depth) * p.inverseRadius);
    [[unroll]] for (uint k = 0; k < kBlockBins; ++k) {
      const float after = depthShare((work.bin + float(k + 1) - p.depth) * p.inverseRadius);
      share[t][k] = p.scale * (after - before);
      before = after;
    }
  }
  [[unroll]] for (uint r = 0; r < kBlockEdge; ++r) {
    [[unroll]] for (uint c = 0; c < kBlockEdge; ++c) {
      const vec2 uv = vec2(work.u + float(c) * params.cell, work.v + float(r) * params.cell);
      float at[kTurn];
      [[unroll]] for (uint t = 0; t < kTurn; ++t) {
        const GridKernel p = all[t];
        const float dy = (work.row + float(r)) - p.y, bdy = p.b * dy, cdy2 = p.c * (dy * dy);
        const float dx = (work.column + float(c)) - p.x;
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

void main() {
  const uint k =
      (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
  if (k >= params.count) return;
  const GridWork work = params.works.at[k];
  [[unroll]] for (uint j = 0; j < kBlockNodes * kBlockBins; ++j) sum[j] = 0.0;
  uint at = work.first;
  const uint last = work.end - 1;
  do {
    const uvec2 pair = texelFetch(entries, int(at / kTurn)).xy;
    GridKernel all[kTurn];
    [[unroll]] for (uint t = 0; t < kTurn; ++t) {
      all[t] = kernelAt(int(pair[t]));
      all[t].scale = at <= last ? all[t].scale : 0.0;
      ++at;
    }
    addParticles(all, work);
  } while (at <= last);
  WordPairBuffer to = WordPairBuffer(params.sums);
  [[unroll]] for (uint j = 0; j < kBlockPairs / 2; ++j)
    to.at[work.sums * (kBlockPairs / 2) + j] = pack64(floatBitsToUint(vec2(sum[2 * j], sum[2 * j + 1])));
}
