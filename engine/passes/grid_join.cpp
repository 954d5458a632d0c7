#include "engine/passes/grid_join.h"

#include <algorithm>

#include "host/core/parallel.h"

namespace mote {
namespace {

/// Where a tile's arrays begin in those of all.
struct Base {
  std::uint32_t kernels = 0, entries = 0, works = 0, strands = 0, table = 0, receivers = 0, stored = 0;
};
std::vector<Base> basesOf(std::span<const GridArrays* const> tiles) {
  std::vector<Base> bases(tiles.size());
  const auto number = [](const auto& array) { return static_cast<std::uint32_t>(array.size()); };
  for (std::size_t t = 1; t < tiles.size(); ++t) {
    const Base& last = bases[t - 1];
    const GridArrays& tile = *tiles[t - 1];
    bases[t] = {last.kernels + number(tile.kernels), last.entries + number(tile.entries),
                last.works + number(tile.works),     last.strands + number(tile.strands),
                last.table + number(tile.table),     last.receivers + number(tile.receivers),
                last.stored + tile.storedBlocks};
  }
  return bases;
}

/// Where works of one kind go.
struct WorkOrder {
  std::uint32_t kinds = 0, count = 0;
  std::vector<std::uint32_t> next = std::vector<std::uint32_t>(kMostWorkEntries + 2, 0);  ///< by number of particles
  std::vector<std::uint32_t> runTo;  ///< where each run of lanes goes

  /// Once `next[k + 1]` says how many have k. Runs of `lanes` are mixed: lavapipe gives each thread one part of them.
  void setUp(std::uint32_t lanes) {
    constexpr std::uint32_t kStep = 79;  // a prime: every run once unless it divides their number
    for (std::size_t k = 1; k < next.size(); ++k) next[k] += next[k - 1];
    const std::uint32_t runs = count / lanes, step = runs % kStep == 0 ? 1 : kStep;
    runTo.resize(runs);
    for (std::uint32_t run = 0; run < runs; ++run)
      runTo[static_cast<std::size_t>(std::uint64_t{run} * step % runs)] = run;
  }
  std::uint32_t place(const layout::GridWork& work, std::uint32_t lanes) {
    const std::uint32_t k = next[work.end - work.first]++, run = k / lanes;
    return run < runTo.size() ? runTo[run] * lanes + k % lanes : k;
  }
};

}  // namespace

std::vector<GridWorks> joinWorks(std::span<const GridArrays* const> tiles, std::uint32_t lanes,
                                 std::span<layout::GridWork> to) {
  std::vector<WorkOrder> orders;
  const auto orderOf = [&](std::uint32_t kinds) -> WorkOrder& {
    const auto at = std::find_if(orders.begin(), orders.end(), [&](const WorkOrder& o) { return o.kinds == kinds; });
    if (at != orders.end()) return *at;
    orders.emplace_back().kinds = kinds;
    return orders.back();
  };
  for (const GridArrays* tile : tiles) {
    if (tile->works.empty()) continue;
    WorkOrder& order = orderOf(tile->kinds);
    order.count += static_cast<std::uint32_t>(tile->works.size());
    for (const layout::GridWork& work : tile->works) ++order.next[work.end - work.first + 1];
  }
  std::vector<GridWorks> all;
  std::uint32_t begin = 0;
  for (WorkOrder& order : orders) {
    order.setUp(lanes);
    all.push_back({order.kinds, begin, order.count});
    begin += order.count;
  }
  const std::vector<Base> bases = basesOf(tiles);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    if (tiles[t]->works.empty()) continue;
    WorkOrder& order = orderOf(tiles[t]->kinds);
    const std::uint32_t first = all[static_cast<std::size_t>(&order - orders.data())].first;
    for (layout::GridWork work : tiles[t]->works) {
      work.first += bases[t].entries, work.end += bases[t].entries, work.sums += bases[t].works;
      to[first + order.place(work, lanes)] = work;
    }
  }
  return all;
}

void join(std::span<const GridArrays* const> tiles, std::size_t channels, const GridTargets& to) {
  const std::vector<Base> bases = basesOf(tiles);
  parallelBlocks(tiles.size(), 1, [&](std::size_t t, std::size_t) {
    const GridArrays& tile = *tiles[t];
    const Base& base = bases[t];
    std::copy(tile.kernels.begin(), tile.kernels.end(), to.kernels.begin() + base.kernels);
    for (std::size_t c = 0; c < channels; ++c) {
      if (!to.peaks.empty())
        std::copy(tile.peaks[c].begin(), tile.peaks[c].end(),
                  to.peaks.begin() + static_cast<std::ptrdiff_t>(c * to.kernels.size()) + base.kernels);
      std::copy(tile.own[c].begin(), tile.own[c].end(),
                to.own.begin() + static_cast<std::ptrdiff_t>(c * to.receivers.size()) + base.receivers);
    }
    for (std::size_t k = 0; k < tile.entries.size(); ++k) to.entries[base.entries + k] = tile.entries[k] + base.kernels;
    for (std::size_t k = 0; k < tile.blocks.size(); ++k) to.blocks[base.works + k] = tile.blocks[k] + base.stored;
    for (std::size_t k = 0; k < tile.strands.size(); ++k) {
      layout::GridStrand strand = tile.strands[k];
      strand.first += base.works, strand.end += base.works;  // `before` is of parts, which are alone
      to.strands[base.strands + k] = strand;
    }
    // What lies before everything is the same block for all.
    const auto entry = [&](std::uint32_t own) { return own < 2 ? 0 : own + 2 * base.stored; };
    for (std::size_t k = 0; k < tile.table.size(); ++k) {
      const auto& [here, right, below, belowRight] = tile.table[k];
      to.table[base.table + k] = {entry(here), entry(right), entry(below), entry(belowRight)};
    }
    for (std::size_t k = 0; k < tile.receivers.size(); ++k) {
      layout::GridReceiver receiver = tile.receivers[k];
      receiver.place += base.table * layout::kBlockBins;
      to.receivers[base.receivers + k] = receiver;
    }
  });
}

}  // namespace mote
