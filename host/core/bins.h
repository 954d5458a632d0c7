// Sorting into bins by counting, in parallel: what the octree, beams, tiles of grids and tiles of pictures begin with.
#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>
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

namespace detail {

/// The two passes of sortIntoBins: first counts, then places.
struct BinCounts {
  std::uint32_t* counts;
  template <class Item>
  void operator()(std::size_t bin, const Item&) const {
    ++counts[bin];
  }
  template <class Item>
  void operator()(std::size_t bin, Item first, Item end) const {
    counts[bin] += static_cast<std::uint32_t>(end - first);
  }
};
template <class Item>
struct BinPlaces {
  std::uint32_t* next;
  Item* items;
  void operator()(std::size_t bin, const Item& item) const { items[next[bin]++] = item; }
  void operator()(std::size_t bin, Item first, Item end) const {
    std::iota(items + next[bin], items + next[bin] + (end - first), first);
    next[bin] += static_cast<std::uint32_t>(end - first);
  }
};

}  // namespace detail

/// `each(begin, end, put)` calls put(bin, item), or put(bin, first, end) for a run of numbers, for all that the inputs
/// [begin, end) of `count` give, in order; it is called twice for each part and must do the same both times. Fewer than
/// 2³² items. Within a bin they stand in that order, for any number of threads. Takes 256 bytes a bin while it runs;
/// `result` keeps its memory from call to call.
template <class Item, class Each>
void sortIntoBins(std::size_t count, std::size_t bins, const Each& each, Binned<Item>& result) {
  constexpr std::size_t kBlocks = 64;
  const std::size_t grain = std::max<std::size_t>((count + kBlocks - 1) / kBlocks, 1);
  std::vector<std::uint32_t> places(kBlocks * bins, 0);  // [block][bin]: counts, then where the next one goes
  parallelBlocks(count, grain, [&](std::size_t begin, std::size_t end) {
    each(begin, end, detail::BinCounts{places.data() + begin / grain * bins});
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
    each(begin, end, detail::BinPlaces<Item>{places.data() + begin / grain * bins, result.items.data()});
  });
}

template <class Item, class Each>
Binned<Item> sortIntoBins(std::size_t count, std::size_t bins, const Each& each) {
  Binned<Item> result;
  sortIntoBins(count, bins, each, result);
  return result;
}

}  // namespace mote
