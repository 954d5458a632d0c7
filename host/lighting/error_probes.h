// The error of approximate light, measured on receivers drawn at random that are also lit exactly.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/lighting/lighting.h"

namespace mote {

/// Receivers whose transmittance is also computed exactly.
constexpr std::size_t kErrorProbes = 2048;

/// |ΔT| over the probes; with three colours, of their mean.
struct MeasuredError {
  double mean = 0;               ///< …
  double upper = 0;              ///< … its upper 99 % confidence limit
  double p99 = 0, greatest = 0;  ///< 99th percentile and greatest
  std::size_t probes = 0;
};

/// How far transmittance bends across the light's way: from a ray's to the mean of two, as far from it on either side.
struct Roughness {
  /// Mean |ΔT| at a distance of a quarter of a mean radius, and of half a one; known to some 8 %.
  double quarter = 0, half = 0;
  /// Of ln |ΔT| over ln distance: 2 for smooth clouds, less where few particles overlap or radii differ.
  double slope() const;
};

class ErrorProbes {
 public:
  /// Of the receivers that are reached (`reached` empty: all); kErrorProbes of them, or all where they are fewer.
  /// Everything that is passed must outlive it.
  ErrorProbes(const Octree& tree, const Receivers& receivers, const layout::Light& light,
              const LightingOptions& options, std::span<const std::uint8_t> reached);

  std::size_t count() const { return index_.size(); }
  /// Rays that lightExactly adds up.
  std::size_t rays() const { return count() + 4 * besides(); }
  /// Exact transmittances, and the roughness at `radius` [scene units]. Some 6 µs a ray and thread at 1 M particles.
  void lightExactly(double radius);
  const Roughness& roughness() const { return roughness_; }
  /// `depths` as opticalDepths gives them for all receivers. After lightExactly.
  MeasuredError measure(const std::vector<float>& depths) const;

  /// The edge of a cell that is 1 on the plane one unit from a point light, where the probes are and across their rays,
  /// on the faces of light_grid.h: z² · cos θ in area, in the mean. 1 for directional lights.
  double cellScale() const;

 private:
  std::size_t besides() const;

  const Octree& tree_;
  const Receivers& receivers_;
  const layout::Light& light_;
  const LightingOptions& options_;
  std::vector<std::uint32_t> index_;
  std::vector<float> exact_;  ///< [channel][probe]
  Roughness roughness_;
};

}  // namespace mote
