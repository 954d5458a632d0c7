// The noise cloud that benchmarks light, and its light.
#pragma once
#include <cstdint>
#include <vector>

#include "host/octree/octree.h"
#include "host/particles/particle_set.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

/// What buildOctree takes.
struct BenchCloud {
  std::vector<vec3> position;
  std::vector<float> radius, peak;

  std::uint64_t count() const { return position.size(); }
  Octree tree(std::uint32_t particlesPerCell = kDefaultParticlesPerCell) const {
    return buildOctree(position, radius, peak, particlesPerCell);
  }
};

struct BenchCloudRadii {
  float radius = 0;  ///< of all particles; 0: 1.5 spacings (mean distance to the nearest 8) …
  double finer = 1;  ///< … of the cloud with so many times as many
  double range = 1;  ///< greatest / least: spread log-uniformly about that
};
/// `mote generate cloud` with seed 0; lines through particles have a mean optical depth of 4, as a scene's default.
BenchCloud benchCloud(std::uint64_t count, layout::uint falloff, const BenchCloudRadii& radii = {});

/// The same mean optical depth for any particles with positions, radii and densities (cross-sections).
BenchCloud calibrated(ParticleSet particles, layout::uint falloff);

/// A point light outside of the cloud, which lies within [-1, 1]³.
layout::Light benchLight();

}  // namespace mote
