// Draws particles from a volume, so that their cross-sections sum up to its integral.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/particles/formats/volume.h"

namespace mote {

/// One particle.
struct VolumeSample {
  dvec3 position;  ///< in the world
  float density;   ///< cross-section [scene units²]
  float radius;    ///< support radius [scene units]
};

/// How `count` particles share a volume:
///   where     a voxel is chosen with a probability ∝ √value, which gives thin smoke more, lighter particles than equal
///             shares of the integral would; systematic (stratified) sampling: the running sum of √value over leaves,
///             then tiles, is cut into `count` equal stretches, with one draw uniform in each. Within its voxel, or a
///             voxel of its tile, a particle's place is uniform.
///   how much  value · volume / (count · probability), times one factor near 1 that makes the sum the integral, for any
///             count; what is left is the rounding of each number to float32.
///   radius    kAutoRadiusFactor × the mean distance to the nearest 8 in a Poisson process as dense as the voxel, or
///             as its leaf's mean where that is denser (a thin voxel beside thick smoke is not alone); not less than a
///             voxel's edge, below which the picture would show the voxels.
/// A function of (volume, count, seed): the same on any number of threads.
class VolumeSampler {
 public:
  /// `volume` must outlive it, and have an integral > 0; count ≥ 1. Cost: 0.1 core-seconds for 1 M particles.
  VolumeSampler(const Volume& volume, std::uint64_t count, std::uint64_t seed);

  std::uint64_t count() const { return count_; }
  double integral() const { return integral_; }
  /// Particles first … first + samples.size() − 1.
  void draw(std::uint64_t first, std::span<VolumeSample> samples) const;

 private:
  struct Pick;
  /// Calls take(i, pick) for particles first … last − 1.
  template <class Take>
  void pick(std::uint64_t first, std::uint64_t last, const Take& take) const;

  const Volume& volume_;
  std::uint64_t count_, seed_;
  double integral_;
  double voxelVolume_;
  double factor_ = 0;         ///< cross-section of a particle over √value of its voxel
  std::vector<double> sums_;  ///< running sum of √value · voxels by leaf, then tile; one more than there are
};

}  // namespace mote
