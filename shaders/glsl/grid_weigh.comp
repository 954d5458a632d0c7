// What a particle's weights on the light grid's nodes are multiplied with, and what it finds of itself where it stands:
// one lane a particle, all in registers.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/grid.glsl"

#include "lib/falloff.glsl"

float weightAt(GridKernel p, float dx, float dy) {
  const float tent = max(1.0 - abs(dx), 0.0) * max(1.0 - abs(dy), 0.0);
  const float value = falloff((p.a * dx + p.b * dy) * dx + p.c * (dy * dy), kFalloff);
  return p.c == 0.0 ? tent : value;
}

float sumOfWeights(GridKernel p) {
  // The window has all that are nearer than half its nodes to the centre.
  const vec2 middle = floor((p.window & 1u) == 0 ? vec2(p.x, p.y) : vec2(p.x, p.y) + 0.5);
  const vec2 at = vec2(p.x, p.y) - (middle - float((p.window - 1) / 2));
  float sum = 0.0;
  uint row = 0;
  do {
    uint column = 0;
    do {
      // Eight nodes at a time; those beyond the window weigh nothing.
      [[unroll]] for (uint k = 0; k < 8; ++k)
        sum += weightAt(p, float(column + k % 4) - at.x, float(row + k / 4) - at.y);
      column += 4;
    } while (column < p.window);
    row += 2;
  } while (row < p.window);
  return sum;
}

/// The share of its peak that it finds of itself, as a receiver reads: between four nodes, and between the edges of a
/// bin.
float ownShare(GridKernel p, float scale) {
  const vec2 below = floor(vec2(p.x, p.y)), into = vec2(p.x, p.y) - below;
  const float lower = between(weightAt(p, -into.x, -into.y), weightAt(p, 1.0 - into.x, -into.y), into.x);
  const float upper = between(weightAt(p, -into.x, 1.0 - into.y), weightAt(p, 1.0 - into.x, 1.0 - into.y), into.x);
  const float bin = floor(p.place);
  const float before = depthShare((bin - p.depth) * p.inverseRadius);
  const float after = depthShare((bin + 1.0 - p.depth) * p.inverseRadius);
  return scale * between(lower, upper, into.y) * between(before, after, p.place - bin);
}

void main() {
  const uint i = invocationOfDispatch();
  if (i >= params.count) return;
  WordPairBuffer words = WordPairBuffer(params.kernels);
  const uint first = i * kKernelPairs;
  const vec2 xy = loadFloats(words, first), along = loadFloats(words, first + 1), ab = loadFloats(words, first + 2),
             c = loadFloats(words, first + 3), placeMass = loadFloats(words, first + 4);
  const GridKernel p = GridKernel(xy.x, xy.y, along.x, along.y, ab.x, ab.y, c.x, 0.0, placeMass.x, placeMass.y,
                                  params.kernels.at[i].window, 0.0);
  const float peak = params.peaks.at[i];
  float scale = p.mass, own = p.place;
  if (p.window != 0) {
    scale = p.mass / sumOfWeights(p);
    own = ownShare(p, scale);
  }
  params.kernels.at[i].weight = scale * peak;
  params.kernels.at[i].own = own * peak;
}
