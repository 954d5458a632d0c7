// The order in which rays toward one light are taken, so that sixteen consecutive ones make a thin shaft.
#pragma once
#include <cstdint>
#include <vector>

#include "host/octree/octree.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

/// Slots of the tree, each once. Blocks of 4096 slots in Morton order are compact pieces of space; within each, rays
/// are grouped by where they cross the light's plane (sort-tile-recursive: 16 strips, then 16 groups of 16 in each), so
/// the rays of a packet lie almost behind one another. Depends on nothing but the tree and the light. About 20 ms per
/// million on two cores; 4 bytes a ray.
std::vector<std::uint32_t> rayOrder(const Octree& tree, const layout::Light& light);

}  // namespace mote
