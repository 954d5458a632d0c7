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

GridParts::GridParts(const GridArrays& tile) : tile_(tile) {
  setSteps();
  setLeast();
}

void GridParts::setSteps() {
  std::vector<std::uint32_t> groupOf(tile_.storedBlocks + 1, 0);
  for (std::size_t k = 0; k < tile_.table.size(); ++k)
    if ((tile_.table[k].here & 1) != 0) groupOf[tile_.table[k].here >> 1] = number(k / kColumns);
  for (std::uint32_t s = 0; s < tile_.strands.size(); ++s)
    for (std::uint32_t w = tile_.strands[s].first; w < tile_.strands[s].end; ++w)
      steps_.push_back({groupOf[tile_.blocks[w]], s, w, w + 1});

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
  // Works before receivers; of a strand as they are.
  std::stable_sort(steps_.begin(), steps_.end(), [](const Step& a, const Step& b) {
    return std::pair(a.group, a.strand == kReads) < std::pair(b.group, b.strand == kReads);
  });
}

void GridParts::setLeast() {
  for (const layout::GridWork& work : tile_.works)
    least_.entries = std::max<std::uint64_t>(least_.entries, roomForEntries(work.end - work.first));
  least_.kernels = least_.entries;
  least_.strands = least_.works = 1;
  least_.stored = tile_.strands.size() + 1;
  least_.table = kColumns;
  least_.receivers = std::min<std::uint64_t>(kMostReceivers, order_.size());
}

void GridParts::start(const GridCounts& most, std::size_t channel) {
  MOTE_CHECK(least_.within(most), ==, true);
  most_ = most, channel_ = channel;
  next_ = 0;
  last_.assign(tile_.strands.size(), 0);
  chosen_.assign(tile_.strands.size(), {});
  slotOf_.assign(tile_.storedBlocks + 1, 0);
  localOf_.assign(tile_.kernels.size(), kNone);
  free_.resize(most.stored);
  std::iota(free_.rbegin(), free_.rend(), 1u);
}

bool GridParts::next(GridArrays& to) {
  has_ = {};
  for (Chosen& strand : chosen_) strand.works.clear();
  kernels_.clear(), groups_.clear(), receivers_.clear(), over_.clear();
  const std::size_t first = next_;
  while (next_ < steps_.size() && add(steps_[next_])) ++next_;
  if (next_ == first) {
    MOTE_CHECK(next_, ==, steps_.size());
    return false;
  }
  putKernels(to);
  to.entries.clear(), to.works.clear(), to.blocks.clear(), to.strands.clear();
  for (const Chosen& strand : chosen_) putStrand(strand, to);
  putReceivers(to);
  to.storedBlocks = number(most_.stored), to.kinds = tile_.kinds, to.begun = true;
  free_.insert(free_.end(), over_.begin(), over_.end());
  for (const std::uint32_t kernel : kernels_) localOf_[kernel] = kNone;
  return true;
}

bool GridParts::add(const Step& step) { return step.strand == kReads ? addReceivers(step) : addWork(step); }

bool GridParts::addWork(const Step& step) {
  const layout::GridWork& work = tile_.works[step.first];
  const std::uint32_t stored = tile_.blocks[step.first];
  Chosen& chosen = chosen_[step.strand];
  std::uint32_t& last = last_[step.strand];
  const bool goesOn = last == stored;
  const std::span<const std::uint32_t> entries = std::span(tile_.entries).subspan(work.first, work.end - work.first);
  const auto isNew = [&](std::uint32_t kernel) { return localOf_[kernel] == kNone; };
  GridCounts has = has_;
  has.kernels += static_cast<std::uint64_t>(std::count_if(entries.begin(), entries.end(), isNew));
  has.entries += roomForEntries(number(entries.size()));
  has.works += 1, has.strands += chosen.works.empty() ? 1 : 0;
  if (!has.within(most_) || (!goesOn && free_.empty())) return false;
  has_ = has;
  if (chosen.works.empty()) chosen.before = last;
  chosen.works.push_back(step.first);
  for (const std::uint32_t kernel : entries) {
    if (!isNew(kernel)) continue;
    localOf_[kernel] = number(kernels_.size());
    kernels_.push_back(kernel);
  }
  if (goesOn) return true;
  if (last != 0) over_.push_back(slotOf_[last]);
  last = stored;
  slotOf_[stored] = free_.back();
  free_.pop_back();
  return true;
}

bool GridParts::addReceivers(const Step& step) {
  const bool begins = groups_.empty() || groups_.back() != step.group;
  GridCounts has = has_;
  has.table += begins ? kColumns : 0, has.receivers += step.end - step.first;
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

void GridParts::putStrand(const Chosen& chosen, GridArrays& to) const {
  if (chosen.works.empty()) return;
  layout::GridStrand strand{number(to.works.size()), 0, slotOf_[chosen.before]};
  for (const std::uint32_t w : chosen.works) {
    layout::GridWork work = tile_.works[w];
    const std::span<const std::uint32_t> entries = std::span(tile_.entries).subspan(work.first, work.end - work.first);
    work.first = number(to.entries.size());
    for (const std::uint32_t kernel : entries) to.entries.push_back(localOf_[kernel]);
    work.end = number(to.entries.size());
    to.entries.resize(roomForEntries(work.end), to.entries.back());
    work.sums = number(to.works.size());
    to.works.push_back(work);
    to.blocks.push_back(slotOf_[tile_.blocks[w]]);
  }
  strand.end = number(to.works.size());
  to.strands.push_back(strand);
}

void GridParts::putReceivers(GridArrays& to) const {
  to.table.clear(), to.receivers.clear(), to.own[0].clear();
  for (const std::uint32_t group : groups_)
    for (std::size_t b = 0; b < kColumns; ++b) {
      const auto entry = [&](std::size_t strand) {
        if (strand >= kColumns) return 0u;
        const std::uint32_t own = tile_.table[group * kColumns + strand].here;
        return 2 * slotOf_[own >> 1] + (own & 1);
      };
      to.table.push_back({entry(b), entry(b + 1), entry(b + layout::kTileBlocks), entry(b + layout::kTileBlocks + 1)});
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
