#include "tools/bench/peers/search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mote {
namespace {

constexpr double kClose = 1.4;      // one run is off by less than that
constexpr double kHopeless = 2;     // dearer than the best so far: what has more detail is dearer still
constexpr double kPlateau = 0.985;  // of the error before: more detail of this kind helps no more
constexpr int kRuns = 3;

}  // namespace

Search::Search(const Contest& contest, std::vector<std::vector<Peer>> series, bool verbose)
    : contest_(contest), series_(std::move(series)), tried_(series_.size()), verbose_(verbose) {}

const Search::Trial& Search::trial(std::size_t s, std::size_t k) {
  if (k == tried_[s].size()) {
    const auto [seconds, accuracy] = contest_.tryOnce(series_[s][k]);
    tried_[s].push_back({seconds, accuracy});
    bestError_ = std::min(bestError_, accuracy.mean);
    if (verbose_) fmt::print("    tried {:<45} {:>8.4g} s   |ΔT| {:.5f}\n", series_[s][k].name, seconds, accuracy.mean);
  }
  return tried_[s][k];
}

const Peer* Search::cheapest(double error) {
  struct Keeper {
    const Peer* peer;
    double seconds;
  };
  std::vector<Keeper> keepers;
  double least = INFINITY;
  for (std::size_t s = 0; s < series_.size(); ++s)
    for (std::size_t k = 0; k < series_[s].size(); ++k) {
      const Trial& run = trial(s, k);
      const bool keeps = run.accuracy.mean <= error;
      if (keeps) keepers.push_back({&series_[s][k], run.seconds});
      if (keeps) least = std::min(least, run.seconds);
      const bool sinks = k == 0 || run.accuracy.mean < kPlateau * tried_[s][k - 1].accuracy.mean;
      if (keeps || !sinks || run.seconds > kHopeless * least) break;
    }
  std::erase_if(keepers, [&](const Keeper& keeper) { return keeper.seconds > kClose * least; });
  if (keepers.empty()) return nullptr;
  if (keepers.size() > 1)
    for (Keeper& keeper : keepers)
      for (int run = 0; run < kRuns; ++run)
        keeper.seconds = std::min(keeper.seconds, contest_.tryOnce(*keeper.peer).first);
  return std::min_element(keepers.begin(), keepers.end(),
                          [](const Keeper& a, const Keeper& b) { return a.seconds < b.seconds; })
      ->peer;
}

}  // namespace mote
