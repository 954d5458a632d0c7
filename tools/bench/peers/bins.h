// Items sorted into the bins that they touch: how splats are handed to tiles of a map and particles to bricks of a
// grid.
#pragma once
#include <cstdint>
#include <vector>

#include "host/core/parallel.h"

namespace mote {

struct Bins {
  std::vector<std::uint32_t> first;  ///< where each bin starts in `item`, and the end
  std::vector<std::uint32_t> item;   ///< items of each bin, ascending
};

/// touch(item, visit) calls visit(bin) once for each bin that the item lies in; it is called twice for every item.
/// Parallel over blocks of items; the result does not depend on their number.
template <class Touch>
Bins sortIntoBins(std::size_t items, std::size_t bins, const Touch& touch) {
  // A table of counts for each block: a few a thread balance the load, more would cost more than the items.
  const std::size_t blocks = 4 * std::size_t{threadCount()};
  const std::size_t grain = (items + blocks - 1) / blocks;
  std::vector<std::vector<std::uint32_t>> place(blocks);
  parallelBlocks(blocks, 1, [&](std::size_t block, std::size_t) {
    place[block].assign(bins, 0);
    for (std::size_t i = block * grain; i < std::min(items, (block + 1) * grain); ++i)
      touch(i, [&](std::size_t bin) { ++place[block][bin]; });
  });
  Bins sorted;
  sorted.first.resize(bins + 1);
  std::uint32_t next = 0;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    sorted.first[bin] = next;
    for (std::vector<std::uint32_t>& counts : place) {
      const std::uint32_t count = counts[bin];
      counts[bin] = next;
      next += count;
    }
  }
  sorted.first[bins] = next;
  sorted.item.resize(next);
  parallelBlocks(blocks, 1, [&](std::size_t block, std::size_t) {
    for (std::size_t i = block * grain; i < std::min(items, (block + 1) * grain); ++i)
      touch(i, [&](std::size_t bin) { sorted.item[place[block][bin]++] = static_cast<std::uint32_t>(i); });
  });
  return sorted;
}

}  // namespace mote
