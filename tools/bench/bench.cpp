// mote bench: what is common to all of them, and the command.
#include "tools/bench/bench.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/core/progress.h"
#include "host/core/simd_targets.h"
#include "tools/render.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

struct Benchmark {
  const char *name, *about, *unit;
  std::uint64_t count;  ///< default, which the floors are for
  void (*run)(Bench&);
  const char* files = nullptr;  ///< what it takes files for; null: it takes none
};
constexpr Benchmark kBenchmarks[] = {
    {"figures", "Figures 22 to 25 and 31 of the thesis, stage by stage, on the CPU and on the device",
     "particles in the largest cloud, the other clouds and the pictures in proportion", kFiguresCount, benchFigures},
    {"formats", "Reading and writing particle files against their bare numbers", "particles", 1'000'000, benchFormats,
     "More particle files, of any format, to be read"},
    {"frame", "A frame from PRT file to EXR picture, on the CPU and on the device",
     "particles, a third of them for sub-sampling, the picture in proportion", kFrameCount, benchFrame},
    {"lighting", "Build of the octree, and lighting on TBB against the compute shader", "particles", 1'000'000,
     benchLighting},
    {"scaling", "Time per particle of octree and lighting at a fixed radius, from 1/64 of the particles to all of them",
     "particles", 32'000'000, benchScaling},
    {"sort", "tbb::parallel_sort against the bitonic sort on the device", "pairs", 1 << 20, benchSort},
    {"splat", "Rasteriser on TBB against the splat pass on the device", "splats", 1'000'000, benchSplat},
};
constexpr std::uint64_t kLeastCount = 2;          // one particle has no spacing
constexpr std::uint64_t kMostCount = 1ull << 30;  // SortPass::kMaxCount; the others run out of memory before
constexpr int kMostRuns = 1000;

void runOnce(const Contender& contender) {
  if (contender.prepare) contender.prepare();
  contender.work();
}

void time(const Contender& contender, RunTimes& times) {
  if (contender.prepare) contender.prepare();
  times.time(contender.work);
  if (!contender.stages) return;
  for (const auto& [stage, seconds] : *contender.stages) times.stages[stage].push_back(seconds);
}

/// "0.0986 s (0.0981 .. 0.1204)": median, least and greatest.
std::string spread(const std::vector<double>& values, const char* unit) {
  const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
  return fmt::format("{:.4g}{} ({:.4g} .. {:.4g})", median(values), unit, *least, *greatest);
}

/// "1.234 M/s".
std::string rate(double count, double seconds) { return fmt::format("{:.4g} M/s", count / seconds * 1e-6); }

/// "load 0.85, octree 1.00 s": medians, in the order of the work.
std::string stageSeconds(const RunTimes& times) {
  std::string text;
  for (const char* stage : {"load", "octree", "lighting", "sort", "splat", "write"})
    if (const auto found = times.stages.find(stage); found != times.stages.end())
      text += fmt::format("{}{} {:.4g}", text.empty() ? "" : ", ", stage, median(found->second));
  return text + " s";
}

void print(const Comparison& comparison) {
  fmt::print("\n{}, {} {}\n", comparison.name, comparison.countB, comparison.unit);
  fmt::print("  check  {}: {}\n", comparison.check.text, comparison.check.passed ? "ok" : "DIFFERS");
  if (!comparison.check.passed) fmt::print("  not timed, because the results are wrong\n");
  const auto contender = [&](char letter, const std::string& name, std::uint64_t count, const RunTimes& times) {
    fmt::print("  {}      {:<39} {:>13}  {:<32}  {:.4g} core-s\n", letter, name,
               rate(static_cast<double>(count), median(times.wall)), spread(times.wall, " s"), median(times.core));
    if (!times.stages.empty()) fmt::print("         {}\n", stageSeconds(times));
  };
  if (!comparison.timesA.wall.empty()) contender('A', comparison.a, comparison.countA, comparison.timesA);
  if (comparison.timesB.wall.empty()) return;
  contender('B', comparison.b, comparison.countB, comparison.timesB);
  fmt::print("  B / A  {}\n", spread(comparison.ratios(), ""));
}

void print(const Floor& floor) {
  fmt::print("  {:<52} {:>8.4g}   floor {} {:<6.4g} {}\n", floor.text, floor.value, floor.atLeast ? "≥" : "≤",
             floor.limit, floor.reached() ? "pass" : "below");
}

Json toJson(const Comparison& comparison) {
  Json json = {{"name", comparison.name},
               {"unit", comparison.unit},
               {"count", comparison.countB},
               {"count_a", comparison.countA},
               {"a", comparison.a},
               {"b", nullptr},
               {"seconds_a", comparison.timesA.wall},
               {"seconds_b", comparison.timesB.wall},
               {"core_seconds_a", comparison.timesA.core},
               {"core_seconds_b", comparison.timesB.core},
               {"check", {{"text", comparison.check.text}, {"passed", comparison.check.passed}}}};
  if (!comparison.b.empty()) json["b"] = comparison.b;
  if (!comparison.timesA.stages.empty()) json["stages_a"] = comparison.timesA.stages;
  if (!comparison.timesB.stages.empty()) json["stages_b"] = comparison.timesB.stages;
  if (const auto& point = comparison.point)
    json["figure"] = {{"number", point->figure}, {"title", point->title}, {"axis", point->axis}, {"x", point->x}};
  setRatios(json, comparison.ratios());
  return json;
}

Json toJson(const Floor& floor) {
  return {{"name", floor.text},
          {"value", floor.value},
          {"limit", floor.limit},
          {"wanted", floor.atLeast ? "at least" : "at most"},
          {"reached", floor.reached()}};
}

}  // namespace

Bench::Bench(const std::string& name, const BenchOptions& options, const CommonOptions& common)
    : name_(name), options_(options) {
  // Before any work: an unwritable report must not cost a minute.
  if (!options.report.empty()) OutputFile{options.report};
  std::string why;
  try {
    gpu_ = std::make_unique<Gpu>(deviceOptions(common));
  } catch (const MachineError& error) {
    if (!common.device.empty()) throw;
    why = error.what();
  }
  fmt::print("mote {} bench {}: {} threads, {}; {} timed runs of A and B in turn after one that is not counted\n",
             MOTE_VERSION, name, threadCount(), simdTargetInUse(), options.runs);
  if (gpu_)
    fmt::print("device: {}\n", gpu_->device().name());
  else
    fmt::print("device: none, so what runs on it is left out: {}\n", why);
  if (common.validate) fmt::print("The validation layers are on: what runs on the device is slower than without.\n");
}

const Comparison* Bench::compare(const std::string& name, const std::string& unit, const Contender& a,
                                 const std::optional<Contender>& b, const std::function<BenchCheck()>& check) {
  compareInTurn({{.name = name, .unit = unit, .a = a, .b = b, .check = check}});
  return comparisons_.back().check.passed ? &comparisons_.back() : nullptr;
}

Comparison Bench::checked(const Trial& trial) const {
  Comparison comparison;
  comparison.name = trial.name;
  comparison.unit = trial.unit;
  comparison.countA = trial.a.count != 0 ? trial.a.count : options_.count;
  comparison.countB = !trial.b ? comparison.countA : trial.b->count != 0 ? trial.b->count : options_.count;
  comparison.a = trial.a.name;
  if (trial.b) comparison.b = trial.b->name;
  comparison.point = trial.point;
  runOnce(trial.a);
  if (trial.b) runOnce(*trial.b);
  comparison.check = trial.check();
  return comparison;
}

void Bench::compareInTurn(const std::vector<Trial>& trials) {
  Progress progress(trials.front().name, static_cast<double>(trials.size()) * (1 + options_.runs), "runs");
  std::vector<Comparison> comparisons;
  for (const Trial& trial : trials) {
    comparisons.push_back(checked(trial));
    progress.advance(1);
  }
  for (int run = 0; run < options_.runs; ++run) {
    for (std::size_t i = 0; i < trials.size(); ++i) {
      progress.advance(1);
      if (!comparisons[i].check.passed) continue;
      time(trials[i].a, comparisons[i].timesA);
      if (trials[i].b) time(*trials[i].b, comparisons[i].timesB);
    }
  }
  for (Comparison& comparison : comparisons) {
    print(comparison);
    comparisons_.push_back(std::move(comparison));
  }
  if (std::fflush(stdout) != 0) throw MachineError("writing to stdout failed");  // the next one may take a minute
}

int Bench::finish(std::uint64_t floorCount) {
  requireNoValidationMessages(gpu_.get());
  if (!floors_.empty()) {
    const bool same = options_.count == floorCount;
    fmt::print("\nfloors, for {} on 2 cores{}:\n", floorCount,
               same ? "" : fmt::format("; this was {}", options_.count));
    for (const Floor& floor : floors_) print(floor);
  }
  if (!options_.report.empty()) writeWholeFile(options_.report, reportJson());
  const bool right =
      std::all_of(comparisons_.begin(), comparisons_.end(), [](const Comparison& c) { return c.check.passed; });
  return right ? 0 : 1;
}

std::string Bench::reportJson() const {
  Json runs = Json::array(), floors = Json::array();
  for (const Comparison& comparison : comparisons_) runs.push_back(toJson(comparison));
  for (const Floor& floor : floors_) floors.push_back(toJson(floor));
  const Json root = {{"version", MOTE_VERSION},    {"device", gpu_ ? gpu_->device().name() : "none"},
                     {"threads", threadCount()},   {"simd", simdTargetInUse()},
                     {"benchmark", name_},         {"runs", std::move(runs)},
                     {"floors", std::move(floors)}};
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void addBenchCommand(CLI::App& app, const CommonOptions& common, int& exitCode) {
  CLI::App* bench =
      app.add_subcommand("bench", "Time two ways of doing one thing against each other; 1 if their results differ");
  bench->require_subcommand(1);
  for (const Benchmark& benchmark : kBenchmarks) {
    auto options = std::make_shared<BenchOptions>();
    options->count = benchmark.count;
    CLI::App* command = bench->add_subcommand(benchmark.name, benchmark.about);
    command
        ->add_option("--count", options->count,
                     fmt::format("How many {}; {} by default", benchmark.unit, benchmark.count))
        ->type_name("N")
        ->check(CLI::Range(kLeastCount, kMostCount).description(""));
    command->add_option("--runs", options->runs, fmt::format("Timed runs of each; {} by default", options->runs))
        ->type_name("K")
        ->check(CLI::Range(1, kMostRuns).description(""));
    if (benchmark.files) command->add_option("files", options->files, benchmark.files)->type_name("FILE");
    command->add_option("--report", options->report, "Write the seconds and ratios as JSON")->type_name("OUT.json");
    command->callback([options, &benchmark, &common, &exitCode] {
      Bench run(benchmark.name, *options, common);
      benchmark.run(run);
      exitCode = run.finish(benchmark.count);
    });
  }
}

}  // namespace mote
