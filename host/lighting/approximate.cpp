#include "host/lighting/approximate.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "host/lighting/level_of_detail.h"

namespace mote {
namespace {

constexpr int kMostTries = 4;
/// Aimed at a little below what is allowed: the upper limit is some 6 % above the mean, and a model as much off.
constexpr double kAim = 0.85;

// ---- the light grid

/// Cells [radii] are taken from a ladder of sixteenth roots of 2, so that a slow motion of light or cloud seldom
/// changes the grid. Coarser cells than the first save next to nothing.
constexpr double kLadder = 16;
constexpr double kCoarsest = 1.2, kFinest = 0.2;
/// Bins of depth [cells]: what a finer one would save of the error costs more than a smaller cell does.
constexpr double kBinCells = 2;

double rung(int number) { return kCoarsest * std::exp2(-number / kLadder); }
/// So that a slow motion does not change the grid.
double rounded(double x) { return std::exp2(std::round(std::log2(x) * 16) / 16); }

/// The mean |ΔT| that a grid is expected to leave. Between nodes it finds what lies on the straight line from one to
/// the next, so its error goes as the transmittance bends over half a cell, whatever the cloud.
///
/// Measured for noise clouds (r of 1.5 and of 4 spacings, radii 10:1, mean τ 0.1, 4 and 50, 0.2 to 1 M particles, all
/// falloffs), balls, plumes and smoke1: within 15 % for most, 35 % at a τ of 50.
double gridError(double cellRadii, const Roughness& roughness) {
  // Of what the bend is: by log2 of the cell.
  constexpr std::pair<double, double> kShares[] = {{-2.3, 1.1}, {-2, 0.94},   {-1.5, 0.86},
                                                   {-1, 0.92},  {-0.5, 1.13}, {0, 1.25}};
  const double x = std::clamp(std::log2(cellRadii), kShares[0].first, std::end(kShares)[-1].first);
  const auto* next = std::begin(kShares) + 1;
  while (next->first < x) ++next;
  const double share = glm::mix(next[-1].second, next->second, (x - next[-1].first) / (next->first - next[-1].first));
  // Where the slope is small radii differ: below, more and more of the small particles are smooth.
  const double slope = roughness.slope(), below = slope + 2 * std::max(1 - slope, 0.0);
  return share * roughness.quarter * std::pow(2 * cellRadii, cellRadii < 0.5 ? below : slope);
}

// ---- costs
//
// In core-µs a receiver, fitted to clouds of 0.1–4 M particles on one machine. Only their ratios matter, which are the
// same within a factor of 1.5 on every instruction set, and on a device.

double gridCost(double cellRadii) {
  const double across = 2 * std::sqrt(0.75 * std::max(1 / (cellRadii * cellRadii) - 0.73, 0.25));  // cells of a kernel
  return 0.03 + 0.0043 * (across + 1) * (across + 1);
}

/// What an endless ray meets: its share of the discs on the cloud's cross-section; clouds clump by about two.
double particlesMet(const Octree& tree) {
  const dvec3 size(tree.bounds().size());
  const double section = std::max((size.x * size.y + size.y * size.z + size.z * size.x) / 3, 1e-300);
  double squares = 0;
  const std::size_t count = tree.particleCount(), step = count / 4096 + 1;
  for (std::size_t slot = 0; slot < count; slot += step)
    squares += static_cast<double>(step) * tree.radius[slot] * tree.radius[slot];
  return kPi * squares / section;
}
double exactCost(double met) { return 0.35 + 0.0009 * met; }
/// Of one probe [core-µs].
double probeCost(double met) { return 4 + 0.035 * met; }

/// Level of detail is thought of where a grid must be fine and many particles overlap: else it never pays, and sums of
/// nodes are saved.
constexpr double kDetailGridCost = 0.15, kDetailExactCost = 1;
/// Its mean error goes about with this power of its tolerance.
constexpr double kDetailPower = 0.85;

// ---- the search

class Search {
 public:
  Search(const Octree& tree, const Receivers& receivers, const layout::Light& light, const LightingOptions& options,
         std::span<const std::uint8_t> reached, const DepthSources& sources)
      : tree_(tree),
        receivers_(receivers),
        light_(light),
        options_(options),
        reached_(reached),
        sources_(sources),
        probes_(tree, receivers, light, options, reached),
        met_(particlesMet(tree)),
        radius_(rounded(tree.meanRadius)) {}

  /// Depths within the error; empty if exact sums are cheaper.
  std::vector<float> run(double error, Approximation& chosen, const RaysDone& done) {
    const double reached = static_cast<double>(
        reached_.empty() ? receivers_.size() : receivers_.size() - std::count(reached_.begin(), reached_.end(), 0));
    const double probing = static_cast<double>(probes_.rays()) * probeCost(met_) / std::max(reached, 1.0);
    if (probes_.count() == 0 || gridCost(kCoarsest) + probing >= exactCost(met_)) return {};
    probes_.lightExactly(radius_);
    coarsestFor(kAim * error);
    tolerance_ = kDetailMargin * error;
    while (chosen.tries < kMostTries) {
      const double grid = cell_ > 0 ? gridCost(cell_) : INFINITY, detail = detailCostNow(grid);
      if (std::min(grid, detail) >= exactCost(met_)) return {};
      std::vector<float> depths = grid <= detail ? byGrid(chosen, done) : byDetail(chosen, done);
      ++chosen.tries;
      chosen.error = probes_.measure(depths);
      if (chosen.error.upper <= error) return depths;
      refine(chosen.method, kAim * error, chosen.error.mean);
    }
    return {};
  }

 private:
  /// What level of detail costs for the tolerance at hand; next to nothing is spent where it cannot pay.
  double detailCostNow(double grid) {
    if (grid < kDetailGridCost || exactCost(met_) < kDetailExactCost) return INFINITY;
    if (!sums_) sums_ = nodeSums(tree_);
    const DetailCost cost = detailCost(tree_, *sums_, detailRules(light_, options_, tolerance_));
    return cost.light +
           cost.build * static_cast<double>(tree_.particleCount()) / static_cast<double>(receivers_.size());
  }

  std::vector<float> byGrid(Approximation& chosen, const RaysDone& done) {
    chosen.method = DepthMethod::Grid;
    chosen.cellRadii = cell_;
    chosen.resolution = {cell_ * radius_ / rounded(probes_.cellScale()), kBinCells * cell_ * radius_};
    chosen.tolerance = 0, chosen.treeParticles = 0;
    return sources_.grid(tree_, receivers_, light_, options_, chosen.resolution, reached_, done);
  }

  std::vector<float> byDetail(Approximation& chosen, const RaysDone& done) {
    chosen.method = DepthMethod::Detail;
    chosen.cellRadii = 0, chosen.resolution = {};
    chosen.tolerance = tolerance_;
    const DetailTree detail(tree_, *sums_, detailRules(light_, options_, tolerance_));
    chosen.treeParticles = detail.tree().particleCount();
    return lodOpticalDepths(detail, receivers_, light_, options_, sources_.exact, reached_, done);
  }

  /// The first rung, from `rung_` on, whose expected error is as small; a cell of 0 where there is none.
  void coarsestFor(double error) {
    while (rung(rung_) >= kFinest && gridError(rung(rung_), probes_.roughness()) * worse_ > error) ++rung_;
    cell_ = rung(rung_) >= kFinest ? rung(rung_) : 0;
  }

  void refine(DepthMethod method, double aim, double found) {
    if (method == DepthMethod::Detail) {
      tolerance_ *= std::min(std::pow(aim / found, 1 / kDetailPower), 0.8);
    } else {
      worse_ = found / gridError(cell_, probes_.roughness());
      ++rung_;
      coarsestFor(aim);
    }
  }

  const Octree& tree_;
  const Receivers& receivers_;
  const layout::Light& light_;
  const LightingOptions& options_;
  std::span<const std::uint8_t> reached_;
  const DepthSources& sources_;
  ErrorProbes probes_;
  double met_, radius_, cell_ = 0, tolerance_ = 0;
  int rung_ = 0;
  double worse_ = 1;  // of what a grid left to what was expected
  std::optional<TreeSums> sums_;
};

}  // namespace

const DepthSources& hostDepths() {
  static const DepthSources sources{
      [](const Octree& tree, const Receivers& receivers, const layout::Light& light, const LightingOptions& options,
         std::span<const std::uint8_t> reached,
         const RaysDone& done) { return opticalDepths(tree, receivers, light, options, reached, done); },
      gridOpticalDepths};
  return sources;
}

std::vector<float> approximateOpticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                            const LightingOptions& options, const ErrorWanted& wanted,
                                            Approximation& chosen, std::span<const std::uint8_t> reached,
                                            const RaysDone& done, const DepthSources& sources) {
  chosen = {};
  chosen.allowed = wanted.aim();
  if (wanted.mean > 0 && !shadowless(light) && tree.particleCount() > 0) {
    std::vector<float> depths =
        Search(tree, receivers, light, options, reached, sources).run(wanted.aim(), chosen, done);
    if (!depths.empty()) return depths;
    const int tries = chosen.tries;
    chosen = {};
    chosen.allowed = wanted.aim(), chosen.tries = tries;
  }
  return sources.exact(tree, receivers, light, options, reached, done);
}

}  // namespace mote
