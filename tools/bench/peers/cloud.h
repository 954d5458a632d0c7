// What the contenders light: particles in an octree, calibrated, and a light.
#pragma once
#include <cstdint>
#include <string>

#include "host/lighting/lighting.h"

namespace mote {

/// Generated particles ("noise": the cloud of mote bench; "ball", "plume") or those of a PRT file (`count` is ignored
/// then), with their own radii or 1.5 spacings, scaled such that lines through particles have a mean optical depth of
/// 4. Falloff smooth, one channel. Throws InputError as loadParticles does.
Octree makeCloud(const std::string& kind, std::uint64_t count);

/// A light that shades: a point as far from the particles' box, in proportion, as mote bench's is from its cloud, or
/// a directional one from the same side.
layout::Light makeLight(const Octree& tree, bool directional);

}  // namespace mote
