// Exact single scattering at every particle: transmittance of the medium toward each light (Monette 2011, §4.1.2).
//
//   τ_il = shadow_density · Σ_{j≠i} τ_j(b) · share of particle j between particle i and light l      (DESIGN §2)
//   T_il = e^−τ_il
//
// Rays go in packets of 16 slots in Morton order. Results do not depend on the number of threads nor on the SIMD
// instructions in use, bit for bit.
#pragma once
#include <functional>
#include <vector>

#include "host/octree/octree.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

struct LightingOptions {
  layout::uint falloff = layout::kFalloffSmooth;
  layout::uint endpoint = layout::kEndpointSoft;
  /// A ray stops once its transmittance is below; the error of T is at most this. 0: never.
  float cutoff = 1e-4f;
};

/// Optical depth (before shadowDensity) beyond which a ray may stop: −ln(cutoff) / shadowDensity, +∞ for cutoff 0.
float opticalDepthLimit(const layout::Light& light, float cutoff);

/// Called now and then with the number of rays done since the last call; from any thread.
using RaysDone = std::function<void(std::size_t)>;

/// Optical depth from every slot toward one light, *without* shadowDensity, in slot order.
/// `light.castsShadows == 0` or `shadowDensity == 0` gives zeros. About 1 µs a ray on two cores at r = 1.5 spacing.
std::vector<float> opticalDepths(const Octree& tree, const layout::Light& light, const LightingOptions& options,
                                 const RaysDone& done = {});

/// The same through the plain scalar path: what the SIMD kernels are tested against, bit for bit.
std::vector<float> opticalDepthsScalar(const Octree& tree, const layout::Light& light, const LightingOptions& options);

/// Transmittance e^(−shadowDensity · τ) of each optical depth.
std::vector<float> transmittances(const std::vector<float>& opticalDepths, const layout::Light& light);

/// Optical depth of whole straight lines (both directions, nothing left out) through `points` along unit `directions`.
std::vector<float> lineOpticalDepths(const Octree& tree, std::span<const vec3> points, std::span<const vec3> directions,
                                     layout::uint falloff);

/// Adds p(θ) · E · T of one light to each slot's in-scattered radiance [W/(m² sr)], isotropic p = 1/4π.
/// E = power / dⁿ for point lights with d at least the particle's own radius (the particle is no point, and a light
/// inside it would be infinitely bright), power for directional ones.
void addInScattering(const Octree& tree, const layout::Light& light, const std::vector<float>& transmittance,
                     std::vector<vec3>& radiance);

}  // namespace mote
