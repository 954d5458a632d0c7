// Peers against Mote's exact optical depths: seconds taken in turn, and errors.
#pragma once
#include <string>
#include <vector>

#include "host/lighting/lighting.h"
#include "tools/bench/peers/peer.h"

namespace mote {

/// |ΔT| over all slots.
struct Accuracy {
  double mean = 0, p99 = 0, max = 0;
};

/// Of transmittances against exact ones of the same length; a NaN counts as an error of 1.
Accuracy accuracyOf(const std::vector<float>& opticalDepths, const std::vector<float>& exact,
                    const layout::Light& light);

struct Match {
  std::string peer;
  double prepareSeconds = 0;                  ///< Peer::prepare, once; 0 without
  std::vector<double> exactSeconds, seconds;  ///< wall clock, in turn
  std::vector<double> exactCore, core;        ///< CPU time over all threads
  Accuracy accuracy;

  std::vector<double> ratios() const;  ///< seconds / exactSeconds, run by run
};

double median(std::vector<double> values);

class Contest {
 public:
  /// The tree must live as long. Computes the exact transmittances, without a cutoff, that errors are against.
  Contest(const Octree& tree, const layout::Light& light, const LightingOptions& options, int runs);

  /// Prepares the peer, runs it and the exact method once uncounted, then in turn, and prints a line.
  const Match& hold(const Peer& peer);
  /// Seconds and error of one run; for searches, which take too many for more.
  std::pair<double, Accuracy> tryOnce(const Peer& peer) const;

  const std::vector<Match>& matches() const { return matches_; }
  /// The report of mote bench, with the errors and seconds of preparation beside each run.
  std::string reportJson(const std::string& cloud, const std::string& light, double treeSeconds) const;

 private:
  const Octree& tree_;
  layout::Light light_;
  LightingOptions options_;
  int runs_;
  std::vector<float> exact_;  // optical depths
  std::vector<Match> matches_;
};

}  // namespace mote
