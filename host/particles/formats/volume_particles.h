// Particles drawn from a volume, as any other file's.
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/component_names.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/volume.h"
#include "host/particles/formats/volume_sampler.h"
#include "host/particles/formats/volume_sampling.h"

namespace mote {

/// Velocities [scene units / s] at places in the world; called from several threads at once.
using VelocityField = std::function<void(std::span<const VolumeSample> at, std::span<vec3> velocities)>;

/// What a reader found in a file besides.
struct VolumeExtras {
  std::string format;              ///< "OpenVDB 10.0 (fog volume)", for people
  VelocityField velocity;          ///< empty: none
  std::vector<Metadata> metadata;  ///< of the file
};

/// Channels Position (3 × float64), Density (float32), Radius (float32) and, where the file has it, Velocity (3 ×
/// float32); volume_sampler.h says how they are drawn. Metadata: those of the reader, and grid, active_voxels,
/// tile_voxels, voxel_volume, integral.
class VolumeParticles : public ParticleFile {
 public:
  /// Throws InputError where the volume is empty, or more than float32 can say. A warning where it holds values that
  /// are no density.
  VolumeParticles(std::string path, Volume volume, VolumeExtras extras, const VolumeSampling& sampling);

  bool drawn() const override { return true; }
  /// Cost: 0.1 core-seconds a million, on all threads.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  Volume volume_;
  VelocityField velocity_;
  std::vector<PlacedChannel> placed_;
  std::unique_ptr<VolumeSampler> sampler_;
};

/// The grid that is meant: `asked`, which must be there; else "density", else the only one. Throws InputError (field
/// "grid") with the names of those that there are. Returns its index.
std::size_t chosenGrid(const std::string& path, std::span<const std::string> names, const std::string& asked);

}  // namespace mote
