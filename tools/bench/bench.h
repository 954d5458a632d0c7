// Benchmarks that hold two ways of doing one thing against each other in one run.
//
// Timings differ from run to run and from machine to machine by more than most changes do; the ratio of two timings
// taken in turn differs by far less. So every benchmark has two contenders, A B A B …, whose results are checked
// before any time is taken, and the median of the pairwise ratios is what to compare between machines and versions.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/vulkan/gpu.h"
#include "tools/bench/timing.h"
#include "tools/command.h"

namespace mote {

struct BenchOptions {
  std::uint64_t count = 0;              ///< particles or pairs
  int runs = 5;                         ///< timed runs of each contender, ≥ 1, after one that is not counted
  std::string report;                   ///< JSON file; empty: none
  std::vector<std::string> files = {};  ///< more inputs, of benchmarks that take some
};

/// One way of doing it. `work` leaves its result where the check looks for it.
struct Contender {
  std::string name;
  std::function<void()> work;                             ///< timed
  std::function<void()> prepare = {};                     ///< before each run, not timed
  std::uint64_t count = 0;                                ///< of what it works on; 0: the benchmark's own
  const std::map<std::string, double>* stages = nullptr;  ///< the last run's seconds, part by part (FrameStats)
};

/// Whether the contenders' results are right, and how that was seen.
struct BenchCheck {
  std::string text;
  bool passed = false;
};

/// Right where both are.
inline BenchCheck both(const BenchCheck& first, const BenchCheck& second) {
  return {first.text + "; " + second.text, first.passed && second.passed};
}

/// Where a comparison stands in a figure of the thesis.
struct FigurePoint {
  int figure = 0;
  std::string title, axis;  ///< axis: what varies
  double x = 0;
};

/// A comparison that is wanted. Where there is nothing to run B on it is left out.
struct Trial {
  std::string name, unit;  ///< unit: of what `count` counts
  Contender a;
  std::optional<Contender> b;
  std::function<BenchCheck()> check;  ///< after a run of both
  std::optional<FigurePoint> point = {};
};

/// The seconds of one benchmark; without B where there is nothing to run it on.
struct Comparison {
  std::string name, unit;  ///< unit: of what `count` counts
  std::uint64_t countA = 0, countB = 0;
  std::string a, b;
  BenchCheck check;
  RunTimes timesA, timesB;
  std::optional<FigurePoint> point;

  double medianA() const { return median(timesA.wall); }
  double medianB() const { return median(timesB.wall); }
  /// B / A, pair by pair.
  std::vector<double> ratios() const { return pairwiseRatios(timesB, timesA); }
};

/// A figure that must be reached at the benchmark's own count; printed and reported, never a failure.
struct Floor {
  std::string text;
  double value = 0, limit = 0;
  bool atLeast = false;  ///< value ≥ limit is wanted, else value ≤ limit

  bool reached() const { return atLeast ? value >= limit : value <= limit; }
};

class Bench {
 public:
  /// Opens the Vulkan device; without one the device's halves are left out, unless one was asked for by name: then it
  /// throws MachineError. Throws InputError where the report cannot be written. Prints a heading.
  Bench(const std::string& name, const BenchOptions& options, const CommonOptions& common);

  std::uint64_t count() const { return options_.count; }
  const std::vector<std::string>& files() const { return options_.files; }
  /// Null where there is none.
  const Device* device() const { return gpu_ ? &gpu_->device() : nullptr; }
  Gpu* gpu() const { return gpu_.get(); }

  /// Runs both once, checks, and if that passes times them; prints. The result is null where the check failed; it is
  /// valid until the next call.
  const Comparison* compare(const std::string& name, const std::string& unit, const Contender& a,
                            const std::optional<Contender>& b, const std::function<BenchCheck()>& check);
  /// Several at once: runs and checks all of them, then times those that passed in turn, A B of the first, A B of the
  /// second, …, as many times as there are runs; prints. So the machine's drift is in all of them alike.
  void compareInTurn(const std::vector<Trial>& trials);

  void addFloor(Floor floor) { floors_.push_back(std::move(floor)); }

  /// Prints the floors and writes the report: 0, or 1 where a check failed. Throws MachineError for messages of the
  /// validation layers.
  int finish(std::uint64_t floorCount);

 private:
  /// Both run once, and what they left checked.
  Comparison checked(const Trial& trial) const;
  std::string reportJson() const;

  std::string name_;
  BenchOptions options_;
  std::unique_ptr<Gpu> gpu_;
  std::vector<Comparison> comparisons_;
  std::vector<Floor> floors_;
};

// Each runs one of `mote bench …`: the thesis' figures, reading and writing of particle files, a whole frame from file
// to file, lighting and octree, time per particle against particles, the bitonic sort, the splat pass.
constexpr std::uint64_t kFiguresCount = 4'000'000, kFrameCount = 9'000'000;  // of full size
void benchFigures(Bench& bench);
void benchFormats(Bench& bench);
void benchFrame(Bench& bench);
void benchLighting(Bench& bench);
void benchScaling(Bench& bench);
void benchSort(Bench& bench);
void benchSplat(Bench& bench);

}  // namespace mote
