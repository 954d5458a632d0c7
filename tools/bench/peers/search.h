// The setting of a peer that keeps an error at the least cost.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tools/bench/peers/contest.h"

namespace mote {

class Search {
 public:
  /// `series`: candidates by rising detail and cost each; the first one that keeps an error is the cheapest of its
  /// series and found by bisection. The contest must live as long. `verbose`: print everything that is tried.
  Search(const Contest& contest, std::vector<std::vector<Peer>> series, bool verbose);

  /// The cheapest candidate whose mean |ΔT| is at most `error`; null if none keeps it. A series is given up where more
  /// detail no longer helps, or where it misses the error in twice the time of the best so far. Candidates are run
  /// once, those that are nearly the fastest three times more. What an earlier call tried is not run again.
  const Peer* cheapest(double error);
  /// Least mean |ΔT| of all that was tried.
  double bestError() const { return bestError_; }

 private:
  struct Trial {
    double seconds = 0;
    Accuracy accuracy;
  };
  const Trial& trial(std::size_t s, std::size_t k);
  /// Of a series; lowers `least`, the seconds of the fastest that keeps the error.
  const Peer* firstKeeper(std::size_t s, double error, double& least);

  const Contest& contest_;
  std::vector<std::vector<Peer>> series_;
  std::vector<std::vector<std::optional<Trial>>> tried_;
  bool verbose_;
  double bestError_ = 1;
};

}  // namespace mote
