#include "engine/passes/grid_blocks.h"

#include <algorithm>
#include <cmath>

#include "host/core/parallel.h"

namespace mote {
namespace {

constexpr layout::uint kBlocks = layout::kTileBlocks * layout::kTileBlocks;
static_assert(kTileCells + 1 <= layout::kBlockEdge * layout::kTileBlocks);
static_assert(kGroupBins == layout::kBlockBins);

/// Nodes: the device may round in another way than what says which a kernel covers.
constexpr float kSlack = 1e-3f;

/// Nodes from lo to hi, within the tile; none where hi < lo. By casts: this is asked for every particle, and rounding
/// is a function's call where the machine's oldest instructions are all there is.
struct Nodes {
  int lo, hi;
  Nodes(float from, float to) {
    const float low = std::clamp(from, 0.0f, float{kTileCells + 1}), high = std::clamp(to, -1.0f, float{kTileCells});
    lo = static_cast<int>(low), hi = static_cast<int>(high + 1) - 1;
    lo += static_cast<float>(lo) < low ? 1 : 0;
  }
  Nodes(int from, int to) : lo(std::max(from, 0)), hi(std::min(to, kTileCells)) {}
  bool empty() const { return lo > hi; }
  std::uint32_t firstBlock() const { return static_cast<std::uint32_t>(lo) / layout::kBlockEdge; }
  std::uint32_t lastBlock() const { return static_cast<std::uint32_t>(hi) / layout::kBlockEdge; }
};

/// Group by number among those that the tile has; < 0: left out.
int numberOf(const GridTile& tile, int group) { return tile.placeOfGroup(group) / kGroupBins - 1; }

void setReceivers(const GridTile& tile, const Receivers& receivers, std::span<const std::uint32_t> members,
                  std::span<const std::uint32_t> slots, GridArrays& to) {
  const GridPoints& points = tile.receiverPoints();
  const GridParticles& p = tile.particles;
  to.receivers.resize(members.size());
  for (std::size_t c = 0; c < tile.channels; ++c) to.own[c].assign(members.size(), 0.0f);
  for (std::size_t k = 0; k < members.size(); ++k) {
    const std::int32_t bin = points.bin[k];
    to.receivers[k] = {points.x[k], points.y[k], points.depth[k] - static_cast<float>(bin),
                       static_cast<layout::uint>(numberOf(tile, bin >> 2)) * kGroupPlaces +
                           static_cast<layout::uint>(bin & (kGroupBins - 1))};
    std::size_t self = k;
    if (!tile.receiversAreParticles) {
      const std::uint32_t slot = receivers.selfOf(members[k]);
      const auto at = std::lower_bound(slots.begin(), slots.end(), slot);
      if (at == slots.end() || *at != slot) continue;
      self = static_cast<std::size_t>(at - slots.begin());
    }
    for (std::size_t c = 0; c < tile.channels; ++c) to.own[c][k] = p.peak[c][self] * p.own[self];
  }
}

/// Strands of a tile's middle are longer than those of its edge, and lavapipe gives each thread one run of workgroups:
/// short runs are mixed, so that any part of the list takes about as long as another of its length.
void mix(std::vector<layout::GridStrand>& strands) {
  constexpr std::size_t kRun = layout::kTileBlocks,
                        kStep = 79;  // a prime: every run once unless it divides their number
  const std::size_t runs = strands.size() / kRun;
  if (runs % kStep == 0) return;
  const std::vector<layout::GridStrand> old = strands;
  for (std::size_t run = 0; run < runs; ++run)
    std::copy_n(old.begin() + static_cast<std::ptrdiff_t>(run * kStep % runs * kRun), kRun,
                strands.begin() + static_cast<std::ptrdiff_t>(run * kRun));
}

}  // namespace

GridArrays::Pieces& piecesOf(std::vector<GridArrays::Pieces>& all, const GridArrays::Pieces::Key& key) {
  const auto before = [](const GridArrays::Pieces& a, const GridArrays::Pieces::Key& b) { return a.key < b; };
  const auto at = std::lower_bound(all.begin(), all.end(), key, before);
  if (at != all.end() && at->key == key) return *at;
  return *all.insert(at, {key, {}});
}

GridCounts GridArrays::counts() const {
  GridCounts counts{.kernels = kernels.size(),
                    .entries = entries.size(),
                    .blocks = blocks.size(),
                    .table = table.size(),
                    .receivers = receivers.size(),
                    .stored = storedBlocks};
  for (const Pieces& p : pieces) counts.strands += p.strands.size();
  return counts;
}

void GridBlocks::setUp(GridTile& tile, const Receivers& receivers, std::span<const std::uint32_t> members,
                       std::span<const std::uint32_t> slots, std::uint32_t lanes, std::uint32_t mostSteps,
                       GridArrays& to) {
  groups_ = static_cast<std::size_t>(*std::max_element(tile.groupAt.begin(), tile.groupAt.end())) / kGroupBins;
  weighTile(tile, scale_);
  setKernels(tile, to);
  sortEntries(to);
  setBlocks(tile, lanes, mostSteps, to);
  setReceivers(tile, receivers, members, slots, to);
}

void GridBlocks::setKernels(GridTile& tile, GridArrays& to) {
  GridParticles& p = tile.particles;
  const std::size_t count = p.points.count;
  const auto cell = static_cast<float>(tile.shape->resolution.cell);
  const int lastGroup = tile.firstGroup + static_cast<int>(tile.groupAt.size()) - 1;
  to.kernels.resize(count);
  // Beyond the end: what `put` below looks at in vain.
  start_.assign((kBlocks + layout::kTileBlocks + 2) * groups_ + 2, 0);
  kinds_.assign(kBlocks + layout::kTileBlocks + 2, 0);
  const auto number = static_cast<std::uint32_t>(groups_);
  std::size_t found = 0;
  const bool colours = tile.channels > 1;
  for (std::size_t c = 0; colours && c < tile.channels; ++c) to.peaks[c].assign(p.peak[c].at(0), p.peak[c].at(count));
  for (std::size_t i = 0; i < count; ++i) {
    layout::GridKernel& kernel = to.kernels[i] = {};
    const int window = windowOf(p, i);
    if (window == 0) {
      p.own[i] = 0;
      continue;
    }
    const float x = p.points.x[i], y = p.points.y[i], reach = reachOf(p, i, window) + kSlack;
    Nodes columns(x - reach, x + reach), rows(y - reach, y + reach);
    std::uint32_t kind = window == 2 ? kTentKernels : kEllipseKernels;
    kernel = {x, y, p.depth[i], 1.0f / p.depthRadius[i], p.a[i], p.b[i], window == 2 ? 0.0f : p.c[i], scale_[i]};
    if (p.curved[i] > 0 || reach > kMostReach) {
      const LoneKernel lone = weighAlone(tile, i);
      p.own[i] = lone.own;
      if (!(lone.scale > 0)) continue;
      kernel.scale = lone.scale;
      columns = Nodes(lone.firstColumn, lone.firstColumn + lone.columns - 1);
      rows = Nodes(lone.firstRow, lone.firstRow + lone.rows - 1);
      if (p.curved[i] > 0) kind = kCurvedKernels, kernel.a = p.curved[i] * (cell * cell), kernel.b = 0, kernel.c = -1;
    }
    if (!colours) kernel.scale *= p.peak[0][i];
    const int first = numberOf(tile, p.firstBin[i] >> 2);
    if (first < 0 || columns.empty() || rows.empty()) continue;
    const auto groups = static_cast<std::uint32_t>(std::min(p.lastBin[i] >> 2, lastGroup) - (p.firstBin[i] >> 2) + 1);
    const std::uint32_t firstRow = rows.firstBlock(), rowCount = rows.lastBlock() - firstRow + 1;
    const std::uint32_t firstColumn = columns.firstBlock(), columnCount = columns.lastBlock() - firstColumn + 1;
    if (found + 8 + rowCount * columnCount * groups > found_.size())
      found_.resize(2 * (found + 8 + rowCount * columnCount * groups));
    const auto put = [&](std::uint32_t row, std::uint32_t column, std::uint32_t group, bool really) {
      const std::uint32_t block = (firstRow + row) * layout::kTileBlocks + firstColumn + column;
      const std::uint32_t at = block * number + static_cast<std::uint32_t>(first) + group;
      start_[at + 2] += really;
      kinds_[block] |= really ? kind : 0;
      found_[found] = {at, static_cast<std::uint32_t>(i)};
      found += really;
    };
    if (rowCount <= 2 && columnCount <= 2 && groups <= 2) {  // without a loop whose end is a guess
      for (std::uint32_t k = 0; k < 8; ++k)
        put(k >> 2, k >> 1 & 1, k & 1, (k >> 2) < rowCount && (k >> 1 & 1) < columnCount && (k & 1) < groups);
      continue;
    }
    for (std::uint32_t row = 0; row < rowCount; ++row)
      for (std::uint32_t column = 0; column < columnCount; ++column)
        for (std::uint32_t group = 0; group < groups; ++group) put(row, column, group, true);
  }
  to.entries.resize(found);
}

void GridBlocks::sortEntries(GridArrays& to) {
  // Counts stand two places on, then beginnings one place on, which become ends and so the next one's beginnings.
  start_.resize(kBlocks * groups_ + 2);
  for (std::size_t k = 2; k < start_.size(); ++k) start_[k] += start_[k - 1];
  for (std::size_t k = 0; k < to.entries.size(); ++k) to.entries[start_[found_[k].block + 1]++] = found_[k].kernel;
}

void GridBlocks::setBlocks(const GridTile& tile, std::uint32_t lanes, std::uint32_t mostSteps, GridArrays& to) const {
  std::vector<float> binOf(groups_);
  for (std::size_t k = 0; k < tile.groupAt.size(); ++k)
    if (tile.groupAt[k] >= 0)
      binOf[static_cast<std::size_t>(tile.groupAt[k] / kGroupBins - 1)] =
          static_cast<float>((tile.firstGroup + static_cast<int>(k)) * kGroupBins);
  to.blocks.clear(), to.pieces.clear();
  to.table.resize(kBlocks * groups_);
  to.storedBlocks = 0;
  const double cell = tile.shape->resolution.cell;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const std::size_t column = b % layout::kTileBlocks * layout::kBlockEdge,
                      row = b / layout::kTileBlocks * layout::kBlockEdge;
    layout::GridStrand strand{static_cast<layout::uint>(to.blocks.size()),
                              0,
                              static_cast<float>(column),
                              static_cast<float>(row),
                              static_cast<float>((tile.firstColumn + static_cast<double>(column)) * cell),
                              static_cast<float>((tile.firstRow + static_cast<double>(row)) * cell)};
    std::uint32_t round = 0, steps = 0, last = 0;
    const auto finish = [&] {
      strand.end = static_cast<layout::uint>(to.blocks.size());
      if (strand.end > strand.first)
        piecesOf(to.pieces, {round, kinds_[b], round > 0}).strands.push_back(strand), ++round;
      strand.first = strand.end, steps = 0;
    };
    for (std::size_t g = 0; g < groups_; ++g) {
      std::uint32_t first = start_[b * groups_ + g];
      const std::uint32_t end = start_[b * groups_ + g + 1];
      if (first < end) last = 2 * ++to.storedBlocks;
      const std::uint32_t entry = last + (first < end ? 1 : 0);
      to.table[g * kBlocks + b].here = entry;
      if (b > 0) to.table[g * kBlocks + b - 1].right = entry;
      while (first < end) {
        const std::uint32_t here = std::min({end - first, (mostSteps - steps - 1) * lanes, kMostBlockEntries});
        to.blocks.push_back({first, first + here, to.storedBlocks, binOf[g]});
        first += here, steps += 1 + (here + lanes - 1) / lanes;
        if (first < end || (steps + 2 > mostSteps && g + 1 < groups_)) {
          finish();
          // A piece that goes on begins with the last one's block, for what is left of it, or for nothing.
          if (first == end) to.blocks.push_back({end, end, to.storedBlocks, binOf[g]}), steps = 2;
        }
      }
    }
    finish();
  }
}

std::vector<GridArrays::Pieces> joinPieces(std::span<const GridArrays* const> tiles) {
  std::vector<GridArrays::Pieces> all;
  std::uint32_t blocks = 0;
  for (const GridArrays* tile : tiles) {
    for (const GridArrays::Pieces& pieces : tile->pieces) {
      std::vector<layout::GridStrand>& to = piecesOf(all, pieces.key).strands;
      for (layout::GridStrand strand : pieces.strands) {
        strand.first += blocks, strand.end += blocks;
        to.push_back(strand);
      }
    }
    blocks += static_cast<std::uint32_t>(tile->blocks.size());
  }
  for (GridArrays::Pieces& pieces : all) mix(pieces.strands);
  return all;
}

void join(std::span<const GridArrays* const> tiles, std::size_t channels, const GridTargets& to) {
  struct Base {
    std::uint32_t kernels = 0, entries = 0, blocks = 0, table = 0, receivers = 0, stored = 0;
  };
  std::vector<Base> bases(tiles.size());
  const auto number = [](const auto& array) { return static_cast<std::uint32_t>(array.size()); };
  for (std::size_t t = 1; t < tiles.size(); ++t) {
    const Base& last = bases[t - 1];
    const GridArrays& tile = *tiles[t - 1];
    bases[t] = {last.kernels + number(tile.kernels),     last.entries + number(tile.entries),
                last.blocks + number(tile.blocks),       last.table + number(tile.table),
                last.receivers + number(tile.receivers), last.stored + tile.storedBlocks};
  }
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
    for (std::size_t k = 0; k < tile.blocks.size(); ++k) {
      layout::GridBlock block = tile.blocks[k];
      block.first += base.entries, block.end += base.entries, block.stored += base.stored;
      to.blocks[base.blocks + k] = block;
    }
    // What lies before everything is the same block for all.
    const auto entry = [&](std::uint32_t own) { return own < 2 ? 0 : own + 2 * base.stored; };
    for (std::size_t k = 0; k < tile.table.size(); ++k)
      to.table[base.table + k] = {entry(tile.table[k].here), entry(tile.table[k].right)};
    for (std::size_t k = 0; k < tile.receivers.size(); ++k) {
      layout::GridReceiver receiver = tile.receivers[k];
      receiver.place += base.table * layout::kBlockBins;
      to.receivers[base.receivers + k] = receiver;
    }
  });
}

}  // namespace mote
