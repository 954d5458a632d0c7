// Which receivers a solid keeps from a light (thesis §4.4): 1 behind a triangle, else 0. What of the light that leaves
// (lighting.solid_shadow_intensity, §4.6.2) is for the caller to say.
//
// Particles' rays start at the particle; a surface's start beside it, see surfaceOffset().
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/lighting/receivers.h"
#include "host/solids/solid_tree.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

/// One byte a receiver. Only receivers with wanted[k] ≠ 0 are asked (empty: all); the others get 0, and so does
/// everything where light.castsShadows is 0. Any type of light but a directional one is a point. Does not depend on
/// the number of threads; engine/passes/solid_pass.h gives the same bytes. 0.1 µs a ray of one core among 6,000
/// triangles, 1 µs among a million.
std::vector<std::uint8_t> occluded(const SolidTree& tree, const Receivers& receivers,
                                   std::span<const std::uint8_t> wanted, const layout::Light& light);

/// How far beside a triangle, along its normal, the rays of a point on it have to start so that rounding cannot make
/// the triangle shade itself [scene units]: 2e-6 · L · L²/(2·area), at most 1e-3 · L, of its longest edge L (a sliver
/// is hit less exactly than a fat triangle), and 1e-6 of the point's greatest coordinate (sixteen roundings).
float surfaceOffset(const layout::Triangle& triangle, const vec3& point);

}  // namespace mote
