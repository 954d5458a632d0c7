// Optical depths within an error that was asked for, by the cheapest way, and the error measured.
#pragma once
#include <functional>

#include "host/lighting/error_probes.h"
#include "host/lighting/grid/light_grid.h"

namespace mote {

/// What an approximation must keep.
struct ErrorWanted {
  double mean = 0;  ///< mean |ΔT|; 0: exact
  /// One frame of many. Where particles or lights move through a grid its errors are new in each frame, and two frames
  /// differ by half as much again as each is off; so a sixth of the mean is aimed at, for frames that differ by no more
  /// than a quarter of it.
  bool animated = false;

  double aim() const { return animated ? mean / 6 : mean; }
};

enum class DepthMethod {
  Exact,
  Grid,   ///< light_grid.h
  Detail  ///< level_of_detail.h
};

/// How the light of one light was computed.
struct Approximation {
  DepthMethod method = DepthMethod::Exact;
  GridResolution resolution;      ///< of a grid
  double cellRadii = 0;           ///< of a grid: its cell where the receivers are, in mean support radii
  double tolerance = 0;           ///< of level of detail
  std::size_t treeParticles = 0;  ///< of level of detail: stand-ins and the particles beside them
  double allowed = 0;             ///< mean |ΔT| that was asked for, a sixth of it where frames must not flicker
  MeasuredError error;            ///< its upper limit ≤ allowed; nothing measured for exact light
  int tries = 0;                  ///< approximations that were computed, the last of which met the error
};

/// What computes optical depths, on the host or on a device.
struct DepthSources {
  /// As opticalDepths, of any tree.
  std::function<std::vector<float>(const Octree&, const Receivers&, const layout::Light&, const LightingOptions&,
                                   std::span<const std::uint8_t> reached, const RaysDone&)>
      exact;
  /// As gridOpticalDepths.
  std::function<std::vector<float>(const Octree&, const Receivers&, const layout::Light&, const LightingOptions&,
                                   const GridResolution&, std::span<const std::uint8_t> reached, const RaysDone&)>
      grid;
};
/// On TBB.
const DepthSources& hostDepths();

/// As opticalDepths, with a mean |ΔT| over the reached receivers of at most `wanted`: the upper 99 % limit of the mean
/// at kErrorProbes of them (ErrorProbes, always on the host) is within it, or the result is exact. A cost model decides
/// which method is cheapest, so nothing depends on the machine's speed; what it chose stands in `chosen`. Receivers
/// that no light reaches take no part. A method is tried as coarse as a model of its error says and made finer by what
/// is measured; `shadow_density` and extinction count, as they decide what an error of τ does to T.
std::vector<float> approximateOpticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                            const LightingOptions& options, const ErrorWanted& wanted,
                                            Approximation& chosen, std::span<const std::uint8_t> reached = {},
                                            const RaysDone& done = {}, const DepthSources& sources = hostDepths());

}  // namespace mote
