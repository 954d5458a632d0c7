#include "host/splat/merge_runs.h"

#include <algorithm>

#include "host/core/parallel.h"

namespace mote {
namespace {

using Run = std::span<const std::uint64_t>;

constexpr std::size_t kBlock =
    1 << 16;  // pairs merged at a time, about: half a megabyte, so that a core's cache holds it

std::vector<Run> runsOf(Run pairs, std::span<const std::size_t> start) {
  std::vector<Run> runs;
  for (std::size_t r = 0; r + 1 < start.size(); ++r) runs.push_back(pairs.subspan(start[r], start[r + 1] - start[r]));
  return runs;
}

/// Pairs that cut all runs into blocks of about kBlock pairs: of the runs' samples, each of which stands for kStep
/// pairs of its run, those after every kBlock / kStep.
std::vector<std::uint64_t> cutsOf(const std::vector<Run>& runs) {
  constexpr std::size_t kStep = kBlock / 64;
  std::vector<std::uint64_t> samples, cuts;
  for (const Run& run : runs)
    for (std::size_t i = kStep; i < run.size(); i += kStep) samples.push_back(run[i]);
  std::sort(samples.begin(), samples.end());
  for (std::size_t i = kBlock / kStep; i < samples.size(); i += kBlock / kStep) cuts.push_back(samples[i]);
  return cuts;
}

std::size_t placeOf(Run run, std::uint64_t cut) {
  return static_cast<std::size_t>(std::lower_bound(run.begin(), run.end(), cut) - run.begin());
}

/// Merges neighbours in `pairs`, which end at `ends`, until one is left.
void mergeAll(std::vector<std::uint64_t>& pairs, std::vector<std::size_t> ends) {
  const auto at = [&](std::size_t place) { return pairs.begin() + static_cast<std::ptrdiff_t>(place); };
  while (ends.size() > 1) {
    std::vector<std::size_t> merged;
    for (std::size_t r = 0; r < ends.size(); r += 2) {
      const std::size_t begin = r == 0 ? 0 : ends[r - 1];
      if (r + 1 < ends.size()) std::inplace_merge(at(begin), at(ends[r]), at(ends[r + 1]));
      merged.push_back(ends[std::min(r + 1, ends.size() - 1)]);
    }
    ends = std::move(merged);
  }
}

}  // namespace

std::vector<layout::uint> mergeRuns(std::span<const std::uint64_t> pairs, std::span<const std::size_t> start) {
  const std::vector<Run> runs = runsOf(pairs, start);
  const std::vector<std::uint64_t> cuts = cutsOf(runs);
  std::vector<layout::uint> order(pairs.size());
  parallelBlocks(cuts.size() + 1, 1, [&](std::size_t block, std::size_t) {
    std::vector<std::uint64_t> local;
    std::vector<std::size_t> ends;
    std::size_t to = 0;
    for (const Run& run : runs) {
      const std::size_t begin = block == 0 ? 0 : placeOf(run, cuts[block - 1]);
      const std::size_t end = block == cuts.size() ? run.size() : placeOf(run, cuts[block]);
      local.insert(local.end(), run.begin() + static_cast<std::ptrdiff_t>(begin),
                   run.begin() + static_cast<std::ptrdiff_t>(end));
      ends.push_back(local.size());
      to += begin;
    }
    mergeAll(local, std::move(ends));
    for (const std::uint64_t pair : local) order[to++] = static_cast<layout::uint>(pair);
  });
  return order;
}

}  // namespace mote
