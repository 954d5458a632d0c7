// What light_gather.comp and light_sum.comp share: one subgroup works on one column or beam, and where its lists stand.
#ifndef MOTE_LIB_LIGHT_SCRATCH_GLSL
#define MOTE_LIB_LIGHT_SCRATCH_GLSL
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_EXT_control_flow_attributes : require
#include "../layout/light.h"

layout(local_size_x_id = 0) in;  // a multiple of every subgroup size that the device may choose
layout(constant_id = 1) const uint kChannels = 1;
layout(constant_id = 2) const bool kPerspective = false;
layout(constant_id = 3) const bool kCareful = false;  // Beam::careful; light_gather.comp: of any beam
layout(constant_id = 4) const uint kFoundCapacity = 1024;
layout(constant_id = 5) const uint kChosenCapacity = 1024;
layout(constant_id = 6) const uint kWidestSubgroup = 64;

layout(push_constant, scalar) uniform Push { LightParams params; };

/// Which subgroup of the dispatch this is. They are independent: no workgroup barriers.
uint subgroupOfDispatch() {
  return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_NumSubgroups + gl_SubgroupID;
}

/// What lanes wrote is there for the others.
void shareWrites() {
  subgroupMemoryBarrierBuffer();
  subgroupBarrier();
}

uint foundList(uint column, uint list) { return (column * kFoundLists + list) * kFoundCapacity; }
uint chosenList(uint beam, uint list) { return (beam * kChosenLists + list) * kChosenCapacity; }
uint orderList(uint column, uint list) {
  return column * (kOrderLists * kFoundCapacity + kLightBins * (1 + kWidestSubgroup)) + list * kFoundCapacity;
}
uint binEnds(uint column) { return orderList(column, kOrderLists); }
uint binCounters(uint column) { return binEnds(column) + kLightBins; }  // [bin][lane]

/// Never decreases with the reach, which is all that is asked of it.
uint binOf(float reach, LightWalk walk) {
  return uint(clamp((reach - walk.lowestReach) * walk.binScale, 0.0, float(kLightBins - 1)));
}

#endif
