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

struct Keeper {
  const Peer* peer;
  double seconds;
};
bool faster(const Keeper& a, const Keeper& b) { return a.seconds < b.seconds; }

}  // namespace

Search::Search(const Contest& contest, std::vector<std::vector<Peer>> series, bool verbose)
    : contest_(contest), series_(std::move(series)), verbose_(verbose) {
  for (const std::vector<Peer>& candidates : series_) tried_.emplace_back(candidates.size());
}

const Search::Trial& Search::trial(std::size_t s, std::size_t k) {
  std::optional<Trial>& trial = tried_[s][k];
  if (!trial) {
    const auto [seconds, accuracy] = contest_.tryOnce(series_[s][k]);
    trial = {seconds, accuracy};
    bestError_ = std::min(bestError_, accuracy.mean);
    if (verbose_) fmt::print("    tried {:<45} {:>8.4g} s   |ΔT| {:.5f}\n", series_[s][k].name, seconds, accuracy.mean);
  }
  return *trial;
}

const Peer* Search::firstKeeper(std::size_t s, double error, double& least) {
  const Trial* below = nullptr;  // the most detailed one that misses the error
  std::size_t low = 0, high = series_[s].size();
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    const Trial& run = trial(s, middle);
    if (run.accuracy.mean <= error) {
      least = std::min(least, run.seconds);
      high = middle;
      continue;
    }
    if (run.seconds > kHopeless * least || (below && run.accuracy.mean > kPlateau * below->accuracy.mean))
      return nullptr;
    below = &run;
    low = middle + 1;
  }
  return high < series_[s].size() ? &series_[s][high] : nullptr;
}

const Peer* Search::cheapest(double error) {
  std::vector<Keeper> keepers;
  double least = INFINITY;
  for (std::size_t s = 0; s < series_.size(); ++s)
    if (const Peer* peer = firstKeeper(s, error, least))
      keepers.push_back({peer, tried_[s][static_cast<std::size_t>(peer - series_[s].data())]->seconds});
  if (keepers.empty()) return nullptr;
  least = std::min_element(keepers.begin(), keepers.end(), faster)->seconds;
  std::erase_if(keepers, [&](const Keeper& keeper) { return keeper.seconds > kClose * least; });
  if (keepers.size() > 1)
    for (Keeper& keeper : keepers)
      for (int run = 0; run < kRuns; ++run)
        keeper.seconds = std::min(keeper.seconds, contest_.tryOnce(*keeper.peer).first);
  return std::min_element(keepers.begin(), keepers.end(), faster)->peer;
}

}  // namespace mote
