// From the channel Density to optical depths: the normalised kernels W and the calibration of density_scale (DESIGN
// §2).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/octree/octree.h"
#include "shaders/glsl/layout/medium.h"

namespace mote {

/// W(0; r) [1 / scene units²]: the kernel's value on the axis, such that ∫ W dA = 1 over the disc of radius r.
/// smooth and linear 3 / (π r²), sphere 3 / (2 π r²).
double kernelPeak(layout::uint falloff, double radius);

/// Optical depth through each particle's centre: density · kernelPeak in mode cross_section, density itself in mode
/// peak (the thesis), times `scale`. Beyond float's range it is held at the greatest finite float.
std::vector<float> peakOpticalDepths(std::span<const float> density, std::span<const float> radius,
                                     layout::uint falloff, bool crossSection, double scale);

/// How a medium's extinction differs from colour to colour: each particle's optical depth in channel c is its grey one
/// times factor c. Where all particles have the same factor, one grey sum times `uniform` serves; where they differ,
/// `factor` holds each particle's, and three sums are needed.
struct ColorExtinction {
  vec3 uniform{1};
  std::vector<vec3> factor;  ///< in input order; empty: `uniform` for all

  bool grey() const { return factor.empty() && uniform.x == uniform.y && uniform.y == uniform.z; }
  vec3 of(std::size_t particle) const { return factor.empty() ? uniform : factor[particle]; }
};

/// Extinction = scattering + absorption: with the channel Absorption a particle's factor is
/// (Color · albedo + Absorption) · extinction; without it (`absorption` empty) just `extinction`.
/// `color`: of each particle, or empty: `uniformColor`.
ColorExtinction colorExtinction(std::span<const vec3> color, const vec3& uniformColor, std::span<const vec3> absorption,
                                const vec3& albedo, const vec3& extinction);

/// Share of what a particle takes from the light that it scatters, per channel: Color · albedo, and with Absorption
/// that over the sum of both (0 where both are 0).
vec3 singleScatteringAlbedo(const vec3& scattering, const vec3* absorption);

/// Lines that the calibration draws: the standard error of their mean is a few percent for smoke, and it is the same
/// for every frame of a shot with the same particle count.
constexpr std::size_t kCalibrationLines = 4096;

/// Mean optical depth of straight lines through particles of the tree in uniformly random directions, both drawn from
/// `seed`. It is proportional to the density scale, so scale · wanted / this is the calibrated scale.
/// 0 for an empty tree. A few milliseconds.
double meanLineOpticalDepth(const Octree& tree, layout::uint falloff, std::uint64_t seed = 0);

}  // namespace mote
