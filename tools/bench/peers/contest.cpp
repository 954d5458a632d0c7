#include "tools/bench/peers/contest.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/simd_targets.h"
#include "host/core/timer.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

std::string nameOf(const Approximation& chosen) {
  if (chosen.method == DepthMethod::Exact) return "Mote, exact";
  if (chosen.method == DepthMethod::Detail)
    return fmt::format("Mote, {} particles and stand-ins, tries {}", chosen.treeParticles, chosen.tries);
  return fmt::format("Mote, grid of {:.2f} radii, tries {}", chosen.cellRadii, chosen.tries);
}

Json toJson(const Accuracy& accuracy) {
  return {{"mean", accuracy.mean}, {"p99", accuracy.p99}, {"max", accuracy.max}};
}

Json toJson(const Match& match, std::size_t count) {
  Json json = {{"name", fmt::format("{}, mean error {}", match.peer.name, match.error)},
               {"unit", "rays"},
               {"count", count},
               {"error", match.error},
               {"a", match.mote.name},
               {"b", match.peer.name},
               {"seconds_a", match.mote.times.wall},
               {"seconds_b", match.peer.times.wall},
               {"core_seconds_a", match.mote.times.core},
               {"core_seconds_b", match.peer.times.core},
               {"prepare_seconds_b", match.prepareSeconds},
               {"accuracy_a", toJson(match.mote.accuracy)},
               {"accuracy_b", toJson(match.peer.accuracy)},
               {"check", {{"text", fmt::format("mean |ΔT| ≤ {}", match.limit)}, {"passed", match.passed()}}}};
  setRatios(json, match.ratios());
  return json;
}

/// "Fourier opacity map 128², 7 harmonics     0.118 s   |ΔT| 0.00831 0.0412 0.1931"
void print(const Side& side) {
  const std::string seconds = side.times.wall.empty() ? "not timed" : fmt::format("{:.4g} s", median(side.times.wall));
  fmt::print("    {:<45} {:>10}   |ΔT| {:.5f} {:.4f} {:.4f}", side.name, seconds, side.accuracy.mean, side.accuracy.p99,
             side.accuracy.max);
}

void print(const Match& match) {
  print(match.mote);
  fmt::print("\n");
  print(match.peer);
  if (match.passed()) {
    const std::vector<double> ratios = match.ratios();
    const auto [least, most] = std::minmax_element(ratios.begin(), ratios.end());
    fmt::print("   peer / Mote {:.3g} ({:.3g} .. {:.3g}), of CPU time {:.3g}", median(ratios), *least, *most,
               median(match.peer.times.core) / median(match.mote.times.core));
  } else {
    fmt::print("   DIFFERS: beyond a mean |ΔT| of {}", match.limit);
  }
  fmt::print("{}\n", match.prepareSeconds > 0 ? fmt::format("   + {:.3g} s once", match.prepareSeconds) : "");
  if (std::fflush(stdout) != 0) throw MachineError("writing to stdout failed");  // the next one may take a minute
}

}  // namespace

Accuracy accuracyOf(const std::vector<float>& opticalDepths, const std::vector<float>& exact,
                    const layout::Light& light) {
  MOTE_CHECK(opticalDepths.size(), ==, exact.size());
  MOTE_CHECK(exact.size(), >, 0u);
  const std::vector<float> got = transmittances(opticalDepths, light), wanted = transmittances(exact, light);
  std::vector<double> error(got.size());
  double sum = 0;
  for (std::size_t i = 0; i < error.size(); ++i) {
    error[i] = std::abs(double(got[i]) - double(wanted[i]));
    if (!(error[i] <= 1)) error[i] = 1;
    sum += error[i];
  }
  const auto p99 = error.begin() + static_cast<std::ptrdiff_t>((error.size() - 1) * 99 / 100);
  std::nth_element(error.begin(), p99, error.end());
  return {sum / static_cast<double>(error.size()), *p99, *std::max_element(p99, error.end())};
}

Contest::Contest(const Octree& tree, const layout::Light& light, const LightingOptions& options, int runs)
    : tree_(tree), light_(light), options_(options), runs_(runs) {
  LightingOptions whole = options;
  whole.cutoff = 0;
  exact_ = opticalDepths(tree, light, whole);
}

std::vector<float> Contest::ours(double error, Approximation& chosen) const {
  return approximateOpticalDepths(tree_, slotsOf(tree_), light_, options_, {.mean = error}, chosen);
}

std::pair<double, Accuracy> Contest::tryOnce(const Peer& peer) const {
  if (peer.prepare) peer.prepare();
  const Timer timer;
  const std::vector<float> depths = peer.opticalDepths();
  const double seconds = timer.seconds();
  return {seconds, accuracyOf(depths, exact_, light_)};
}

const Match& Contest::hold(const Peer& peer, double error) {
  Match match;
  match.error = error;
  match.limit = error > 0 ? error : double(options_.cutoff);
  match.peer.name = peer.name;
  if (peer.prepare) {
    const Timer timer;
    peer.prepare();
    match.prepareSeconds = timer.seconds();
  }
  Approximation chosen;
  match.mote.accuracy = accuracyOf(ours(error, chosen), exact_, light_);
  match.mote.name = nameOf(chosen);
  match.peer.accuracy = accuracyOf(peer.opticalDepths(), exact_, light_);
  std::vector<float> depths;
  for (int run = 0; run < runs_ && match.passed(); ++run) {
    match.mote.times.time([&] { depths = ours(error, chosen); });
    match.peer.times.time([&] { depths = peer.opticalDepths(); });
  }
  print(match);
  matches_.push_back(std::move(match));
  return matches_.back();
}

bool Contest::passed() const {
  return std::all_of(matches_.begin(), matches_.end(), [](const Match& match) { return match.passed(); });
}

std::string Contest::reportJson(const std::string& cloud, const std::string& light, double treeSeconds) const {
  Json runs = Json::array();
  for (const Match& match : matches_) runs.push_back(toJson(match, tree_.particleCount()));
  const Json root = {
      {"version", MOTE_VERSION}, {"device", "none"}, {"threads", threadCount()}, {"simd", simdTargets().front()},
      {"benchmark", "peers"},    {"cloud", cloud},   {"light", light},           {"octree_seconds", treeSeconds},
      {"runs", std::move(runs)}};
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace mote
