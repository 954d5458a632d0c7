// Phase functions: how much of the light that a particle scatters goes where, per steradian.
#pragma once
#include <cmath>

#include "host/core/vec.h"

namespace mote {

enum class PhaseKind { Isotropic, HenyeyGreenstein, Rayleigh };

/// p(θ) [1/sr], θ the angle between the light's direction of travel before and after scattering. Its integral over the
/// sphere is 1.
///   Isotropic         1 / 4π
///   HenyeyGreenstein  (1 − g²) / (4π · (1 + g² − 2g·cos θ)^(3/2)), mean cosine g, forward for g > 0
///                     (Henyey and Greenstein 1941, "Diffuse radiation in the galaxy")
///   Rayleigh          3 / 16π · (1 + cos² θ): particles far smaller than the wavelength
struct PhaseFunction {
  PhaseKind kind = PhaseKind::Isotropic;
  float g = 0;  ///< Henyey–Greenstein: −1 < g < 1

  float operator()(float cosine) const {
    constexpr auto kFullSphere = static_cast<float>(4 * kPi);
    switch (kind) {
      case PhaseKind::HenyeyGreenstein: {
        // |1 − g|² ≤ the base: a cosine rounded beyond 1 must not make it smaller, let alone negative.
        const float base = 1 + g * g - 2 * g * std::min(std::max(cosine, -1.0f), 1.0f);
        return (1 - g * g) / (kFullSphere * base * std::sqrt(base));
      }
      case PhaseKind::Rayleigh: return 0.75f / kFullSphere * (1 + cosine * cosine);
      case PhaseKind::Isotropic: break;
    }
    return 1 / kFullSphere;
  }
};

/// Where the picture is taken from: the direction from a point toward the camera.
struct Viewer {
  vec3 eye{0};             ///< perspective: the camera's position [scene units]
  bool parallel = false;   ///< orthographic: all rays go along `toCamera`
  vec3 toCamera{0, 0, 1};  ///< orthographic: unit vector

  /// Unit vector; (0, 0, 1) for a point at the eye.
  vec3 directionFrom(const vec3& point) const {
    if (parallel) return toCamera;
    const vec3 offset = eye - point;
    const float length = glm::length(offset);
    return length > 0 ? offset / length : vec3(0, 0, 1);
  }
};

}  // namespace mote
