// Merging of sorted runs against one sort over all.
#include "host/splat/merge_runs.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "host/core/parallel.h"
#include "host/core/random.h"

namespace mote {
namespace {

/// Pairs of `keys` different keys, in runs of these lengths, each of them sorted.
struct Runs {
  std::vector<std::uint64_t> pairs;
  std::vector<std::size_t> start{0};

  Runs(const std::vector<std::size_t>& lengths, std::uint64_t keys) {
    for (const std::size_t length : lengths) start.push_back(start.back() + length);
    for (std::size_t i = 0; i < start.back(); ++i) pairs.push_back((hashBits(9, i) % keys) << 32 | i);
    for (std::size_t r = 0; r < lengths.size(); ++r)
      std::sort(pairs.begin() + static_cast<std::ptrdiff_t>(start[r]),
                pairs.begin() + static_cast<std::ptrdiff_t>(start[r + 1]));
  }
  std::vector<layout::uint> sortedAtOnce() const {
    std::vector<std::uint64_t> all = pairs;
    std::sort(all.begin(), all.end());
    return std::vector<layout::uint>(all.begin(), all.end());
  }
};

TEST(MergeRuns, GivesTheOrderOfOneSort) {
  // Runs of no, one and many pairs; so many that they are merged in blocks (2^16 pairs); equal keys across runs.
  const std::vector<std::vector<std::size_t>> lengths{
      {}, {0}, {1}, {5, 0, 3}, {1, 1, 1, 1, 1, 1, 1}, {300000}, {100000, 7, 250000, 0, 65536, 65537, 1}};
  for (const std::vector<std::size_t>& each : lengths)
    for (const std::uint64_t keys : {1ull, 10ull, 1ull << 32}) {
      const Runs runs(each, keys);
      EXPECT_EQ(mergeRuns(runs.pairs, runs.start), runs.sortedAtOnce()) << each.size() << " runs, " << keys << " keys";
    }
}

TEST(MergeRuns, RunsThatFollowEachOtherStayAsTheyAre) {
  // No run overlaps another, in ascending order and in descending: blocks take all of one run and nothing of others.
  std::vector<std::uint64_t> pairs;
  std::vector<layout::uint> expected;
  for (std::uint64_t run = 0; run < 4; ++run)
    for (std::uint64_t i = 0; i < 100000; ++i) pairs.push_back((3 - run) << 40 | (run * 100000 + i));
  const std::vector<std::size_t> start{0, 100000, 200000, 300000, 400000};
  for (layout::uint run = 4; run-- > 0;)
    for (layout::uint i = 0; i < 100000; ++i) expected.push_back(run * 100000 + i);
  EXPECT_EQ(mergeRuns(pairs, start), expected);
}

TEST(MergeRuns, DoesNotDependOnTheNumberOfThreads) {
  const Runs runs({200000, 150000, 90000}, 1000);
  const std::vector<layout::uint> expected = runs.sortedAtOnce();
  for (const unsigned threads : {1u, 2u, 5u}) {
    const ThreadLimit limit(threads);
    EXPECT_EQ(mergeRuns(runs.pairs, runs.start), expected) << threads;
  }
}

}  // namespace
}  // namespace mote
