// Exact single scattering at every particle: transmittance of the medium toward each light (Monette 2011, §4.1.2).
//
//   τ_il = shadow_density · Σ_{j≠i} τ_j(b) · share of particle j between particle i and light l      (DESIGN §2)
//   T_il = e^−τ_il
//
// Rays go in columns and beams (beams.h), so that what lies in the way of many is found once. Results do not depend on
// the number of threads nor on the SIMD instructions in use, bit for bit.
#pragma once
#include <functional>
#include <vector>

#include "host/lighting/phase.h"
#include "host/lighting/receivers.h"
#include "host/octree/octree.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

struct LightingOptions {
  layout::uint falloff = layout::kFalloffSmooth;
  layout::uint endpoint = layout::kEndpointSoft;
  /// A ray stops once its transmittance is below in every colour; the error of T is at most this. 0: never.
  float cutoff = 1e-4f;
  /// Factor on the optical depth of each colour, ≥ 0. A grey tree needs one sum whatever stands here; three sums are
  /// walked only where the colours' ratio differs from particle to particle (Octree::channels).
  vec3 extinction{1};
};

/// Optical depth (before shadowDensity and extinction) beyond which a ray may stop: where T of the colour that is least
/// absorbed is below the cutoff. +∞ for cutoff 0.
float opticalDepthLimit(const layout::Light& light, const LightingOptions& options);

/// True where no particle shades another from this light: then every optical depth counts as 0.
bool shadowless(const layout::Light& light);

/// Called now and then with the number of rays done since the last call; from any thread.
using RaysDone = std::function<void(std::size_t)>;

/// Optical depth from every receiver toward one light, *without* shadowDensity and extinction: [channel][receiver] with
/// the tree's channels, one or three. Receivers whose `reached` is 0 (empty: none) get 0 and cost nothing.
/// `light.castsShadows == 0` or `shadowDensity == 0` gives zeros. About 0.25 µs a ray on two cores at
/// r = 1.5 spacing.
std::vector<float> opticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                 const LightingOptions& options, std::span<const std::uint8_t> reached = {},
                                 const RaysDone& done = {});
/// … from every slot of the tree.
std::vector<float> opticalDepths(const Octree& tree, const layout::Light& light, const LightingOptions& options,
                                 const RaysDone& done = {});

/// … from receivers so few and far between that rays have little of their way in common: as opticalDepths but for
/// rounding, and without a cut-off. About 6 µs a ray and thread at 1 M particles: a tenth of the time for a few
/// thousand.
std::vector<float> opticalDepthsOfFew(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                      const LightingOptions& options);

/// The same through the plain scalar path: what the SIMD kernels are tested against, bit for bit.
std::vector<float> opticalDepthsScalar(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                       const LightingOptions& options, std::span<const std::uint8_t> reached = {});
std::vector<float> opticalDepthsScalar(const Octree& tree, const layout::Light& light, const LightingOptions& options);

/// Transmittance e^(−shadowDensity · extinction · τ): [channel][receiver], one channel where τ and extinction are grey,
/// else three. `opticalDepths` holds one or three channels of `receivers` numbers.
std::vector<float> transmittances(const std::vector<float>& opticalDepths, std::size_t receivers,
                                  const layout::Light& light, const vec3& extinction);
/// Grey, extinction 1.
std::vector<float> transmittances(const std::vector<float>& opticalDepths, const layout::Light& light);

/// Optical depth of whole straight lines (both directions, nothing left out) through `points` along unit `directions`;
/// the mean of the channels where the tree has three.
std::vector<float> lineOpticalDepths(const Octree& tree, std::span<const vec3> points, std::span<const vec3> directions,
                                     layout::uint falloff);

/// What scattering into the picture depends on beside the light.
struct Scattering {
  PhaseFunction phase;
  Viewer viewer;
};

/// Adds p(θ) · E · T of one light to each receiver's in-scattered radiance [W/(m² sr)].
/// `radius`: of each receiver, the least distance from the light that counts (irradiance.h). `transmittance`: one or
/// three channels, of all that stands in the light's way.
void addInScattering(const Receivers& receivers, std::span<const float> radius, const layout::Light& light,
                     std::span<const float> transmittance, const Scattering& scattering, std::vector<vec3>& radiance);

}  // namespace mote
