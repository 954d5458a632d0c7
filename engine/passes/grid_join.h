// Arrays of several tiles of a light grid behind one another, for one submission.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "engine/passes/grid_blocks.h"

namespace mote {

/// Where the arrays of several tiles go, one behind the other; the device's own memory, perhaps.
struct GridTargets {
  std::span<layout::GridKernel> kernels;
  std::span<float> peaks;  ///< [channel][kernel]; none where there is one channel
  std::span<std::uint32_t> entries;
  std::span<std::uint32_t> blocks;
  std::span<layout::GridStrand> strands;
  std::span<layout::GridPlaces> table;
  std::span<layout::GridReceiver> receivers;
  std::span<float> own;  ///< [channel][receiver]
};
/// Puts the arrays of tiles behind one another, numbers set right. Spans are as long as the tiles' arrays together.
void join(std::span<const GridArrays* const> tiles, std::size_t channels, const GridTargets& to);

/// Works of tiles with the same kinds of kernels.
struct GridWorks {
  std::uint32_t kinds = 0, first = 0, count = 0;
};
/// … and their works, in an order that suits the device: neighbours in runs of `lanes` have about as many particles
/// each, and any part of a list takes about as long as another of its length.
std::vector<GridWorks> joinWorks(std::span<const GridArrays* const> tiles, std::uint32_t lanes,
                                 std::span<layout::GridWork> to);

}  // namespace mote
