// The density octree as a scene asks for it (Monette 2011, §4.6): which particles cast shadows, how large they are for
// the rays, and the particles that are lit.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/lighting/receivers.h"
#include "host/octree/octree.h"
#include "shaders/glsl/layout/medium.h"

namespace mote {

/// All particles of a frame, in input order.
struct DensityInput {
  std::span<const vec3> position;                    ///< [scene units]
  std::span<const float> radius;                     ///< support radii [scene units]
  std::span<const float> peak, peakGreen, peakBlue;  ///< optical depth through the centre; green and blue may be empty
  std::span<const std::uint64_t> id;                 ///< empty: the index
};

/// `compensate` lets the particles in the tree stand for all: the total cross-section stays, per colour, and radii
/// widen by 1/∛fraction, as much as the sample's spacing is wider. Without the widening the mean |ΔT| is twice as large
/// (50,000 particles of a ball at 10 %: 0.089 against 0.047).
struct DensityRules {
  bool crossSection = true;  ///< a particle's cross-section stays whatever its radius; else its peak does (mode peak)
  float radiusScale = 1;     ///< > 0: factor on the radii that rays meet (§4.6.4)
  float fraction = 1;        ///< 0 < fraction ≤ 1: share of the particles in the tree (§4.6.3)
  std::uint64_t seed = 0;    ///< of the choice
  bool compensate = true;    ///< the sample stands for all of them, see above
  std::uint32_t particlesPerCell = kDefaultParticlesPerCell;
};

class DensityTree {
 public:
  DensityTree() = default;
  /// Throws as buildOctree. With fraction 1: 24 bytes a particle (32 with three channels) and 32 a node; else 20 more
  /// for each particle and the same for each in the tree.
  DensityTree(const DensityInput& input, const DensityRules& rules);

  const Octree& tree() const { return tree_; }
  /// Every particle, in Morton order, each leaving itself out where it is in the tree. Valid while this lives.
  Receivers receivers() const;
  /// Receiver → index in the input.
  const std::vector<std::uint32_t>& source() const { return source_.empty() ? tree_.source : source_; }
  /// Multiplies every optical depth, which is proportional to the density.
  void scaleDensity(double scale);

 private:
  Octree tree_;
  // Only with a fraction below 1; else the tree's own arrays serve.
  std::vector<float> x_, y_, z_;
  std::vector<std::uint32_t> self_, source_;
};

}  // namespace mote
