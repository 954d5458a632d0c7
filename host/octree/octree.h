// The density octree (Monette 2011, §4.1.1): a loose octree over particles, flattened for stackless walks.
//
// Loose: a particle belongs to the cell of its centre, and a node's box bounds the supports of its particles.
// Subdivided only as needed: a cell with at most `particlesPerCell` particles is a leaf; a chain of cells with one
// child each is one node. Particles stand in Morton order, so every node owns a range of slots.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/core/vec.h"
#include "shaders/glsl/layout/node.h"

namespace mote {

/// Most particles of a leaf: the rule of "particles_per_cell": "auto", measured. Seconds of exact lighting on TBB
/// (AVX-512, noise cloud of 1 M, three lights, least of six runs in turn) relative to 64:
///     16     32     64     128    256    512
///     1.04   1.02   1      0.97   0.96   0.96
/// A column walks the tree once for thousands of rays, so it hardly matters; larger leaves make boxes of nodes coarser
/// for those who test a subgroup's width of particles at once.
constexpr std::uint32_t kDefaultParticlesPerCell = 64;

/// Arrays of particles are this much longer than particleCount(), so that vector loads may run over the end.
/// The extra entries are particles far away with radius 0.
constexpr std::size_t kSlotPadding = 16;

struct Octree {
  std::vector<layout::Node> nodes;         ///< depth first; the last is the sentinel
  std::vector<float> x, y, z;              ///< centres in slot order [scene units]; padded
  std::vector<float> radius;               ///< support radii in slot order; padded
  std::vector<float> peak;                 ///< optical depth through the centre in slot order; padded
  std::vector<float> peakGreen, peakBlue;  ///< … of the other colours, where they differ (peak is red then); else empty
  std::vector<std::uint32_t> source;       ///< slot → index in the input; not padded
  float leastRadius = 0;                   ///< smallest support radius above 0; 0 without particles
  double meanRadius = 0;                   ///< of all support radii; 0 without particles

  /// 1: one sum serves all colours; 3: each has its own.
  std::size_t channels() const { return peakGreen.empty() ? 1 : 3; }
  std::size_t particleCount() const { return source.size(); }
  std::size_t nodeCount() const { return nodes.empty() ? 0 : nodes.size() - 1; }
  vec3 position(std::size_t slot) const { return {x[slot], y[slot], z[slot]}; }
  Bounds bounds() const;  ///< of all supports
};

/// What an octree is made of, in any order; arrays of one length.
struct OctreeInput {
  std::span<const vec3> position;                    ///< finite
  std::span<const float> radius;                     ///< finite, ≥ 0
  std::span<const float> peak, peakGreen, peakBlue;  ///< finite, ≥ 0; green and blue both empty or both given
};

/// Builds the tree in parallel; the result does not depend on the number of threads.
/// `position` and `radius` (same length, finite, radius ≥ 0) and `peak` (same length, finite, ≥ 0) in any order.
/// Up to 2³² − 2 particles. About 0.1 s per million on two cores; 24 bytes a particle and 32 bytes a node.
Octree buildOctree(std::span<const vec3> position, std::span<const float> radius, std::span<const float> peak,
                   std::uint32_t particlesPerCell = kDefaultParticlesPerCell);
Octree buildOctree(const OctreeInput& input, std::uint32_t particlesPerCell = kDefaultParticlesPerCell);

/// Indices of the positions in Morton order, ties by index: the order in which a tree over them has its slots.
std::vector<std::uint32_t> mortonOrder(std::span<const vec3> position);

/// Checks every promise of the layout: order, skip links, ranges, conservative and nested boxes, each particle exactly
/// once, leaf sizes. Returns the first broken promise as a sentence, or "" if all hold. Cost O(particles · depth).
std::string validate(const Octree& tree, std::uint32_t particlesPerCell);

}  // namespace mote
