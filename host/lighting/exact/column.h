// A column: a bundle of beams toward one light, in coordinates of its own, and all particles in its way.
//
// The frame has its axis along the light's travel. A point light stands at its origin, and a direction is the place
// (u, v) where it crosses the plane one unit away; for a directional light u and v are lengths. With Δu, Δv the
// difference between a ray and a particle's centre, the distance b of the centre from the ray follows from
//
//   directional   b² = Δu² + Δv²
//   point         b² = z² · (Δu² + Δv² + (Δu·v − Δv·u)²) / (1 + u² + v²)
//
// with (u, v) of the ray and z the centre's place along the axis: the cross product of the two, no digits lost however
// far away the light is. About the axis the last two terms are nothing, so in a narrow beam with a frame of its own
// q = b²/r² costs six operations a ray.
//
// Depth is the distance from the light (directional: the place along the travel) less the column's `depthBase`. A
// particle's centre is nearest to a ray at the depth ρ − sag, with ρ the centre's own and sag = ρ − √(ρ² − b²).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/lighting/receivers.h"
#include "host/octree/octree.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

/// Vectors of sixteen are the unit of all steps, whatever the machine has: decisions must not depend on it. Arrays have
/// room for one more.
constexpr int kPacketRays = 16;

/// Particles nearer to a point light than this many radii are summed in plain coordinates: directions mean little
/// there, and the light's own end of the ray may cut them. Beyond, sag's series of two terms is exact to 2e-6 r.
constexpr double kNearLightRadii = 8;
/// A particle farther than that from the light is seen within 7.2° of every ray that meets it, and rays lie within 55°
/// of the axis: what is farther off than 63° is behind the light.
constexpr double kLeastCosine = 0.45;
/// Starts no deeper than its centre less this many radii have nothing of a particle in their way: one for the support,
/// and the sag, at most r/16.
constexpr double kBehindRadii = 1.07;
/// Keeps 0 · ∞ away where a radius is next to nothing.
constexpr double kGreatestInverseArea = 1e36;

struct LightFrame {
  bool perspective = false;
  dvec3 origin, u, v, axis;  ///< orthonormal
};

/// Planes that enclose all rays; eight so that they fill vectors, the last two hold everything.
/// A point p (relative to `origin`) with normal · p − offset > 0 is outside.
constexpr int kColumnPlanes = 6;
struct ColumnPlanes {
  vec3 origin;
  alignas(32) float x[8], y[8], z[8];           ///< unit normals, outward
  alignas(32) float absX[8], absY[8], absZ[8];  ///< their magnitudes
  alignas(32) float offset[8];                  ///< with slack for rounding
};

/// As they were found, in slot order.
struct GatheredParticles {
  std::size_t count = 0;
  std::vector<float> x, y, z, radius, peak[3];
  std::vector<std::uint32_t> slot;
  void reserve(std::size_t more, std::size_t channels);
};

/// What becomes of a gathered particle.
enum class Place : std::uint8_t { Behind, Sorted, NearLight };

/// The same in the frame, index by index.
struct PlacedParticles {
  std::vector<float> u, uLow, v, vLow;     ///< uLow, vLow: what rounding to u and v left
  std::vector<float> inverseArea;          ///< 1/r², for a point light z²/r²: q = this · (Δu² + …)
  std::vector<float> extent;               ///< half width in u and v: r, for a point light r/z
  std::vector<float> reach;                ///< depth + r: starts deeper than that have all of it in their way
  std::vector<float> behind;               ///< starts no deeper than that have nothing of it in their way
  std::vector<float> depth, depthLow;      ///< of the centre
  std::vector<float> sagFirst, sagRatio;   ///< 1/2ρ and 1/ρ²; 0 for a directional light
  std::vector<float> nearX, nearY, nearZ;  ///< the centre along the frame's axes; for Place::NearLight
  std::vector<Place> place;
  void resize(std::size_t count);
};

/// What the beams choose from, by ascending reach.
struct SortedParticles {
  std::size_t count = 0;
  std::vector<float> u, v, extent, inverseArea, peak[3], reach;
  std::vector<std::uint32_t> index;  ///< into gathered and placed
  float greatestRadius = 0;
};

/// What all columns toward a light share.
struct ColumnRules {
  float slack = 0;        ///< rounding of coordinates [scene units]
  float leastRadius = 0;  ///< of the tree
};
/// `origins` bounds the rays' starts.
ColumnRules columnRules(const Octree& tree, const layout::Light& light, const Bounds& origins);

/// Set up again for each bundle; holds on to its memory.
struct Column {
  LightFrame frame;
  ColumnPlanes planes;
  double depthBase = 0;
  float margin = 0;  ///< rounding of depths [scene units]
  /// So many of the least radii across that u and v need their low parts.
  bool precise = false;
  GatheredParticles gathered;
  PlacedParticles placed;
  SortedParticles sorted;
  std::vector<std::uint32_t> nearLight;  ///< indices of Place::NearLight

  /// Frame and planes around the rays from `members` toward the light; none of them stands at a point light.
  void setRays(const Receivers& receivers, const layout::Light& light, std::span<const std::uint32_t> members,
               const ColumnRules& rules);
  /// … around one endless line through `point`, both ways.
  void setLine(const vec3& point, const vec3& direction, const ColumnRules& rules);
  /// placed → sorted, nearLight.
  void sort(std::size_t channels);

  struct Key {
    float reach;
    std::uint32_t index;
  };

 private:
  std::vector<std::uint32_t> starts_, binOf_;
  std::vector<Key> keys_;
};

/// The axis in the middle of the rays' box on their face of a cube around a point light (planBeams): at most 55° from
/// any.
dvec3 middleDirection(const dvec3& light, const Receivers& receivers, std::span<const std::uint32_t> members);
/// Planes around the rays whose places in the frame lie between lo and hi and that start no deeper than `deepest` along
/// the axis (for a point light, also: no farther away).
ColumnPlanes planesAround(const LightFrame& frame, const dvec2& lo, const dvec2& hi, double deepest, float slack);
/// A frame about an axis.
LightFrame frameAbout(const dvec3& origin, const dvec3& axis, bool perspective);

}  // namespace mote
