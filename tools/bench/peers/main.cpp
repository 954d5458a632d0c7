// mote_peers: other people's ways to light particles, timed against Mote's at equal error.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

#include "host/core/error.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/core/simd_targets.h"
#include "host/core/timer.h"
#include "tools/bench/peers/check.h"
#include "tools/bench/peers/cloud.h"
#include "tools/bench/peers/contest.h"
#include "tools/bench/peers/peer_list.h"
#include "tools/bench/peers/search.h"

namespace mote {
namespace {

// As mote's: 0 done, 1 a check failed, 2 bad input or usage, 3 the machine.
constexpr int kFailed = 1, kBadInput = 2, kMachine = 3;

constexpr std::uint64_t kLeastCount = 4000;  // fewer make no p99
/// Sides of maps: whole tiles, in steps of some 10 %.
constexpr int kMapSizes[] = {48,  64,  80,  96,  112, 128, 144, 160, 176, 192, 208, 224,  240,  256,  288,
                             320, 352, 384, 416, 448, 512, 576, 640, 704, 768, 896, 1024, 1280, 1536, 2048};
constexpr std::size_t kMostMapBytes = std::size_t{1} << 30;

struct Options {
  std::uint64_t count = 1'000'000;
  std::string cloud = "noise", light = "point", report;
  std::vector<std::string> only;
  std::vector<double> errors{0.01, 0.002};
  int runs = 5;
  bool verbose = false, checkOnly = false;
  unsigned threads = 0;

  bool wants(const std::string& peer) const {
    return only.empty() || std::find(only.begin(), only.end(), peer) != only.end();
  }
};

/// The cheapest setting for each error, timed.
void holdCheapest(Contest& contest, std::vector<std::vector<Peer>> series, const std::string& what,
                  const Options& options) {
  Search search(contest, std::move(series), options.verbose);
  for (const double error : options.errors) {
    fmt::print("\n  {}, mean |ΔT| ≤ {}\n", what, error);
    if (const Peer* best = search.cheapest(error))
      contest.hold(*best, error);
    else
      fmt::print("    none of those tried keeps it; the best has {:.5f}\n", search.bestError());
  }
}

/// As points in depth, as in the paper, and as chords; 15 harmonics first, which keep most errors, so that the search
/// soon knows what is too dear.
void holdFourierMaps(Contest& contest, const Task& task, const Options& options) {
  std::vector<std::vector<Peer>> series;
  for (const int harmonics : {15, 7, 31, 3, 63})
    for (const bool thick : {false, true}) {
      series.emplace_back();
      for (const int size : kMapSizes)
        if (const FourierMapOptions map{size, harmonics, thick}; fourierMapBytes(map) <= kMostMapBytes)
          series.back().push_back(fourierPeer(task, map));
    }
  holdCheapest(contest, std::move(series), "Fourier opacity map", options);
}

void holdGrids(Contest& contest, const Task& task, const Options& options) {
  std::vector<std::vector<Peer>> series;
  for (const float step : {2.0f, 3.0f, 4.0f, 1.0f}) {
    series.emplace_back();
    for (const int size : {32, 48, 64, 80, 96, 112, 128, 144, 160, 176, 192, 224, 256, 320, 384, 448, 512})
      series.back().push_back(gridPeer(task, {.size = size, .step = step}));
  }
  holdCheapest(contest, std::move(series), "OpenVDB grid and march", options);
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
  fmt::print("\n  Embree, every hit of a sphere collected, exact\n");
  contest.hold(spherePeer(task, single ? SphereHits::Rays::Single : SphereHits::Rays::Packets), 0);
}

double secondsOfTree(const Octree& tree) {
  std::vector<vec3> position(tree.particleCount());
  for (std::size_t i = 0; i < position.size(); ++i) position[i] = tree.position(i);
  const Timer timer;
  buildOctree(position, std::span(tree.radius).first(position.size()), std::span(tree.peak).first(position.size()));
  return timer.seconds();
}

int run(const Options& options) {
  if (!options.report.empty()) OutputFile{options.report};  // before any work
  const LightingOptions lighting;
  fmt::print("mote_peers {}: {} threads, {}\n", MOTE_VERSION, threadCount(), simdTargets().front());
  if (!checkPeers(lighting)) return kFailed;
  if (options.checkOnly) return 0;

  const Octree tree = makeCloud(options.cloud, options.count);
  if (tree.particleCount() < kLeastCount)
    throw InputError("--cloud", "", fmt::format("at least {} particles", kLeastCount),
                     std::to_string(tree.particleCount()));
  const Task task{tree, makeLight(tree, options.light == "directional"), lighting};
  Contest contest(tree, task.light, lighting, options.runs);
  const double treeSeconds = secondsOfTree(tree);
  fmt::print(
      "\n{}, {} particles, {} light; the octree, of exact sums and grids, took {:.3g} s\n"
      "  |ΔT|: mean, 99th percentile, greatest; seconds: median of {} runs in turn\n",
      options.cloud, tree.particleCount(), options.light, treeSeconds, options.runs);
  if (options.wants("fourier")) holdFourierMaps(contest, task, options);
  if (options.wants("grid")) holdGrids(contest, task, options);
  if (options.wants("embree")) holdSpheres(contest, task);
  if (!options.report.empty())
    writeWholeFile(options.report, contest.reportJson(options.cloud, options.light, treeSeconds));
  return contest.passed() ? 0 : kFailed;
}

int parseAndRun(int argc, char** argv) {
  Options options;
  CLI::App app("Times other ways of lighting particles against Mote's at equal error; 1 if one misses the exact sums.",
               "mote_peers");
  app.add_option("--count", options.count, "Generated particles; 1000000 by default; a file has its own")
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
  app.add_option("--error", options.errors, "Mean |ΔT| to keep; may be repeated; 0.01 and 0.002 by default")
      ->type_name("E")
      ->check(CLI::Range(1e-5, 1.0).description(""));
  app.add_option("--runs", options.runs, "Timed runs of each; 5 by default")
      ->type_name("K")
      ->check(CLI::Range(1, 1000).description(""));
  app.add_option("--threads", options.threads, "Threads to use; 0: one a core")
      ->check(CLI::Range(0, 4096).description(""));
  app.add_flag("-v,--verbose", options.verbose, "Print everything that the searches try");
  app.add_flag("--check", options.checkOnly, "Only check on a small cloud that all agree with the exact sums");
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
