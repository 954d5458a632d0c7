#include "tools/bench/peers/contest.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/timer.h"
#include "host/lighting/beam_kernel.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

template <class Work>
void time(const Work& work, std::vector<double>& seconds, std::vector<double>& core) {
  const std::clock_t start = std::clock();
  const Timer timer;
  work();
  seconds.push_back(timer.seconds());
  core.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
}

Json toJson(const Match& match, std::size_t count) {
  const std::vector<double> ratios = match.ratios();
  const auto [least, most] = std::minmax_element(ratios.begin(), ratios.end());
  return {{"name", match.peer},
          {"unit", "rays"},
          {"count", count},
          {"a", "exact"},
          {"b", match.peer},
          {"ratio_median", median(ratios)},
          {"ratio_min", *least},
          {"ratio_max", *most},
          {"seconds_a", match.exactSeconds},
          {"seconds_b", match.seconds},
          {"core_seconds_a", match.exactCore},
          {"core_seconds_b", match.core},
          {"prepare_seconds", match.prepareSeconds},
          {"error_mean", match.accuracy.mean},
          {"error_p99", match.accuracy.p99},
          {"error_max", match.accuracy.max},
          {"check", {{"text", "finite"}, {"passed", true}}}};
}

}  // namespace

double median(std::vector<double> values) {
  MOTE_CHECK(values.size(), >, 0u);
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

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

std::vector<double> Match::ratios() const {
  std::vector<double> ratios;
  for (std::size_t run = 0; run < seconds.size(); ++run) ratios.push_back(seconds[run] / exactSeconds[run]);
  return ratios;
}

Contest::Contest(const Octree& tree, const layout::Light& light, const LightingOptions& options, int runs)
    : tree_(tree), light_(light), options_(options), runs_(runs) {
  LightingOptions whole = options;
  whole.cutoff = 0;
  exact_ = opticalDepths(tree, light, whole);
}

std::pair<double, Accuracy> Contest::tryOnce(const Peer& peer) const {
  if (peer.prepare) peer.prepare();
  const Timer timer;
  const std::vector<float> depths = peer.opticalDepths();
  const double seconds = timer.seconds();
  return {seconds, accuracyOf(depths, exact_, light_)};
}

const Match& Contest::hold(const Peer& peer) {
  Match match;
  match.peer = peer.name;
  if (peer.prepare) {
    const Timer timer;
    peer.prepare();
    match.prepareSeconds = timer.seconds();
  }
  std::vector<float> depths = peer.opticalDepths(), exact = opticalDepths(tree_, light_, options_);
  match.accuracy = accuracyOf(depths, exact_, light_);
  for (int run = 0; run < runs_; ++run) {
    time([&] { exact = opticalDepths(tree_, light_, options_); }, match.exactSeconds, match.exactCore);
    time([&] { depths = peer.opticalDepths(); }, match.seconds, match.core);
  }
  const std::vector<double> ratios = match.ratios();
  const auto [least, most] = std::minmax_element(ratios.begin(), ratios.end());
  fmt::print("  {:<40} {:>8.4g} s  + {:>7.3g} s   {:>6.3g} ({:.3g} .. {:.3g})   |ΔT| {:.5f}  {:.4f}  {:.4f}\n",
             match.peer, median(match.seconds), match.prepareSeconds, median(ratios), *least, *most,
             match.accuracy.mean, match.accuracy.p99, match.accuracy.max);
  if (std::fflush(stdout) != 0) throw MachineError("writing to stdout failed");  // the next one may take a minute
  matches_.push_back(std::move(match));
  return matches_.back();
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
