#include "engine/passes/grid_blocks.h"

#include <algorithm>
#include <limits>

#include "host/core/error.h"

namespace mote {
namespace {

constexpr layout::uint kRow = layout::kTileBlocks, kBlocks = kRow * kRow;
static_assert(kTileCells + 1 <= layout::kBlockEdge * layout::kTileBlocks);
static_assert(kGroupBins == layout::kBlockBins);

/// Group by number among those that the tile has; < 0: left out.
int numberOf(const GridTile& tile, int group) { return tile.placeOfGroup(group) / kGroupBins - 1; }

std::uint32_t kindOf(const layout::GridKernel& kernel) {
  return kernel.curved > 0 ? kCurvedKernels : kernel.form > 0 ? kEllipseKernels : kTentKernels;
}

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

}  // namespace

GridCounts GridArrays::counts() const {
  return {.kernels = kernels.size(),
          .entries = entries.size(),
          .works = works.size(),
          .strands = strands.size(),
          .table = table.size(),
          .receivers = receivers.size(),
          .stored = storedBlocks};
}

void GridBlocks::setUp(GridTile& tile, const Receivers& receivers, std::span<const std::uint32_t> members,
                       std::span<const std::uint32_t> slots, GridArrays& to) {
  groups_ = static_cast<std::size_t>(*std::max_element(tile.groupAt.begin(), tile.groupAt.end())) / kGroupBins;
  const std::size_t count = tile.particles.points.count, room = count + kGridBatch;
  to.kernels.resize(room), blocks_.resize(room);
  weighTile(tile, to.kernels.data(), blocks_.data());
  to.kernels.resize(count);
  setKernels(tile, to);
  sortEntries(to);
  setWorks(tile, to);
  setReceivers(tile, receivers, members, slots, to);
}

void GridBlocks::setKernels(GridTile& tile, GridArrays& to) {
  GridParticles& p = tile.particles;
  const std::size_t count = p.points.count;
  const bool colours = tile.channels > 1;
  for (std::size_t c = 0; colours && c < tile.channels; ++c) to.peaks[c].assign(p.peak[c].at(0), p.peak[c].at(count));
  places_.resize(count);
  MOTE_CHECK(groups_, <=, std::size_t{std::numeric_limits<std::uint16_t>::max()});
  const auto groups = static_cast<std::uint32_t>(groups_);
  const int lastGroup = tile.firstGroup + static_cast<int>(tile.groupAt.size()) - 1;
  start_.assign(kBlocks * groups_ + 2, 0);
  std::uint32_t* const counts = start_.data() + 2;  // sortEntries
  inverseRadius_ = count > 0 ? to.kernels.front().inverseRadius : 0;
  const auto alike = [&](float radius) { return radius == p.depthRadius.front(); };
  to.kinds = 0;
  if (!std::all_of(p.depthRadius.data(), p.depthRadius.data() + count, alike)) to.kinds = kSeveralRadii;
  for (std::size_t i = 0; i < count; ++i) {
    const bool lone = blocks_[i] == CoveredBlocks::kAny;
    const CoveredBlocks blocks = lone ? CoveredBlocks(setLone(tile, i, to.kernels[i])) : CoveredBlocks(blocks_[i]);
    places_[i] = {};
    const int firstGroup = p.firstBin[i] >> 2, first = numberOf(tile, firstGroup);
    if (first < 0 || blocks.columns == 0) continue;
    const Place place{blocks.first * groups + static_cast<std::uint32_t>(first),
                      static_cast<std::uint16_t>(std::min(p.lastBin[i] >> 2, lastGroup) - firstGroup + 1),
                      static_cast<std::uint8_t>(blocks.columns), static_cast<std::uint8_t>(blocks.rows)};
    places_[i] = place;
    to.kinds |= kindOf(to.kernels[i]);
    forEachBlock(place, groups, [&](std::uint32_t at) { ++counts[at]; });
  }
}

CoveredNodes GridBlocks::setLone(GridTile& tile, std::size_t i, layout::GridKernel& kernel) const {
  GridParticles& p = tile.particles;
  const int window = windowOf(p, i);
  if (window == 0) {
    p.own[i] = 0;
    kernel = {};
    return {};
  }
  const float reach = reachOf(p, i, window);
  if (!(p.curved[i] > 0) && reach <= kMostReach) return {kernel.x, kernel.y, reach};
  const LoneKernel lone = weighAlone(tile, i);
  p.own[i] = lone.own;
  kernel.scale = 0;
  if (!(lone.scale > 0)) return {};
  kernel.scale = tile.channels > 1 ? lone.scale : lone.scale * p.peak[0][i];
  if (p.curved[i] > 0) {
    const auto cell = static_cast<float>(tile.shape->resolution.cell);
    kernel.form = p.curved[i] * (cell * cell), kernel.curved = 1;
  }
  CoveredNodes nodes;
  nodes.firstColumn = std::max(lone.firstColumn, 0), nodes.firstRow = std::max(lone.firstRow, 0);
  nodes.endColumn = std::min(lone.firstColumn + lone.columns, kTileCells + 1);
  nodes.endRow = std::min(lone.firstRow + lone.rows, kTileCells + 1);
  return nodes;
}

/// `add(at)` for each block and group of a place. The usual sizes branch, as neighbours mostly have the same: loops
/// over them take longer.
template <class Add>
void GridBlocks::forEachBlock(const Place& place, std::uint32_t groups, const Add& add) {
  const std::uint32_t at = place.first, rowStep = layout::kTileBlocks * groups;
  if (place.rows <= 2 && place.columns <= 2 && place.groups <= 2) {
    if (place.groups == 0) return;
    const auto addGroups = [&](std::uint32_t from) {
      add(from);
      if (place.groups > 1) add(from + 1);
    };
    addGroups(at);
    if (place.columns > 1) addGroups(at + groups);
    if (place.rows > 1) addGroups(at + rowStep);
    if (place.rows > 1 && place.columns > 1) addGroups(at + rowStep + groups);
    return;
  }
  for (std::uint32_t row = 0; row < place.rows; ++row)
    for (std::uint32_t column = 0; column < place.columns; ++column)
      for (std::uint32_t group = 0; group < place.groups; ++group) add(at + row * rowStep + column * groups + group);
}

void GridBlocks::sortEntries(GridArrays& to) {
  // Counts stand two places on; they become beginnings one place on, those ends, and so the next one's beginnings but
  // for the gaps (roomForEntries).
  std::uint32_t all = 0;
  start_[0] = 0;
  for (std::size_t k = 0; k < kBlocks * groups_; ++k) {
    const std::uint32_t count = start_[k + 2];
    start_[k + 1] = all;
    all += roomForEntries(count);
  }
  to.entries.resize(all);
  std::uint32_t *const next = start_.data() + 1, *const entries = to.entries.data();
  const auto groups = static_cast<std::uint32_t>(groups_);
  for (std::size_t i = 0; i < places_.size(); ++i)
    forEachBlock(places_[i], groups, [&](std::uint32_t at) { entries[next[at]++] = static_cast<std::uint32_t>(i); });
}

void GridBlocks::setWorks(const GridTile& tile, GridArrays& to) const {
  std::vector<float> binOf(groups_);
  for (std::size_t k = 0; k < tile.groupAt.size(); ++k)
    if (tile.groupAt[k] >= 0)
      binOf[static_cast<std::size_t>(tile.groupAt[k] / kGroupBins - 1)] =
          static_cast<float>((tile.firstGroup + static_cast<int>(k)) * kGroupBins);
  to.works.clear(), to.blocks.clear(), to.strands.clear();
  to.table.resize(kBlocks * groups_);
  to.storedBlocks = 0, to.begun = false;
  const double cell = tile.frame.perspective ? tile.shape->resolution.cell : 0;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const std::size_t column = b % layout::kTileBlocks * layout::kBlockEdge,
                      row = b / layout::kTileBlocks * layout::kBlockEdge;
    layout::GridWork work{};
    work.inverseRadius = inverseRadius_;
    work.column = static_cast<float>(column), work.row = static_cast<float>(row);
    work.u = static_cast<float>((tile.firstColumn + static_cast<double>(column)) * cell);
    work.v = static_cast<float>((tile.firstRow + static_cast<double>(row)) * cell);
    const auto strand = static_cast<layout::uint>(to.works.size());
    std::uint32_t last = 0;
    for (std::size_t g = 0; g < groups_; ++g) {
      const std::uint32_t first = roomForEntries(start_[b * groups_ + g]), end = start_[b * groups_ + g + 1];
      if (first < end) {
        last = 2 * ++to.storedBlocks;
        std::fill(to.entries.begin() + end, to.entries.begin() + roomForEntries(end), to.entries[end - 1]);
      }
      const std::uint32_t entry = last + (first < end ? 1 : 0);
      to.table[g * kBlocks + b].here = entry;
      if (b >= 1) to.table[g * kBlocks + b - 1].right = entry;
      if (b >= kRow) to.table[g * kBlocks + b - kRow].below = entry;
      if (b >= kRow + 1) to.table[g * kBlocks + b - kRow - 1].belowRight = entry;
      work.bin = binOf[g];
      for (work.first = first; work.first < end; work.first = work.end) {
        work.end = std::min(end, work.first + kMostWorkEntries);
        work.sums = static_cast<layout::uint>(to.works.size());
        to.begun = to.begun || work.first > first;
        to.works.push_back(work);
        to.blocks.push_back(to.storedBlocks);
      }
    }
    if (to.works.size() > strand) to.strands.push_back({strand, static_cast<layout::uint>(to.works.size()), 0});
  }
}

}  // namespace mote
