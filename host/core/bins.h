// Sorting into bins by counting, in parallel: what the octree, beams, tiles of grids and tiles of pictures begin with.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "host/core/parallel.h"
#include "host/core/raw_vector.h"

namespace mote {

template <class Item>
struct Binned {
  RawVector<Item> items;             ///< bin after bin
  std::vector<std::uint32_t> start;  ///< of each bin in `items`, and the end

  std::size_t bins() const { return start.empty() ? 0 : start.size() - 1; }
  std::span<const Item> of(std::size_t bin) const {
    return std::span(items).subspan(start[bin], start[bin + 1] - start[bin]);
  }
};

/// `each(begin, end, put)` calls put(bin, item) for all that the inputs [begin, end) of `count` give, in order; it is
/// called twice for each part and must do the same both times. Fewer than 2³² items. Within a bin they stand in that
/// order, for any number of threads. Takes 256 bytes a bin while it runs; `result` keeps its memory from call to call.
template <class Item, class Each>
void sortIntoBins(std::size_t count, std::size_t bins, const Each& each, Binned<Item>& result) {
  constexpr std::size_t kBlocks = 64;
  const std::size_t grain = std::max<std::size_t>((count + kBlocks - 1) / kBlocks, 1);
  std::vector<std::uint32_t> places(kBlocks * bins, 0);  // [block][bin]: counts, then where the next one goes
  parallelBlocks(count, grain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* counts = places.data() + begin / grain * bins;
    each(begin, end, [counts](std::size_t bin, const Item&) { ++counts[bin]; });
  });
  result.start.resize(bins + 1);
  std::uint32_t at = 0;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    result.start[bin] = at;
    for (std::size_t block = 0; block < kBlocks; ++block) at += std::exchange(places[block * bins + bin], at);
  }
  result.start[bins] = at;
  result.items.resize(at);
  parallelBlocks(count, grain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* next = places.data() + begin / grain * bins;
    each(begin, end, [next, &result](std::size_t bin, const Item& item) { result.items[next[bin]++] = item; });
  });
}

template <class Item, class Each>
Binned<Item> sortIntoBins(std::size_t count, std::size_t bins, const Each& each) {
  Binned<Item> result;
  sortIntoBins(count, bins, each, result);
  return result;
}

}  // namespace mote
