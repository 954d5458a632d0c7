// Sorted runs of (key, index) pairs made into one order: what a device sorted in parts.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shaders/glsl/layout/types.h"

namespace mote {

/// The indices (low words) of all pairs in ascending order. Run r is pairs[start[r] … start[r + 1]), ascending; no pair
/// stands twice, so the order is that of one sort over all, whatever the runs and the number of threads. O(N log runs)
/// on TBB; 4 bytes a pair for the result.
std::vector<layout::uint> mergeRuns(std::span<const std::uint64_t> pairs, std::span<const std::size_t> start);

}  // namespace mote
