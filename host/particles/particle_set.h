// The particles of one frame, in scene space, as the octree and the lighting take them.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "host/core/vec.h"

namespace mote {

/// Structure of arrays. Every array has size() entries or, where the remark says so, none.
///
/// Where there is absorption, a particle's extinction per colour channel is
///   density · (color · medium.albedo + absorption) · medium.extinction, else density · medium.extinction.
struct ParticleSet {
  std::vector<vec3> position;  ///< centre − origin [scene units], finite
  std::vector<float> radius;   ///< support radius r [scene units], finite, > 0
  std::vector<float> density;  ///< Density: cross-section [scene units²], in mode `peak` optical depth; finite, ≥ 0
  std::vector<vec3> color;     ///< scattering albedo, RGB; empty: all of them `uniformColor`
  std::vector<vec3> velocity;  ///< [scene units / s]; empty: no source has it
  std::vector<std::uint64_t> id;  ///< empty: no source has it
  std::vector<vec3> absorption;   ///< RGB, relative to `density`, finite, ≥ 0; empty: no source has it
  std::vector<vec3> emission;     ///< radiance, RGB [W/(m² sr)], finite, ≥ 0; empty: no source has it
  /// While the shutter is open a particle moves evenly; t after the frame's time it is at position + shutterShift +
  /// t · shutterVelocity, which is exact when the shutter opens and closes. Empty: at position + t · velocity.
  std::vector<vec3> shutterVelocity, shutterShift;
  vec3 uniformColor{1};
  dvec3 origin{0};  ///< of scene space, what positions are measured from

  std::size_t size() const { return position.size(); }
  Bounds bounds() const;         ///< of the centres
  Bounds supportBounds() const;  ///< of the supports
};

/// Mean, least and greatest support radius.
struct RadiusRange {
  float min = 0, mean = 0, max = 0;
};
RadiusRange radiusRange(const ParticleSet& set);

}  // namespace mote
