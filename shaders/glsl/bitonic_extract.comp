// The order alone, as an index buffer: index k is that of sorted pair k. One pair an invocation.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout/sort.h"

layout(local_size_x_id = 0) in;
layout(push_constant, scalar) uniform Push { SortParams params; };

void main() {
  const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  const uint k = group * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
  if (k < params.count) params.indices.at[k] = params.pairs.at[k].index;
}
