// Which points a solid keeps from a light: one ray an invocation (thesis §4.4).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/solid_walk.glsl"

layout(local_size_x_id = 0) in;
layout(push_constant, scalar) uniform Push { SolidShadowParams params; };

void main() {
  const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  const uint ray = group * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
  if (ray >= params.rayCount) return;
  const vec3 origin = vec3(params.x.at[ray], params.y.at[ray], params.z.at[ray]);
  const Node root = params.nodes.at[0];
  const SolidRay toLight =
      makeSolidRay(origin, params.lightPosition, params.lightDirection, params.lightType, root.lo, root.hi);
  params.occluded.at[ray] = anyBlocks(params.nodes, params.nodeCount, params.triangles, toLight) ? 1u : 0u;
}
