// Reads OpenVDB files: point grids as they are, fog volumes as particles that are drawn from them. Level sets and other
// grids are refused. A build without OpenVDB (CMake: MOTE_OPENVDB) knows the format and says so.
//
// Points: attributes that are numbers, by their names; P as Position, in the world, 3 × float64; groups and texts are left out.
// Volumes: see volume_particles.h; a grid of vectors named v, vel or velocity gives Velocity.
#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/volume_sampling.h"

namespace mote {

bool beginsAsVdb(std::span<const std::byte> start);

/// Throws InputError where the file is damaged (with the byte), holds no such grid, or none that can be made particles.
/// The grid is read here, whole. Cost: 0.02 core-seconds a million voxels or points.
std::unique_ptr<ParticleFile> openVdb(const std::string& path, const VolumeSampling& sampling);

}  // namespace mote
