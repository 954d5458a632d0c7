// Peers against Mote at equal error: seconds taken in turn, and both sides' errors.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "host/lighting/approximate.h"
#include "tools/bench/peers/peer.h"
#include "tools/bench/timing.h"

namespace mote {

/// |ΔT| over all slots.
struct Accuracy {
  double mean = 0, p99 = 0, max = 0;
};

/// Of transmittances against exact ones of the same length; a NaN counts as an error of 1.
Accuracy accuracyOf(const std::vector<float>& opticalDepths, const std::vector<float>& exact,
                    const layout::Light& light);

/// One side of a match.
struct Side {
  std::string name;
  Accuracy accuracy;
  RunTimes times;
};

struct Match {
  double error = 0;  ///< mean |ΔT| that both must keep; 0: exact
  double limit = 0;  ///< mean |ΔT| beyond which nothing is timed: `error`, or for exact sums the cutoff
  Side mote, peer;
  double prepareSeconds = 0;  ///< Peer::prepare, once; 0 without

  bool passed() const { return mote.accuracy.mean <= limit && peer.accuracy.mean <= limit; }
  /// Seconds of the peer / seconds of Mote, run by run.
  std::vector<double> ratios() const { return pairwiseRatios(peer.times, mote.times); }
};

class Contest {
 public:
  /// The tree must live as long. Computes the exact transmittances, without a cutoff, that errors are against.
  Contest(const Octree& tree, const layout::Light& light, const LightingOptions& options, int runs);

  /// Prepares the peer, runs it and Mote once, compares both with the exact transmittances and, if both keep the error
  /// (Match::limit), times them in turn. Mote's time has all that `lighting.error` does: the choice of the method, the
  /// measurement of its error, and grids that failed it. Prints a line for each.
  const Match& hold(const Peer& peer, double error);
  /// Seconds and error of one run; for searches.
  std::pair<double, Accuracy> tryOnce(const Peer& peer) const;

  const std::vector<Match>& matches() const { return matches_; }
  bool passed() const;
  /// The report of mote bench, with the errors and seconds of preparation beside each run.
  std::string reportJson(const std::string& cloud, const std::string& light, double treeSeconds) const;

 private:
  std::vector<float> ours(double error, Approximation& chosen) const;

  const Octree& tree_;
  layout::Light light_;
  LightingOptions options_;
  int runs_;
  std::vector<float> exact_;  // optical depths
  std::vector<Match> matches_;
};

}  // namespace mote
