// Mean distance of particles to their nearest neighbours: what `"radius": "auto"` is made from.
#pragma once
#include <cstdint>
#include <span>

#include "host/core/vec.h"

namespace mote {

constexpr int kSpacingNeighbours = 8;
constexpr double kAutoRadiusFactor = 1.5;  ///< × mean distance to the nearest 8; SCENE.md, "radius"

/// Mean over particles of the mean distance to each one's nearest 8 others (fewer where there are fewer), with exact
/// neighbours: all particles up to `maxQueries`, beyond it one drawn from each of `maxQueries` equal stretches of
/// the array by `seed`. Positions must be finite. 0 for fewer than two particles, or where all neighbours coincide.
/// Cost: 0.3 core-seconds for a million particles, 0.95 for four, shared by the threads, and some 8 bytes a particle
/// while it runs; clusters, outliers and coinciding particles cost no more. Same value for any number of threads. The
/// neighbours are nanoflann's.
double meanNeighbourDistance(std::span<const vec3> positions, std::size_t maxQueries = 4096, std::uint64_t seed = 0);

/// The same mean, analytically, for a Poisson process of `numberDensity` particles per unit³: Γ(k+1/3)/Γ(k) ·
/// (3/(4πn))^(1/3) for neighbour k (Hertz 1909), averaged over k = 1 … 8.
double poissonNeighbourDistance(double numberDensity);

}  // namespace mote
