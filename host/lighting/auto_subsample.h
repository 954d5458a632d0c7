// The smallest share of the particles that casts the shadow of all of them within an error (Monette 2011, §4.6.3).
#pragma once
#include <span>

#include "host/lighting/density_tree.h"
#include "host/lighting/lighting.h"

namespace mote {

struct SubsampleChoice {
  float fraction = 1;
  double error = 0;  ///< mean |ΔT| measured for it; 0 for fraction 1
};

/// Particles whose transmittance is measured: the standard error of a mean |ΔT| of 0.01 is then about 0.0004.
constexpr std::size_t kSubsampleProbes = 1024;

/// Lights the same 1,024 particles (chosen by a hash of `rules.seed`) with all particles in the tree and with ever
/// larger shares of them, 1/64, √2/64, … 1, and takes the first share whose mean |ΔT|, of the light where it is
/// greatest, is within `error`. `rules.fraction` is not used; all other rules are. Costs a few builds of the tree.
SubsampleChoice autoSubsample(const DensityInput& input, const DensityRules& rules,
                              std::span<const layout::Light> lights, const LightingOptions& options, double error);

}  // namespace mote
