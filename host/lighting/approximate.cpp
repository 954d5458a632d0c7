#include "host/lighting/approximate.h"

#include <algorithm>
#include <cmath>

#include "host/core/parallel.h"
#include "host/core/random.h"

namespace mote {
namespace {

/// One-sided 99 % quantile of the normal distribution, which a mean of 2,048 follows.
constexpr double kQuantile = 2.326;
/// Sets the probes apart from everything else that an index decides.
constexpr std::uint64_t kProbeStream = 0xe4405;
/// Cells [radii] are taken from a ladder of fourth roots of 2, so that a slow motion of light or cloud does not change
/// the grid from frame to frame.
constexpr double kLadder = 4;
constexpr double kCoarsest = 2, kFinest = 0.2;
/// Bins of depth [cells]: what a finer one would save of the error costs more than a smaller cell does.
constexpr double kBinCells = 2;
constexpr int kMostTries = 4;
/// Cells that are finer than this are not taken by the model's word: a pilot measures the error first, on a part of the
/// tiles. A model that is wrong by two costs a third more there, and next to nothing above.
constexpr double kPilotBelow = 0.45, kPilotCell = 0.5;

/// Mean |ΔT| of a noise cloud (1 M particles, mean τ 4, r = 1.5 spacings, directional light) for cells of h = 2, 1 and
/// ½ radii is 0.023, 0.012 and 0.0037: about 0.0125 · h above one radius and h^1.5 below.
double cellFor(double error) {
  const double ratio = error / 0.0125;
  return ratio > 1 ? ratio : std::pow(ratio, 1 / 1.5);
}
double onLadder(double cellRadii) {
  return std::exp2(std::floor(std::log2(std::clamp(cellRadii, kFinest, kCoarsest)) * kLadder + 1e-6) / kLadder);
}

/// The receivers whose error is measured.
struct Probes {
  std::vector<std::uint32_t> index;
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> self;
  Receivers receivers() const { return {x, y, z, self}; }
  void add(const Receivers& from, std::uint32_t k) {
    index.push_back(k);
    x.push_back(from.x[k]), y.push_back(from.y[k]), z.push_back(from.z[k]);
    self.push_back(from.selfOf(k));
  }
};

Probes drawProbes(const Receivers& receivers, std::span<const std::uint8_t> reached) {
  std::vector<std::uint32_t> eligible;
  if (!reached.empty())
    for (std::size_t k = 0; k < receivers.size(); ++k)
      if (reached[k] != 0) eligible.push_back(static_cast<std::uint32_t>(k));
  const std::size_t count = reached.empty() ? receivers.size() : eligible.size();
  Probes probes;
  for (std::size_t i = 0; i < std::min(kErrorProbes, count); ++i) {
    const std::size_t drawn = count <= kErrorProbes ? i : hashBits(0, i, kProbeStream) % count;
    const std::uint32_t k = reached.empty() ? static_cast<std::uint32_t>(drawn) : eligible[drawn];
    probes.add(receivers, k);
  }
  return probes;
}

std::size_t reachedCount(const Receivers& receivers, std::span<const std::uint8_t> reached) {
  return reached.empty() ? receivers.size()
                         : receivers.size() - static_cast<std::size_t>(std::count(reached.begin(), reached.end(), 0));
}

/// Compact groups of receivers (neighbours in Morton order), so that few tiles are filled for them.
Probes drawPilots(const Receivers& receivers, std::span<const std::uint8_t> reached) {
  constexpr std::size_t kGroups = 8, kGroup = kErrorProbes / kGroups;
  Probes pilots;
  for (std::size_t g = 0; g < kGroups; ++g) {
    const std::size_t first = hashBits(1, g, kProbeStream) % receivers.size();
    for (std::size_t k = first; k < std::min(first + kGroup, receivers.size()); ++k)
      if (reached.empty() || reached[k] != 0) pilots.add(receivers, static_cast<std::uint32_t>(k));
  }
  return pilots;
}

/// Transmittances of the probes out of all receivers' optical depths.
std::vector<float> atProbes(const std::vector<float>& depths, std::size_t receivers, const Probes& probes,
                            const layout::Light& light, const LightingOptions& options) {
  const std::size_t channels = depths.size() / receivers, count = probes.index.size();
  std::vector<float> own(channels * count);
  for (std::size_t c = 0; c < channels; ++c)
    for (std::size_t i = 0; i < count; ++i) own[c * count + i] = depths[c * receivers + probes.index[i]];
  return transmittances(own, count, light, options.extinction);
}

void measure(const std::vector<float>& exact, const std::vector<float>& found, std::size_t probes,
             Approximation& result) {
  const std::size_t channels = exact.size() / probes;
  std::vector<double> errors(probes, 0.0);
  for (std::size_t i = 0; i < exact.size(); ++i)
    errors[i % probes] += std::abs(double(exact[i]) - double(found[i])) / static_cast<double>(channels);
  double sum = 0, squares = 0;
  for (const double e : errors) sum += e, squares += e * e;
  const auto count = static_cast<double>(probes);
  result.probes = probes;
  result.mean = sum / count;
  const double variance = std::max(squares / count - result.mean * result.mean, 0.0);
  result.upper = result.mean + kQuantile * std::sqrt(variance / std::max(count - 1, 1.0));
  std::sort(errors.begin(), errors.end());
  result.p99 = errors[std::min(probes - 1, probes * 99 / 100)];
  result.greatest = errors.back();
}

/// Mean distance of receivers from a point light (of some hundred of them: it only scales the ladder); 1 for
/// directional.
double typicalDistance(const Probes& probes, const layout::Light& light) {
  if (light.type == layout::kLightDirectional) return 1;
  double sum = 0;
  for (std::size_t i = 0; i < probes.x.size(); ++i)
    sum += glm::length(dvec3(probes.x[i], probes.y[i], probes.z[i]) - dvec3(light.position));
  return sum / static_cast<double>(probes.x.size());
}

/// Core seconds · 1e6 a receiver, fitted to clouds of 0.25–4 M particles on one machine. Only the ratio matters: it is
/// the same within a factor of 1.5 on every instruction set.
double gridCost(double cellRadii) {
  const double across = 2 * std::sqrt(std::max(1 - 1.333 * cellRadii * cellRadii, 1.1 * cellRadii * cellRadii));
  const double nodes = across / cellRadii + 1;
  return 0.11 + 0.0045 * nodes * nodes;
}
double exactCost(const Octree& tree) {
  // What a ray meets: its share of the discs on the cloud's cross-section, half of them before it; clouds clump by
  // about two. A third of what its packet is held against.
  const dvec3 size(tree.bounds().size());
  const double section = std::max((size.x * size.y + size.y * size.z + size.z * size.x) / 3, 1e-300);
  const double met = static_cast<double>(tree.particleCount()) * kPi * tree.meanRadius * tree.meanRadius / section;
  return 0.2 + 0.0009 * met;
}

/// The search for a grid that keeps an error.
class GridSearch {
 public:
  GridSearch(const Octree& tree, const Receivers& receivers, const layout::Light& light, const LightingOptions& options,
             std::span<const std::uint8_t> reached)
      : tree_(tree),
        receivers_(receivers),
        light_(light),
        options_(options),
        reached_(reached),
        probes_(drawProbes(receivers, reached)),
        exactCost_(exactCost(tree)) {
    // Rounded, so that a slow motion does not change the grid.
    const auto rounded = [](double x, double steps) { return std::exp2(std::round(std::log2(x) * steps) / steps); };
    distance_ = rounded(typicalDistance(probes_, light), kLadder);
    radius_ = rounded(tree.meanRadius, 4 * kLadder);
  }

  /// Depths within the error; empty if exact sums are cheaper.
  std::vector<float> run(double error, Approximation& chosen, const RaysDone& done) {
    double cell = firstCell(error);
    std::vector<float> exact;
    for (chosen.tries = 0; chosen.tries < kMostTries && worthwhile(cell);) {
      if (exact.empty()) exact = exactAt(probes_);
      chosen.grid = true;
      chosen.cellRadii = cell;
      chosen.resolution = resolution(cell);
      std::vector<float> depths = gridOpticalDepths(tree_, receivers_, light_, options_, chosen.resolution, reached_,
                                                    chosen.tries == 0 ? done : RaysDone{});
      ++chosen.tries;
      measure(exact, atProbes(depths, receivers_.size(), probes_, light_, options_), probes_.x.size(), chosen);
      if (chosen.upper <= error) return depths;
      // As the model's slope has it, and at least a step.
      cell = std::min(onLadder(cell * std::pow(error / chosen.upper, 1 / 1.5)), cell * std::exp2(-1 / kLadder));
    }
    return {};
  }

 private:
  bool worthwhile(double cell) const { return cell >= kFinest && gridCost(cell) < exactCost_; }
  GridResolution resolution(double cell) const { return {cell * radius_ / distance_, kBinCells * cell * radius_}; }
  std::vector<float> exactAt(const Probes& probes) const {
    return transmittances(opticalDepths(tree_, probes.receivers(), light_, options_), probes.x.size(), light_,
                          options_.extinction);
  }

  double firstCell(double error) const {
    const double expected = cellFor(error);
    if (expected >= kPilotBelow || !worthwhile(kPilotCell)) return onLadder(expected);
    const Probes pilots = drawPilots(receivers_, reached_);
    if (pilots.index.empty()) return onLadder(expected);
    std::vector<std::uint8_t> only(receivers_.size(), 0);
    for (const std::uint32_t k : pilots.index) only[k] = 1;
    Approximation pilot;
    measure(exactAt(pilots),
            atProbes(gridOpticalDepths(tree_, receivers_, light_, options_, resolution(kPilotCell), only),
                     receivers_.size(), pilots, light_, options_),
            pilots.index.size(), pilot);
    // A tenth less, since the pilots are not spread as the probes are.
    return onLadder(kPilotCell * std::pow(0.9 * error / std::max(pilot.mean, 1e-9), 1 / 1.5));
  }

  const Octree& tree_;
  const Receivers& receivers_;
  const layout::Light& light_;
  const LightingOptions& options_;
  std::span<const std::uint8_t> reached_;
  Probes probes_;
  double exactCost_, distance_, radius_;
};

}  // namespace

std::vector<float> approximateOpticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                            const LightingOptions& options, const ErrorWanted& wanted,
                                            Approximation& chosen, std::span<const std::uint8_t> reached,
                                            const RaysDone& done) {
  chosen = {};
  chosen.allowed = wanted.aim();
  // A few times the probes cost no more than measuring.
  if (wanted.mean > 0 && !shadowless(light) && tree.particleCount() > 0 &&
      reachedCount(receivers, reached) >= 4 * kErrorProbes) {
    std::vector<float> depths = GridSearch(tree, receivers, light, options, reached).run(wanted.aim(), chosen, done);
    if (!depths.empty()) return depths;
    const int tries = chosen.tries;
    chosen = {};
    chosen.allowed = wanted.aim(), chosen.tries = tries;
  }
  return opticalDepths(tree, receivers, light, options, reached, done);
}

}  // namespace mote
