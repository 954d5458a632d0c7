// Reads fog volumes of NanoVDB files, 32.3 and later, as particles drawn from them (volume_particles.h): grids of
// float, not packed, zipped or in blosc. Level sets and other types are refused.
// Source: NanoVDB.h ("Memory layout") and util/IO.h of OpenVDB 10. NanoVDB's own code follows the offsets in a file
// wherever they lead; here nodes are gone through as the arrays that they are, and each is held against the file.
#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/volume_sampling.h"

namespace mote {

bool beginsAsNanoVdb(std::span<const std::byte> start);

/// Throws InputError where the file is damaged, cut off or holds no such grid. The grid is read here, whole. Cost: that
/// of zlib, 0.3 GB/s, and 0.02 core-seconds a million voxels.
std::unique_ptr<ParticleFile> openNanoVdb(const std::string& path, const VolumeSampling& sampling);

}  // namespace mote
