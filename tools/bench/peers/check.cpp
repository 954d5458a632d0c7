#include "tools/bench/peers/check.h"

#include <fmt/format.h>

#include <vector>

#include "tools/bench/peers/cloud.h"
#include "tools/bench/peers/contest.h"
#include "tools/bench/peers/peer_list.h"

namespace mote {
namespace {

constexpr std::uint64_t kCount = 3000;

struct Check {
  Peer peer;
  double mean;  ///< |ΔT| at most
};

/// Each peer's limit, on a few thousand particles, with the reason for what is left:
std::vector<Check> checks(const Task& task) {
  return {// 63 harmonics of the depth, and balls whose chords all count as 6/7 of their radius.
          {fourierPeer(task, {.size = 512, .harmonics = 63, .thick = true}), 0.004},
          // The same sums in another order; both end rays at the cutoff of 1e-4.
          {spherePeer(task, SphereHits::Rays::Single), 1e-4},
          {spherePeer(task, SphereHits::Rays::Packets), 1e-4},
          // Along a ray the grid's balls are (1 − x²)^1.5 and the soft ends' 1 − x².
          {gridPeer(task, {.size = 256, .step = 0.5f}), 0.002}};
}

}  // namespace

bool checkPeers(const LightingOptions& options) {
  const Octree tree = makeCloud("noise", kCount);
  bool right = true;
  for (const bool directional : {false, true}) {
    const Task task{tree, makeLight(tree, directional), options};
    const Contest contest(tree, task.light, options, 1);
    for (const Check& check : checks(task)) {
      const Accuracy accuracy = contest.tryOnce(check.peer).second;
      const bool agrees = accuracy.mean <= check.mean;
      fmt::print("check  {:<11} {:<44} mean |ΔT| {:.1e} (limit {:.0e}), max {:.1e}: {}\n",
                 directional ? "directional" : "point", check.peer.name, accuracy.mean, check.mean, accuracy.max,
                 agrees ? "ok" : "DIFFERS");
      right = right && agrees;
    }
  }
  return right;
}

}  // namespace mote
