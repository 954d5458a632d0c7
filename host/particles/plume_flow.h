// The air that carries the plume's smoke: an entraining column with an umbrella, and vortices of four sizes riding in
// it.
#pragma once
#include <cstdint>
#include <vector>

#include "host/core/vec.h"

namespace mote {

constexpr double kPlumeStep = 1.0 / 24;  ///< of the flow's clock [s]; step k is time k / 24

/// Every part is divergence-free: the column comes from a Stokes stream function, each vortex from a vector potential.
/// The flow at step k is a function of (seed, k) alone. Velocities in units/s.
class PlumeFlow {
 public:
  /// Makes the flow ready for steps first … last. Cost: about 0.1 s for 100 steps, and 0.4 MB a step.
  PlumeFlow(std::uint64_t seed, int first, int last);

  /// Velocity of the air at p, at a step within those asked for. About 100 ns.
  vec3 velocity(const vec3& p, int step) const { return column(p) + vortices(p, step, kLevels); }

  /// The column alone, which does not change with time.
  static vec3 column(const vec3& p);
  /// Radius at which the column's speed has fallen to 1/e, and the speed on its axis.
  static float columnRadius(float y);
  static float axisSpeed(float y);

 private:
  static constexpr int kLevels = 4;

  /// A vortex ring as one smooth lump: u = curl(f · n × x / 2) · strength, f = (1 − |x|²/R²)³ inside the support R.
  struct Vortex {
    vec3 centre;
    float support;  ///< R
    vec3 push;      ///< strength × n: the velocity at the centre
  };
  /// Four of them side by side, one SIMD register a number; made zero where there are fewer.
  struct Vortex4 {
    alignas(16) float x[4] = {}, y[4] = {}, z[4] = {},
                      inverseSquare[4] = {}, pushX[4] = {}, pushY[4] = {}, pushZ[4] = {};
  };
  /// The vortices of one size at one step, and copies of them cell by cell.
  struct Layer {
    std::vector<Vortex> vortices;
    std::vector<Vortex4> inCells;
    std::vector<std::uint32_t> cellBegin;
  };

  vec3 vortices(const vec3& p, int step, int levels) const;
  void traceLevel(std::uint64_t seed, int level, int last);
  void traceVortex(std::uint64_t seed, int level, std::int64_t index, int last);

  int begin_[kLevels] = {};             // first step stored, by level
  std::vector<Layer> layers_[kLevels];  // by step − begin
};

}  // namespace mote
