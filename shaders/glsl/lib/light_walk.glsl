// Optical depth from receivers (particles, points of surfaces) toward one light: the walk of host/lighting over the same flattened tree.
//
// A subgroup walks the tree as one: a node is entered if any of its rays touches the box, so node and particle addresses
// are the same in every lane. On hardware such loads are one transaction a subgroup and there is no divergence; on
// lavapipe they are scalar loads. Rays are ordered so that a subgroup's lie almost behind one another (`order`), which
// keeps the shared walk short. kRays rays an invocation share each load: 1–2 suit hardware (registers), more suit
// lavapipe.
//
// MOTE_REBASE 1: single precision is 1e-7 of the distance off where a ray passes a particle, which matters once a tree
// spans hundreds of its least radii; the rays are then moved (in double) to a base in each leaf and are exact again, as
// rebase() in host/lighting/packet.h does.
#ifndef MOTE_LIB_LIGHT_WALK_GLSL
#define MOTE_LIB_LIGHT_WALK_GLSL
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#include "../layout/light.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint kRays = 2;
layout(constant_id = 2) const uint kFalloff = 0;
layout(constant_id = 3) const uint kEndpoint = 0;
layout(constant_id = 4) const uint kChannels = 1;
layout(constant_id = 5) const bool kOwnSlots = true;  // receiver k is slot k

#include "cap.glsl"
#include "falloff.glsl"

layout(push_constant, scalar) uniform Push { LightParams params; };

const float kEndless = 1e30;  // length of a ray toward a directional light

void main() {
  // Consecutive rays in each lane: a subgroup's rays are neighbours whatever its size. Lanes past the end repeat the
  // last ray, so that every lane takes part in the votes.
  const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  const uint base = (group * gl_WorkGroupSize.x + gl_LocalInvocationIndex) * kRays;

  vec3 origin[kRays], direction[kRays], inverse[kRays];
#if MOTE_REBASE
  dvec3 exactDirection[kRays];
  double exactLength[kRays];
#endif
  float len[kRays], depth[kRays], depthGreen[kRays], depthBlue[kRays];
  uint receiver[kRays], self[kRays];
  for (uint k = 0; k < kRays; ++k) {
    const uint ray = min(base + k, params.rayCount - 1);
    receiver[k] = params.order.at[params.firstRay + ray];
    self[k] = kOwnSlots ? receiver[k] : params.selves.at[receiver[k]];
    origin[k] = params.origins.at[receiver[k]].xyz;
    depth[k] = depthGreen[k] = depthBlue[k] = 0.0;
    if (params.lightType == kLightDirectional) {
      direction[k] = -params.lightDirection;
      len[k] = kEndless;
#if MOTE_REBASE
      exactDirection[k] = -normalize(dvec3(params.lightDirection));
      exactLength[k] = kEndless;
#endif
    } else {
      const vec3 toLight = params.lightPosition - origin[k];
      len[k] = length(toLight);
      direction[k] = len[k] > 0.0 ? toLight / len[k] : vec3(1, 0, 0);
#if MOTE_REBASE
      const dvec3 exact = dvec3(params.lightPosition) - dvec3(origin[k]);
      exactLength[k] = length(exact);
      exactDirection[k] = exactLength[k] > 0.0 ? exact / exactLength[k] : dvec3(1, 0, 0);
#endif
    }
    const vec3 least = vec3(1e-18);
    inverse[k] = 1.0 / mix(direction[k], least, lessThan(abs(direction[k]), least));
  }

  const vec3 slack = vec3(params.boxSlack);
  uint index = 0;
  while (index < params.nodeCount) {
    // To the next leaf that some ray touches.
    uint first = 0, end = 0;
    vec3 base = vec3(0);
    do {
      const Node node = params.nodes.at[index];
      bool touched = false;
      for (uint k = 0; k < kRays; ++k) {
        const vec3 a = (node.lo - slack - origin[k]) * inverse[k];
        const vec3 b = (node.hi + slack - origin[k]) * inverse[k];
        const vec3 lo = min(a, b), hi = max(a, b);
        const float enter = max(max(lo.x, lo.y), max(lo.z, 0.0));
        const float leave = min(min(hi.x, hi.y), min(hi.z, len[k]));
        touched = touched || enter <= leave + 1e-6 * abs(leave);
      }
      touched = subgroupAny(touched);
      const bool leaf = touched && node.skip == index + 1;
      index = touched ? index + 1 : node.skip;
      first = node.first;
#if MOTE_REBASE
      base = 0.5 * node.lo + 0.5 * node.hi;
#endif
      end = leaf ? params.nodes.at[index].first : first;
    } while (end == first && index < params.nodeCount);

    // The rays relative to the base: the point nearest to it, and the ends' distances from there.
    vec3 near[kRays];
    float before[kRays], after[kRays];
    for (uint k = 0; k < kRays; ++k) {
      near[k] = origin[k], before[k] = 0.0, after[k] = len[k];
#if MOTE_REBASE
      const dvec3 offset = dvec3(origin[k]) - dvec3(base);
      const double along = -dot(offset, exactDirection[k]);
      near[k] = vec3(offset + along * exactDirection[k]);
      before[k] = float(along), after[k] = float(exactLength[k] - along);
#endif
    }

    for (uint slot = first; slot < end; ++slot) {
      const vec4 particle = params.particles.at[slot];
      const vec3 centre = particle.xyz - base;
      const float peak = params.peaks.at[slot];
      float peakGreen = 0.0, peakBlue = 0.0;
      if (kChannels == 3) peakGreen = params.peaksGreen.at[slot], peakBlue = params.peaksBlue.at[slot];
      const float inverseSquare = 1.0 / (particle.w * particle.w);
      for (uint k = 0; k < kRays; ++k) {
        const vec3 d = centre - near[k];
        const float t = dot(d, direction[k]);
        float share;
        if (kEndpoint == kEndpointClamp) {
          const vec3 e = d - clamp(t, -before[k], after[k]) * direction[k];
          share = falloff(dot(e, e) * inverseSquare, kFalloff);
        } else {
          const vec3 e = d - t * direction[k];
          const float q = dot(e, e) * inverseSquare;
          const float halfChord = particle.w * sqrt(max(1.0 - q, 0.0));
          share = falloff(q, kFalloff) * cap(before[k] + t, halfChord) * cap(after[k] - t, halfChord);
        }
        share = slot == self[k] ? 0.0 : share;
        depth[k] += peak * share;
        if (kChannels == 3) depthGreen[k] += peakGreen * share, depthBlue[k] += peakBlue * share;
      }
    }
    bool done = true;
    for (uint k = 0; k < kRays; ++k) {
      const float least = kChannels == 3 ? min(depth[k], min(depthGreen[k], depthBlue[k])) : depth[k];
      done = done && least > params.opticalDepthLimit;
    }
    if (subgroupAll(done)) break;
  }

  for (uint k = 0; k < kRays; ++k) {
    if (base + k >= params.rayCount) continue;
    params.opticalDepths.at[receiver[k]] = len[k] > 0.0 ? depth[k] : 0.0;
    if (kChannels == 3) {
      params.opticalDepths.at[params.receiverCount + receiver[k]] = len[k] > 0.0 ? depthGreen[k] : 0.0;
      params.opticalDepths.at[2 * params.receiverCount + receiver[k]] = len[k] > 0.0 ? depthBlue[k] : 0.0;
    }
  }
}

#endif
