// From a frame to what the rasterisers draw: cameras of every moment, sprites, particles with their light.
#pragma once
#include <string>
#include <vector>

#include "engine/frame.h"
#include "host/splat/splat_set.h"

namespace mote {

/// The scene's sprites, without particles and cameras; adds their files to `files`. Throws InputError for sprites that
/// cannot be read, numbers that are not finite, and negative colours.
SplatSet readSprites(const Scene& scene, std::vector<std::string>& files);

/// Cameras and times of a frame. Throws InputError where the camera has no view at a moment that counts: the shutter's
/// ends, half a frame before and after.
void setCameras(const Scene& scene, int number, layout::uint falloff, SplatSet& set);

/// What can be seen, in the order of the receivers: radiance is albedo · Color · in-scattered radiance. Particles out
/// of view are left out before anything is sorted or sent to a device.
SplatSet splatSet(const Frame& frame, const Scene& scene, const std::vector<vec3>& inScattered);

/// The particles of `set` with other light, for a layer of one light.
std::vector<layout::SplatParticle> relit(const SplatSet& set, const Frame& frame, const Scene& scene,
                                         const std::vector<vec3>& inScattered);

}  // namespace mote
