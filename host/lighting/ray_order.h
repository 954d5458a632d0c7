// The order in which rays toward one light are taken, so that sixteen consecutive ones make a thin shaft.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/lighting/receivers.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

/// Indices of the receivers whose `reached` is not 0 (empty: all of them), each once. Blocks of 4096 of them in Morton
/// order are compact pieces of space; within each, rays are grouped by where they cross the light's plane
/// (sort-tile-recursive: 16 strips, then 16 groups of 16 in each), so the rays of a packet lie almost behind one
/// another. Depends on nothing but receivers and light. About 20 ms per million on two cores; 4 bytes a ray.
std::vector<std::uint32_t> rayOrder(const Receivers& receivers, const layout::Light& light,
                                    std::span<const std::uint8_t> reached = {});

}  // namespace mote
