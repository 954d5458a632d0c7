// Optical depth along rays too far from each other for beams: packets walk the tree together, and each ray looks at
// what it finds in the leaves that it crosses.
//
// A ray starts at a receiver and goes to the light (DESIGN §2). With x, y and t a particle's place across the ray and
// along it, b² = x² + y², and what lies in the ray's way is the falloff F(b²/r²) times the shares of the particle
// before the receiver's end and the light's (cap.h); with hard ends F((b² + d²)/r²), d how far the centre is beyond an
// end. Places are taken from the middle of the leaf, and only that is placed in double: exact however large the scene
// is.
#pragma once
#include <limits>
#include <span>

#include "host/lighting/exact/column.h"
#include "host/lighting/receivers.h"
#include "host/octree/octree.h"
#include "shaders/glsl/layout/light.h"
#include "shaders/glsl/layout/medium.h"

namespace mote {

struct Ray {
  dvec3 origin;
  dvec3 direction, u, v;  ///< orthonormal; `direction` goes to the light
  double length = std::numeric_limits<double>::infinity();
  std::uint32_t self = kNoSlot;  ///< slot that it leaves out
};
/// From a receiver, which does not stand at a point light itself.
Ray rayToLight(const Receivers& receivers, std::size_t receiver, const layout::Light& light);

/// Optical depths along up to kPacketRays rays, faster where they are neighbours: sums[channel][ray] in each of the
/// tree's channels. `slack`: boxes are widened by so much for rounding (ColumnRules). The same bits on every
/// instruction set, and whatever other rays go along. Some 5 µs a ray at 1 M particles.
void sumRays(const Octree& tree, std::span<const Ray> rays, layout::uint falloff, layout::uint endpoint, float slack,
             float (&sums)[3][kPacketRays]);

}  // namespace mote
