// From a frame to what the rasterisers draw: cameras of every moment, sprites, particles with their light.
#pragma once
#include <vector>

#include "engine/frame.h"
#include "host/splat/splat_set.h"

namespace mote {

/// Cameras, times and sprites of a frame, without particles. Throws InputError where the camera has no view at a moment
/// that counts (the shutter's ends, half a frame before and after) and for sprites that cannot be read.
SplatSet blankSplats(const Scene& scene, int number, layout::uint falloff);

/// What is drawn, in the order of the receivers: radiance is albedo · Color · in-scattered radiance.
SplatSet splatSet(const Frame& frame, const Scene& scene, const std::vector<vec3>& inScattered);

/// The particles of `set` with other light, for a layer of one light.
std::vector<layout::SplatParticle> relit(const SplatSet& set, const Frame& frame, const Scene& scene,
                                         const std::vector<vec3>& inScattered);

}  // namespace mote
