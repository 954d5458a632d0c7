// OpenVDB's part in reading its files: from a tree's bytes to voxels, velocities and points. Its headers take a
// compiler half a minute, so they stay in the .cpp.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/vdb_check.h"
#include "host/particles/formats/volume.h"
#include "host/particles/formats/volume_particles.h"

namespace mote {

/// All of these take a tree that checkVdbTree let through, and throw InputError where OpenVDB refuses it all the same,
/// MachineError where memory runs out.

/// Fills voxels and tiles of `volume` from a scalar tree.
void readVdbVolume(const VdbTree& tree, Volume& volume);

/// Of a vector tree: trilinear, or as its faces say where it is staggered.
VelocityField readVdbVelocity(const VdbTree& tree, const dmat3& linear, const dvec3& translate, bool staggered);

/// The points of a point tree, leaf by leaf, in the order of their voxels.
class VdbPoints {
 public:
  VdbPoints(const VdbTree& tree, const dmat3& linear, const dvec3& translate);
  ~VdbPoints();

  std::uint64_t count() const;
  /// Of the attributes that are numbers. P comes first, as Position, 3 × float64 in the world.
  const std::vector<Channel>& channels() const;
  std::size_t leaves() const;
  std::size_t pointsOf(std::size_t leaf) const;
  /// Writes a channel of all points of a leaf, Channel::bytes() each. Safe from several threads.
  void fill(std::size_t channel, std::size_t leaf, std::byte* to) const;

 private:
  struct Grid;
  std::unique_ptr<Grid> grid_;
};

}  // namespace mote
