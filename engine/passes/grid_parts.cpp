#include "engine/passes/grid_parts.h"

#include <algorithm>
#include <numeric>

#include "host/core/error.h"

namespace mote {
namespace {

/// Receivers of a step: few beside a block's particles, many beside what a step costs.
constexpr std::uint32_t kMostReceivers = 1024;
constexpr std::uint32_t kNone = ~0u;

std::uint32_t number(std::size_t size) { return static_cast<std::uint32_t>(size); }

}  // namespace

std::size_t GridParts::Piece::column() const {
  return static_cast<std::size_t>(strand.row) / layout::kBlockEdge * layout::kTileBlocks +
         static_cast<std::size_t>(strand.column) / layout::kBlockEdge;
}

GridParts::GridParts(const GridArrays& tile) : tile_(tile) {
  for (const GridArrays::Pieces& pieces : tile.pieces)
    for (const layout::GridStrand& strand : pieces.strands) pieces_.push_back({strand, pieces.key.kinds});
  const auto before = [](const Piece& a, const Piece& b) { return a.strand.first < b.strand.first; };
  std::sort(pieces_.begin(), pieces_.end(), before);
  setSteps();
  setLeast();
}

void GridParts::setSteps() {
  std::vector<std::uint32_t> groupOf(tile_.storedBlocks + 1, 0);
  for (std::size_t k = 0; k < tile_.table.size(); ++k)
    if ((tile_.table[k].here & 1) != 0) groupOf[tile_.table[k].here >> 1] = number(k / kStrands);
  for (std::uint32_t p = 0; p < pieces_.size(); ++p)
    for (std::uint32_t b = pieces_[p].strand.first; b < pieces_[p].strand.end; ++b)
      if (tile_.blocks[b].first < tile_.blocks[b].end)  // else a piece's beginning, which a part makes itself
        steps_.push_back({groupOf[tile_.blocks[b].stored], p, b, b + 1});

  const auto groupOfReceiver = [&](std::uint32_t k) { return tile_.receivers[k].place / kGroupPlaces; };
  order_.resize(tile_.receivers.size());
  std::iota(order_.begin(), order_.end(), 0u);
  std::stable_sort(order_.begin(), order_.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return groupOfReceiver(a) < groupOfReceiver(b); });
  for (std::uint32_t first = 0, end = 0; first < order_.size(); first = end) {
    const std::uint32_t group = groupOfReceiver(order_[first]);
    while (end < order_.size() && end < first + kMostReceivers && groupOfReceiver(order_[end]) == group) ++end;
    steps_.push_back({group, kReads, first, end});
  }
  // Blocks before receivers; of a strand as they are.
  std::stable_sort(steps_.begin(), steps_.end(), [](const Step& a, const Step& b) {
    return std::pair(a.group, a.piece == kReads) < std::pair(b.group, b.piece == kReads);
  });
}

void GridParts::setLeast() {
  std::array<bool, kStrands> touched{};
  for (const Piece& piece : pieces_) touched[piece.column()] = true;
  for (const layout::GridBlock& block : tile_.blocks)
    least_.entries = std::max<std::uint64_t>(least_.entries, block.end - block.first);
  least_.kernels = least_.entries;
  least_.strands = pieces_.size(), least_.blocks = pieces_.size() + 1;
  least_.stored = static_cast<std::uint64_t>(std::count(touched.begin(), touched.end(), true)) + 1;
  least_.table = kStrands;
  least_.receivers = std::min<std::uint64_t>(kMostReceivers, order_.size());
}

void GridParts::start(const GridCounts& most, std::size_t channel) {
  MOTE_CHECK(least_.within(most), ==, true);
  most_ = most, channel_ = channel;
  next_ = 0, last_ = {};
  slotOf_.assign(tile_.storedBlocks + 1, 0);
  localOf_.assign(tile_.kernels.size(), kNone);
  free_.resize(most.stored);
  std::iota(free_.rbegin(), free_.rend(), 1u);
}

bool GridParts::next(GridArrays& to) {
  has_ = {};
  for (auto& blocks : chosen_) blocks.clear();
  kernels_.clear(), groups_.clear(), receivers_.clear(), over_.clear();
  const std::size_t first = next_;
  while (next_ < steps_.size() && add(steps_[next_])) ++next_;
  if (next_ == first) {
    MOTE_CHECK(next_, ==, steps_.size());
    return false;
  }
  putKernels(to);
  to.entries.clear(), to.blocks.clear(), to.pieces.clear();
  for (const auto& blocks : chosen_) putStrand(blocks, to);
  putReceivers(to);
  to.storedBlocks = number(most_.stored);
  free_.insert(free_.end(), over_.begin(), over_.end());
  for (const std::uint32_t kernel : kernels_) localOf_[kernel] = kNone;
  return true;
}

bool GridParts::add(const Step& step) { return step.piece == kReads ? addReceivers(step) : addBlock(step); }

bool GridParts::addBlock(const Step& step) {
  const layout::GridBlock& block = tile_.blocks[step.first];
  const std::size_t strand = pieces_[step.piece].column();
  std::vector<Chosen>& chosen = chosen_[strand];
  const bool begins = chosen.empty() || chosen.back().piece != step.piece, goesOn = last_[strand] == block.stored;
  const std::span<const std::uint32_t> entries = std::span(tile_.entries).subspan(block.first, block.end - block.first);
  const auto isNew = [&](std::uint32_t kernel) { return localOf_[kernel] == kNone; };
  GridCounts has = has_;
  has.kernels += static_cast<std::uint64_t>(std::count_if(entries.begin(), entries.end(), isNew));
  has.entries += entries.size();
  has.blocks += begins ? 2 : 1, has.strands += begins ? 1 : 0;
  if (!has.within(most_) || (!goesOn && free_.empty())) return false;
  has_ = has;
  chosen.push_back({step.piece, step.first, last_[strand]});
  for (const std::uint32_t kernel : entries) {
    if (!isNew(kernel)) continue;
    localOf_[kernel] = number(kernels_.size());
    kernels_.push_back(kernel);
  }
  if (goesOn) return true;
  if (last_[strand] != 0) over_.push_back(slotOf_[last_[strand]]);
  last_[strand] = block.stored;
  slotOf_[block.stored] = free_.back();
  free_.pop_back();
  return true;
}

bool GridParts::addReceivers(const Step& step) {
  const bool begins = groups_.empty() || groups_.back() != step.group;
  GridCounts has = has_;
  has.table += begins ? kStrands : 0, has.receivers += step.end - step.first;
  if (!has.within(most_)) return false;
  has_ = has;
  if (begins) groups_.push_back(step.group);
  receivers_.insert(receivers_.end(), order_.begin() + step.first, order_.begin() + step.end);
  return true;
}

void GridParts::putKernels(GridArrays& to) const {
  to.kernels.clear(), to.peaks[0].clear();
  for (const std::uint32_t kernel : kernels_) to.kernels.push_back(tile_.kernels[kernel]);
  if (tile_.peaks[channel_].empty()) return;
  for (const std::uint32_t kernel : kernels_) to.peaks[0].push_back(tile_.peaks[channel_][kernel]);
}

void GridParts::putStrand(std::span<const Chosen> blocks, GridArrays& to) const {
  std::uint32_t round = 0;
  for (std::size_t k = 0, end = 0; k < blocks.size(); k = end) {
    const Piece& piece = pieces_[blocks[k].piece];
    layout::GridStrand strand = piece.strand;
    strand.first = number(to.blocks.size());
    const layout::GridBlock& begin = tile_.blocks[blocks[k].block];
    // Where sums of the block before go on, a block of nothing takes them up: its end is not 0, and its particle none.
    if (blocks[k].before != 0 && blocks[k].before != begin.stored)
      to.blocks.push_back({1, 1, slotOf_[blocks[k].before], begin.bin});
    for (; end < blocks.size() && blocks[end].piece == blocks[k].piece; ++end) {
      const layout::GridBlock& block = tile_.blocks[blocks[end].block];
      const std::uint32_t first = number(to.entries.size());
      for (std::uint32_t e = block.first; e < block.end; ++e) to.entries.push_back(localOf_[tile_.entries[e]]);
      to.blocks.push_back({first, number(to.entries.size()), slotOf_[block.stored], block.bin});
    }
    strand.end = number(to.blocks.size());
    piecesOf(to.pieces, {round++, piece.kinds, blocks[k].before != 0}).strands.push_back(strand);
  }
}

void GridParts::putReceivers(GridArrays& to) const {
  to.table.clear(), to.receivers.clear(), to.own[0].clear();
  for (const std::uint32_t group : groups_)
    for (std::size_t b = 0; b < kStrands; ++b) {
      const auto entry = [&](std::size_t strand) {
        if (strand == kStrands) return 0u;
        const std::uint32_t own = tile_.table[group * kStrands + strand].here;
        return 2 * slotOf_[own >> 1] + (own & 1);
      };
      to.table.push_back({entry(b), entry(b + 1)});
    }
  std::size_t at = 0;
  for (const std::uint32_t k : receivers_) {
    layout::GridReceiver receiver = tile_.receivers[k];
    while (groups_[at] != receiver.place / kGroupPlaces) ++at;
    receiver.place = number(at) * kGroupPlaces + receiver.place % kGroupPlaces;
    to.receivers.push_back(receiver);
    to.own[0].push_back(tile_.own[channel_][k]);
  }
}

}  // namespace mote
