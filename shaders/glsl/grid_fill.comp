// Puts kernels down on the light grid: one lane a work, the particles of one group of bins over 4 × 4 nodes.
//
// A lane takes four particles at a time to all 16 nodes and 4 bins; the 64 sums stay in its registers until they are
// through (with what the four need, about half of what a lane may have on hardware). So a particle is loaded once for 64
// multiply-adds, sums are in the order of the particles on every device, and there is no atomic nor barrier, nor anything
// that lanes tell each other. grid_sum.comp goes on from there.
//
// Neighbouring lanes have about as many particles each (joinWorks). On lavapipe (Mesa 22.3) what is loaded inside of a
// loop costs most, which is why a block is that large, and why kernels come as texels (texel_view.h), of which tents of
// one radius need half; what a loop carries is selected anew each time, which is why four go at once; loops over nodes and
// bins must unroll, or the sums live in memory. A sum over a subgroup's lanes took 90 cycles for each of the 64.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/grid.glsl"

layout(binding = 0) uniform textureBuffer kernels;   // GridKernel, two texels each
layout(binding = 1) uniform utextureBuffer entries;  // numbers of kernels, kEntriesAtOnce each
layout(constant_id = 1) const uint kFalloff = 0;
layout(constant_id = 2) const bool kTents = true;     // there may be kernels that are tents …
layout(constant_id = 3) const bool kEllipses = true;  // … or have a falloff on the light's plane …
layout(constant_id = 4) const bool kCurved = true;    // … or near a point light
layout(constant_id = 5) const bool kColours = false;
layout(constant_id = 6) const bool kSeveralRadii = true;

// Else all is known of a kernel but its first texel.
const bool kForms = kEllipses || kCurved || kSeveralRadii;

#include "lib/falloff.glsl"

/// The twin of weightOfForm in host/lighting/grid/vectors-inl.h, of rest = 1 − q.
float weightOfForm(float rest, float slope) {
  if (kFalloff == kFalloffLinear || kFalloff == kFalloffSphere) return falloff(1.0 - rest, kFalloff);
  return max(min(rest * rest, slope * rest + (1.0 - slope)), 0.0);
}

float sum[kBlockNodes * kBlockBins];  // [bin][row][column]

/// Share of a particle that lies before its centre plus x radii of depth, less a half (depthShare in tile.h).
float depthShare(float x) {
  const float a = clamp(x, -1.0, 1.0), a2 = a * a;
  return a * (0.9 - 0.5 * a2 + 0.1 * (abs(a) * (a2 * a2)));
}

/// q = a·Δx² + b·Δx·Δy + c·Δy² of a kernel that is not curved.
struct Form {
  float a, b, c;
};
Form formOf(GridKernel p, GridWork work) {
  const vec2 uv = vec2(work.u, work.v) + (vec2(p.x, p.y) - vec2(work.column, work.row)) * params.cell;
  const vec2 across = p.form * uv;
  return Form(p.form + across.y * uv.y, -2.0 * (across.x * uv.y), p.form + across.x * uv.x);
}

/// `row`: 1 − c·Δy², b·Δy.
float weightAt(GridKernel p, Form form, vec2 row, float dx, float dy, vec2 uv) {
  const float tent = kTents ? max(1.0 - abs(dx), 0.0) * max(1.0 - abs(dy), 0.0) : 0.0;
  if (!kEllipses && !kCurved) return tent;
  float rest = row.x - (form.a * dx + row.y) * dx;
  if (kCurved) {
    const float across = dx * uv.y - dy * uv.x;
    const float q = p.form * (dx * dx + dy * dy + across * across) / (1.0 + uv.x * uv.x + uv.y * uv.y);
    rest = p.curved > 0.0 ? 1.0 - q : rest;
  }
  const float value = weightOfForm(rest, p.slope);
  return kTents && p.form == 0.0 ? tent : value;
}

GridKernel kernelAt(int i, GridWork work) {
  const vec4 place = texelFetch(kernels, 2 * i);
  const vec4 form = kForms ? texelFetch(kernels, 2 * i + 1) : vec4(0.0, 0.0, 0.0, work.inverseRadius);
  const float scale = kColours ? place.w * params.peaks.at[i] : place.w;
  return GridKernel(place.x, place.y, place.z, scale, form.x, form.y, form.z, form.w);
}

void addParticles(GridKernel all[kEntriesAtOnce], GridWork work) {
  float share[kEntriesAtOnce][kBlockBins];
  Form form[kEntriesAtOnce];
  [[unroll]] for (uint t = 0; t < kEntriesAtOnce; ++t) {
    const GridKernel p = all[t];
    form[t] = formOf(p, work);
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
      float at[kEntriesAtOnce];
      [[unroll]] for (uint t = 0; t < kEntriesAtOnce; ++t) {
        const GridKernel p = all[t];
        const float dy = (work.row + float(r)) - p.y, dx = (work.column + float(c)) - p.x;
        at[t] = weightAt(p, form[t], vec2(1.0 - form[t].c * (dy * dy), form[t].b * dy), dx, dy, uv);
      }
      [[unroll]] for (uint k = 0; k < kBlockBins; ++k) {
        float more = at[0] * share[0][k];
        [[unroll]] for (uint t = 1; t < kEntriesAtOnce; ++t) more += at[t] * share[t][k];
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
    const uvec4 numbers = texelFetch(entries, int(at / kEntriesAtOnce));
    GridKernel all[kEntriesAtOnce];
    [[unroll]] for (uint t = 0; t < kEntriesAtOnce; ++t) {
      all[t] = kernelAt(int(numbers[t]), work);
      all[t].scale = at <= last ? all[t].scale : 0.0;
      ++at;
    }
    addParticles(all, work);
  } while (at <= last);
  WordPairBuffer to = WordPairBuffer(params.sums);
  [[unroll]] for (uint j = 0; j < kBlockPairs / 2; ++j)
    to.at[work.sums * (kBlockPairs / 2) + j] = pack64(floatBitsToUint(vec2(sum[2 * j], sum[2 * j + 1])));
}
