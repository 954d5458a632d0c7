// mote_peers: other people's ways to light particles, timed and held against Mote's exact optical depths.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

#include "host/core/error.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/core/timer.h"
#include "host/lighting/beam_kernel.h"
#include "tools/bench/peers/cloud.h"
#include "tools/bench/peers/contest.h"
#include "tools/bench/peers/peer_list.h"

namespace mote {
namespace {

// As mote's: 0 done, 1 a check failed, 2 bad input or usage, 3 the machine.
constexpr int kFailed = 1, kBadInput = 2, kMachine = 3;

constexpr std::uint64_t kLeastCount = 4000;  // fewer make no p99
constexpr double kGoals[] = {0.01, 0.002};   // mean |ΔT| that the searches are for
constexpr std::size_t kMostMapBytes = std::size_t{1} << 30;
constexpr std::uint64_t kCheckCount = 3000;  // particles that the check at the start lights

struct Options {
  std::uint64_t count = 1'000'000;
  std::string cloud = "noise", light = "point", report;
  std::vector<std::string> only;
  int runs = 5;
  bool verbose = false;
  unsigned threads = 0;

  bool wants(const std::string& peer) const {
    return only.empty() || std::find(only.begin(), only.end(), peer) != only.end();
  }
};

/// A peer with so much detail that little but its principle is left must come to the exact transmittances.
struct Check {
  Peer peer;
  double mean;  ///< |ΔT| at most
};

/// Each peer's limit, on a few thousand particles, with the reason for what is left:
std::vector<Check> checks(const Task& task) {
  return {// 63 harmonics of the depth, and balls whose chords all count as 6/7 of their radius.
          {fourierPeer(task, {.size = 512, .harmonics = 63}), 0.004},
          // The same sums in another order; both end rays at the cutoff of 1e-4.
          {spherePeer(task, SphereHits::Rays::Single), 1e-4},
          {spherePeer(task, SphereHits::Rays::Packets), 1e-4},
          // Along a ray the grid's balls are (1 − x²)^1.5 and the soft ends' 1 − x².
          {gridPeer(task, {.size = 256, .step = 0.5f}), 0.002}};
}

/// True if all peers converge, to a point light and to a directional one.
bool checkPeers(const LightingOptions& options) {
  const Octree tree = makeCloud("noise", kCheckCount);
  bool right = true;
  for (const bool directional : {false, true}) {
    const Task task{tree, makeLight(tree, directional), options};
    const Contest contest(tree, task.light, options, 1);
    for (const Check& check : checks(task)) {
      const Accuracy accuracy = contest.tryOnce(check.peer).second;
      const bool converges = accuracy.mean <= check.mean;
      fmt::print("check  {:<11} {:<44} mean |ΔT| {:.1e} (limit {:.0e}), max {:.1e}: {}\n",
                 directional ? "directional" : "point", check.peer.name, accuracy.mean, check.mean, accuracy.max,
                 converges ? "ok" : "DIFFERS");
      right = right && converges;
    }
  }
  return right;
}

/// The cheapest of the candidates that reaches each goal. `series`: candidates by rising detail, of which the first
/// that reaches a goal is the cheapest of its series; dearer ones than the best so far are not tried.
void holdCheapest(Contest& contest, const std::vector<std::vector<Peer>>& series, const std::string& what,
                  bool verbose) {
  std::vector<std::vector<std::pair<double, Accuracy>>> tried(series.size());
  for (const double goal : kGoals) {
    const Peer* best = nullptr;
    double bestSeconds = INFINITY, bestError = INFINITY;
    for (std::size_t s = 0; s < series.size(); ++s)
      for (std::size_t k = 0; k < series[s].size(); ++k) {
        if (k == tried[s].size()) tried[s].push_back(contest.tryOnce(series[s][k]));
        const auto& [seconds, accuracy] = tried[s][k];
        if (verbose) fmt::print("    {:<40} {:>8.4g} s   |ΔT| {:.5f}\n", series[s][k].name, seconds, accuracy.mean);
        bestError = std::min(bestError, accuracy.mean);
        if (accuracy.mean <= goal && seconds < bestSeconds) best = &series[s][k], bestSeconds = seconds;
        if (accuracy.mean <= goal || seconds > 2 * bestSeconds) break;  // 2: a single run's time is rough
      }
    if (best)
      contest.hold(*best);
    else
      fmt::print("  {}: none of those tried reaches a mean |ΔT| of {}; the best has {:.4f}\n", what, goal, bestError);
  }
}

/// With particles as points in depth: where there are enough of them for a picture it costs no accuracy, and less time.
void holdFourierMaps(Contest& contest, const Task& task, bool verbose) {
  std::vector<std::vector<Peer>> series;
  for (const int harmonics : {3, 7, 15, 31, 63}) {
    series.emplace_back();
    for (const int size : {48, 64, 96, 128, 160, 192, 256, 320, 384, 512, 768, 1024, 1536, 2048})
      if (const FourierMapOptions options{size, harmonics, false}; fourierMapBytes(options) <= kMostMapBytes)
        series.back().push_back(fourierPeer(task, options));
  }
  holdCheapest(contest, series, "Fourier opacity map", verbose);
}

void holdGrids(Contest& contest, const Task& task, bool verbose) {
  std::vector<std::vector<Peer>> series(2);
  for (const int size : {32, 48, 64, 96, 128, 192, 256, 384, 512}) {
    series[0].push_back(gridPeer(task, {.size = size, .step = 2}));
    series[1].push_back(gridPeer(task, {.size = size, .step = 1}));
  }
  holdCheapest(contest, series, "OpenVDB", verbose);
}

/// Rays one by one or in packets, whichever is faster on fewer particles: the slower of the two may take a minute.
void holdSpheres(Contest& contest, const Task& task) {
  constexpr std::uint64_t kTrialCount = 50'000;
  const Octree trial = makeCloud("noise", std::min<std::uint64_t>(task.tree.particleCount(), kTrialCount));
  const Task few{trial, makeLight(trial, task.light.type == layout::kLightDirectional), task.options};
  const auto seconds = [&](SphereHits::Rays rays) {
    const Peer peer = spherePeer(few, rays);
    peer.prepare();
    const Timer timer;
    peer.opticalDepths();
    return timer.seconds();
  };
  const bool single = seconds(SphereHits::Rays::Single) < seconds(SphereHits::Rays::Packets);
  contest.hold(spherePeer(task, single ? SphereHits::Rays::Single : SphereHits::Rays::Packets));
}

int run(const Options& options) {
  if (!options.report.empty()) OutputFile{options.report};  // before any work
  const LightingOptions lighting;
  fmt::print("mote_peers {}: {} threads, {}\n", MOTE_VERSION, threadCount(), simdTargets().front());
  if (!checkPeers(lighting)) return kFailed;

  const Octree tree = makeCloud(options.cloud, options.count);
  if (tree.particleCount() < kLeastCount)
    throw InputError("--cloud", "", fmt::format("at least {} particles", kLeastCount),
                     std::to_string(tree.particleCount()));
  const Task task{tree, makeLight(tree, options.light == "directional"), lighting};
  Contest contest(tree, task.light, lighting, options.runs);
  std::vector<vec3> position(tree.particleCount());
  for (std::size_t i = 0; i < position.size(); ++i) position[i] = tree.position(i);
  const Timer timer;
  buildOctree(position, std::span(tree.radius).first(position.size()), std::span(tree.peak).first(position.size()));
  const double treeSeconds = timer.seconds();
  fmt::print(
      "\n{}, {} particles, {} light; the octree, of exact and all, took {:.3g} s\n"
      "  seconds a light + of preparation; ratio to the exact method run in turn (least .. greatest); |ΔT| mean, p99, "
      "max\n",
      options.cloud, tree.particleCount(), options.light, treeSeconds);
  // A contender of our own goes here: contest.hold({.name = …, .opticalDepths = …}).
  if (options.wants("fourier")) holdFourierMaps(contest, task, options.verbose);
  if (options.wants("embree")) holdSpheres(contest, task);
  if (options.wants("grid")) holdGrids(contest, task, options.verbose);
  if (!contest.matches().empty()) {
    const Match& match = contest.matches().front();
    fmt::print("  {:<40} {:>8.4g} s\n", "Mote, exact", median(match.exactSeconds));
  }
  if (!options.report.empty())
    writeWholeFile(options.report, contest.reportJson(options.cloud, options.light, treeSeconds));
  return 0;
}

int parseAndRun(int argc, char** argv) {
  Options options;
  CLI::App app("Times other ways of lighting particles against Mote's exact one, and measures their errors.",
               "mote_peers");
  app.add_option("--count", options.count, "Generated particles; 1000000 by default")
      ->type_name("N")
      ->check(CLI::Range(kLeastCount, std::uint64_t{1} << 30).description(""));
  app.add_option("--cloud", options.cloud, "What to light: noise (the default), ball, plume, or a PRT file")
      ->type_name("noise|ball|plume|FILE");
  app.add_option("--light", options.light, "point (the default) or directional")
      ->check(CLI::IsMember({"point", "directional"}).description(""))
      ->type_name("point|directional");
  app.add_option("--peer", options.only, "Only these; may be repeated")
      ->check(CLI::IsMember({"fourier", "embree", "grid"}).description(""))
      ->type_name("fourier|embree|grid");
  app.add_option("--runs", options.runs, "Timed runs of each; 5 by default")
      ->type_name("K")
      ->check(CLI::Range(1, 1000).description(""));
  app.add_option("--threads", options.threads, "Threads to use; 0: one a core")
      ->check(CLI::Range(0, 4096).description(""));
  app.add_flag("-v,--verbose", options.verbose, "Print everything that the searches try");
  app.add_option("--report", options.report, "Write seconds, ratios and errors as JSON")->type_name("OUT.json");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& wanted) {
    return app.exit(wanted);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "mote_peers: {}\n", error.what());
    return kBadInput;
  }
  const ThreadLimit threads(options.threads);
  return run(options);
}

}  // namespace
}  // namespace mote

int main(int argc, char** argv) {
  try {
    return mote::parseAndRun(argc, argv);
  } catch (const mote::InputError& error) {
    fmt::print(stderr, "mote_peers: {}\n", error.what());
    return mote::kBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "mote_peers: {}\n", error.what());
    return mote::kMachine;
  }
}
