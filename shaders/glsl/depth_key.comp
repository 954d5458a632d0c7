// Depth keys: one particle an invocation. The formula and its reasons stand in layout/sort.h.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout/sort.h"

layout(local_size_x_id = 0) in;
layout(push_constant, scalar) uniform Push { DepthKeyParams params; };

const float kLeastNormal = 1.17549435e-38;
const float kGreatest = 3.40282347e+38;

vec3 flush(vec3 x) { return mix(x, vec3(0), lessThan(abs(x), vec3(kLeastNormal))); }

void main() {
  const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  const uint k = group * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
  if (k >= params.count) return;
  const vec3 position = params.particles.at[k].position;
  // `precise`: no fused multiply-add, no reordering.
  precise const vec3 difference = flush(position) - flush(params.camera);
  precise const vec3 scaled = flush(difference) * params.scale;
  precise const vec3 weighted = scaled * (params.axis == vec3(0) ? scaled : params.axis);
  const vec3 q = flush(weighted);
  precise const float sum = (q.x + q.y) + q.z;
  // Not max(): of the two zeros it may give either.
  const float s = sum >= kLeastNormal ? min(sum, kGreatest) : 0.0;
  params.pairs.at[k] = SortPair(k, ~floatBitsToUint(s));
}
