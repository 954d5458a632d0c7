// Optical depths within an error that was asked for, by the cheapest way, and the error measured.
#pragma once
#include <string>

#include "host/lighting/light_grid.h"

namespace mote {

/// Receivers whose transmittance is also computed exactly.
constexpr std::size_t kErrorProbes = 2048;

/// What an approximation must keep.
struct ErrorWanted {
  double mean = 0;  ///< mean |ΔT|; 0: exact
  /// One frame of many. Where particles or lights move through a grid its errors are new in each frame, and two frames
  /// differ by half as much again as each is off; so a sixth of the mean is aimed at, for frames that differ by no more
  /// than a quarter of it.
  bool animated = false;

  double aim() const { return animated ? mean / 6 : mean; }
};

/// How the light of one light was computed. Errors are |ΔT| against exact sums over the same tree, at probes drawn at
/// random; with three colours, their mean.
struct Approximation {
  bool grid = false;  ///< by a light grid; else exactly, and all that follows is 0
  GridResolution resolution;
  double cellRadii = 0;          ///< the cell where the receivers are, in mean support radii
  double allowed = 0;            ///< mean |ΔT| that was asked for, a sixth of it where frames must not flicker
  double mean = 0;               ///< measured …
  double upper = 0;              ///< … its upper 99 % confidence limit, ≤ allowed
  double p99 = 0, greatest = 0;  ///< 99th percentile and greatest of the probes
  std::size_t probes = 0;
  int tries = 0;  ///< grids that were computed, the last of which met the error
};

/// As opticalDepths, with a mean |ΔT| over the reached receivers of at most `wanted`: the upper 99 % limit of the mean
/// at kErrorProbes of them is within it, or the result is exact. A cost model decides where exact sums are cheaper, so
/// nothing depends on the machine's speed; what it chose stands in `chosen`. Receivers that no light reaches take no
/// part. The grid is tried as fine as a model of its error says and made finer by what is measured; `shadow_density`
/// and extinction count, as they decide what an error of τ does to T.
std::vector<float> approximateOpticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                            const LightingOptions& options, const ErrorWanted& wanted,
                                            Approximation& chosen, std::span<const std::uint8_t> reached = {},
                                            const RaysDone& done = {});

}  // namespace mote
