// The definition of DESIGN §2 as it is written, in double precision and O(N²): what every kernel is held against.
#pragma once
#include <cmath>
#include <vector>

#include "host/lighting/lighting.h"

namespace mote {

inline double oracleFalloff(layout::uint kind, double q) {
  if (q >= 1) return 0;
  if (kind == layout::kFalloffLinear) return 1 - std::sqrt(q);
  if (kind == layout::kFalloffSphere) return std::sqrt(1 - q);
  return (1 - q) * (1 - q);
}

inline double oracleCap(double x) { return x <= -1 ? 0 : x >= 1 ? 1 : 0.5 + 0.75 * x - 0.25 * x * x * x; }

/// Share of a particle with support radius r, at `offset` from the ray's start, in the segment of the given length.
inline double oracleShare(const dvec3& offset, const dvec3& direction, double length, double r, layout::uint falloff,
                          layout::uint endpoint) {
  double t = glm::dot(offset, direction);
  if (endpoint == layout::kEndpointClamp) t = std::min(std::max(t, 0.0), length);
  const dvec3 across = offset - t * direction;
  const double q = glm::dot(across, across) / (r * r);
  if (q >= 1) return 0;
  const double share = oracleFalloff(falloff, q);
  if (endpoint == layout::kEndpointClamp) return share;
  const double halfChord = r * std::sqrt(1 - q);
  return share * oracleCap(t / halfChord) * oracleCap((length - t) / halfChord);
}

/// Optical depth of one slot toward the light, before shadowDensity.
inline double oracleOpticalDepth(const Octree& tree, std::size_t slot, const layout::Light& light, layout::uint falloff,
                                 layout::uint endpoint) {
  const dvec3 origin(tree.position(slot));
  dvec3 direction = -dvec3(light.direction);
  double length = INFINITY;
  if (light.type != layout::kLightDirectional) {
    direction = dvec3(light.position) - origin;
    length = glm::length(direction);
    if (length == 0) return 0;  // nothing lies between a light and a particle at the same place
    direction /= length;
  }
  double depth = 0;
  for (std::size_t j = 0; j < tree.particleCount(); ++j)
    if (j != slot)
      depth += tree.peak[j] *
               oracleShare(dvec3(tree.position(j)) - origin, direction, length, tree.radius[j], falloff, endpoint);
  return depth;
}

/// … of every slot.
inline std::vector<double> oracleOpticalDepths(const Octree& tree, const layout::Light& light, layout::uint falloff,
                                               layout::uint endpoint) {
  std::vector<double> depths(tree.particleCount());
  for (std::size_t i = 0; i < depths.size(); ++i) depths[i] = oracleOpticalDepth(tree, i, light, falloff, endpoint);
  return depths;
}

}  // namespace mote
