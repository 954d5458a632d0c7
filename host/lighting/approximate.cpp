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
/// Cells [radii] are taken from a ladder of eighth roots of 2, so that a slow motion of light or cloud seldom changes
/// the grid. Coarser cells than the first save next to nothing.
constexpr double kLadder = 8;
constexpr double kCoarsest = 1.7, kFinest = 0.2;
/// Bins of depth [cells]: what a finer one would save of the error costs more than a smaller cell does.
constexpr double kBinCells = 2;
constexpr int kMostTries = 4;

double onLadder(double cellRadii) {
  return std::exp2(std::floor(std::log2(std::clamp(cellRadii, kFinest, kCoarsest)) * kLadder + 1e-6) / kLadder);
}

/// How much transmittance differs across the light's way: from a probe's to that of a ray beside it. A cell blurs just
/// that, so its error follows from it, whatever the cloud: see cellFor.
struct Roughness {
  double half = 0, whole = 0;  ///< mean |ΔT| at a distance of half a mean radius and of a whole one
  double slope() const { return whole > 0 && half > 0 ? std::clamp(std::log2(whole / half), 0.3, 1.0) : 1; }
};
constexpr std::size_t kBesides = 384;  ///< pairs: the mean is known to 6 %

/// The cell [radii] that is expected to leave a mean |ΔT| of `error`.
///
/// Measured for noise clouds (r of 1.5 and of 4 spacings, mean τ 0.1, 4, 50, 0.3 and 1.5 M particles), balls, plumes
/// and smoke1: a cell of one radius leaves 0.32 of the roughness at one radius (0.22 where many overlap, 0.45 at radii
/// 10:1). How it goes on from there follows the slope (0.78 at r of 1.5 spacings, 0.95 at 4, 0.45 at radii 10:1): as
/// h^(1.4 slope) for coarser cells, h^(2.1 slope) down to half a radius, h^(2.8 slope) below.
double cellFor(double error, const Roughness& roughness) {
  const double slope = roughness.slope(), atOne = 0.32 * std::max(roughness.whole, 1e-12);
  const double atHalf = atOne * std::pow(0.5, 2.1 * slope);
  if (error > atOne) return std::pow(error / atOne, 1 / (1.4 * slope));
  if (error > atHalf) return std::pow(error / atOne, 1 / (2.1 * slope));
  return 0.5 * std::pow(error / atHalf, 1 / (2.8 * slope));
}
/// Aimed at a little below what is allowed: the upper limit is some 6 % above the mean, and the model as much off.
constexpr double kAim = 0.85;

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

/// Adds rays beside some of the probes, across the light's way: first all at half a radius, then all at one.
std::size_t addBesides(Probes& probes, const layout::Light& light, double radius) {
  const std::size_t count = std::min(kBesides, probes.index.size());
  for (const double distance : {0.5 * radius, radius})
    for (std::size_t i = 0; i < count; ++i) {
      const dvec3 start(probes.x[i], probes.y[i], probes.z[i]);
      const dvec3 way =
          light.type == layout::kLightDirectional ? dvec3(light.direction) : start - dvec3(light.position);
      const dvec3 across = glm::cross(way, Random(kProbeStream, i).direction());
      const dvec3 beside = start + (glm::length(across) > 0 ? glm::normalize(across) * distance : dvec3(0));
      probes.x.push_back(static_cast<float>(beside.x)), probes.y.push_back(static_cast<float>(beside.y));
      probes.z.push_back(static_cast<float>(beside.z)), probes.self.push_back(probes.self[i]);
    }
  return count;
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

/// The edge of a cell that is 1 on the plane one unit from a point light, where the probes are and across their rays:
/// z²·cos θ in area, in the mean. 1 for directional.
double typicalScale(const Probes& probes, const layout::Light& light) {
  if (light.type == layout::kLightDirectional) return 1;
  double sum = 0;
  for (std::size_t i = 0; i < probes.x.size(); ++i) {
    const dvec3 offset = glm::abs(dvec3(probes.x[i], probes.y[i], probes.z[i]) - dvec3(light.position));
    const double z = std::max({offset.x, offset.y, offset.z}), distance = glm::length(offset);
    sum += distance > 0 ? z * std::sqrt(z / distance) : 0;
  }
  return sum / static_cast<double>(probes.x.size());
}

/// Core seconds · 1e6 a receiver, fitted to clouds of 0.25–4 M particles on one machine. Only the ratio matters: it is
/// the same within a factor of 1.5 on every instruction set.
double gridCost(double cellRadii) {
  const double across = 2 * std::sqrt(std::max(1 / (cellRadii * cellRadii) - 1.333, 0.25));  // cells of a kernel
  return 0.055 + 0.0045 * (across + 1) * (across + 1);
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
/// Of one probe.
double probeCost(double met) { return 4 + 0.035 * met; }

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
        exactCost_(exactCost(particlesMet(tree))) {
    const double probed = static_cast<double>(probes_.index.size() + 2 * kBesides) * probeCost(particlesMet(tree));
    probeCost_ = probed / static_cast<double>(reachedCount(receivers, reached));
    // Rounded, so that a slow motion does not change the grid.
    const auto rounded = [](double x, double steps) { return std::exp2(std::round(std::log2(x) * steps) / steps); };
    scale_ = rounded(typicalScale(probes_, light), 16);
    radius_ = rounded(tree.meanRadius, 16);
  }

  /// Depths within the error; empty if exact sums are cheaper.
  std::vector<float> run(double error, Approximation& chosen, const RaysDone& done) {
    if (!worthwhile(kCoarsest, probeCost_)) return {};
    const std::vector<float> exact = exactAtProbes();
    double cell = onLadder(cellFor(kAim * error, roughness_));
    for (chosen.tries = 0; chosen.tries < kMostTries && worthwhile(cell);) {
      chosen.grid = true;
      chosen.cellRadii = cell;
      chosen.resolution = {cell * radius_ / scale_, kBinCells * cell * radius_};
      std::vector<float> depths = gridOpticalDepths(tree_, receivers_, light_, options_, chosen.resolution, reached_,
                                                    chosen.tries == 0 ? done : RaysDone{});
      ++chosen.tries;
      measure(exact, atProbes(depths, receivers_.size(), probes_, light_, options_), probes_.index.size(), chosen);
      if (chosen.upper <= error) return depths;
      // As the model's slope has it, and at least a step.
      cell = std::min(onLadder(cell * std::pow(kAim * error / chosen.mean, 1 / (2.1 * roughness_.slope()))),
                      cell * std::exp2(-1 / kLadder));
    }
    return {};
  }

 private:
  /// `before`: what else must be spent. Once that is done only the grid counts.
  bool worthwhile(double cell, double before = 0) const {
    return cell >= kFinest && gridCost(cell) + before < exactCost_;
  }

  /// Transmittances of the probes, [channel][probe]; and the roughness.
  std::vector<float> exactAtProbes() {
    Probes all = probes_;
    const std::size_t pairs = addBesides(all, light_, radius_), count = probes_.index.size(), rays = all.x.size();
    const std::vector<float> found =
        transmittances(opticalDepthsOfFew(tree_, all.receivers(), light_, options_), rays, light_, options_.extinction);
    const std::size_t channels = found.size() / rays;
    std::vector<float> exact(channels * count);
    for (std::size_t c = 0; c < channels; ++c) {
      const float* own = found.data() + c * rays;
      std::copy_n(own, count, exact.data() + c * count);
      const auto meanDifference = [&](const float* beside) {
        double sum = 0;
        for (std::size_t i = 0; i < pairs; ++i) sum += std::abs(double(own[i]) - double(beside[i]));
        return sum / static_cast<double>(pairs * channels);
      };
      roughness_.half += meanDifference(own + count), roughness_.whole += meanDifference(own + count + pairs);
    }
    return exact;
  }

  const Octree& tree_;
  const Receivers& receivers_;
  const layout::Light& light_;
  const LightingOptions& options_;
  std::span<const std::uint8_t> reached_;
  Probes probes_;
  double exactCost_, probeCost_, scale_, radius_;
  Roughness roughness_;
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
