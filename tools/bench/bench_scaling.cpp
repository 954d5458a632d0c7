// mote bench scaling: the noise cloud with 1/64, 1/32, … of `count` particles to all of them, all with one radius: the
// time per particle of the octree's build, of lighting within an error of 0.01 and of exact lighting.
//
// Each is timed in turn with the same on the smallest cloud, so what is reported is a ratio that does not drift.
#include <algorithm>
#include <cmath>

#include "host/core/cap.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/lighting/approximate.h"
#include "host/octree/octree.h"
#include "tools/bench/bench.h"
#include "tools/bench/bench_cloud.h"

namespace mote {
namespace {

constexpr std::uint64_t kSeed = 0;
constexpr int kDoublings = 6;          // 0.5 M to 32 M
constexpr int kMiddle = 3;             // doublings at whose spacing the radius is 1.5: of 4 M particles
constexpr double kError = 0.01;        // mean |ΔT|
constexpr double kRounding = 2e-5;     // |ΔT| that is left without a cutoff, as in mote crosscheck
constexpr std::uint64_t kProbes = 32;  // rays summed over all particles: seconds at 32 M
constexpr double kMostRise = 1.3;      // the floor

/// Optical depth from a slot to the point light, falloff smooth and soft ends, in double over every particle.
double bruteForceDepth(const Octree& tree, std::size_t slot, const layout::Light& light) {
  const dvec3 start(tree.position(slot)), toLight = dvec3(light.position) - start;
  const double length = glm::length(toLight);
  const dvec3 direction = toLight / length;
  constexpr std::size_t kBlock = 1 << 16;
  std::vector<double> part((tree.particleCount() + kBlock - 1) / kBlock);
  parallelBlocks(tree.particleCount(), kBlock, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t j = begin; j < end; ++j) {
      const dvec3 offset = dvec3(tree.position(j)) - start;
      const double t = glm::dot(offset, direction), r = tree.radius[j];
      const double u = 1 - (glm::dot(offset, offset) - t * t) / (r * r);
      if (u <= 0 || j == slot) continue;
      const auto chord = static_cast<float>(r * std::sqrt(u));
      sum += double(tree.peak[j]) * u * u * double(cap(static_cast<float>(t), chord)) *
             double(cap(static_cast<float>(length - t), chord));
    }
    part[begin / kBlock] = sum;
  });
  double depth = 0;
  for (const double sum : part) depth += sum;
  return depth;
}

/// Exact optical depths against sums over every particle, at slots drawn at random.
BenchCheck againstBruteForce(const Octree& tree, const std::vector<float>& depths, const layout::Light& light,
                             const LightingOptions& options) {
  const double limit = double(options.cutoff) + kRounding;
  double worst = 0;
  for (std::uint64_t i = 0; i < kProbes; ++i) {
    const std::size_t slot = hashBits(kSeed, i, 2) % tree.particleCount();
    const double error = std::abs(std::exp(-double(depths[slot])) - std::exp(-bruteForceDepth(tree, slot, light)));
    worst = error <= worst ? worst : error;  // a NaN stays
  }
  return {fmt::format("worst |ΔT| {:.1e} of {} sums over all particles (limit {:.1e})", worst, kProbes, limit),
          worst <= limit};
}

/// Approximate optical depths against exact ones, over all slots.
BenchCheck withinError(const std::vector<float>& found, const std::vector<float>& exact, const layout::Light& light,
                       const Approximation& chosen) {
  const std::vector<float> a = transmittances(found, light), b = transmittances(exact, light);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(double(a[i]) - double(b[i]));
  const double mean = sum / static_cast<double>(a.size());
  const std::string how = chosen.method == DepthMethod::Grid ? fmt::format("grid of {:.2f} radii", chosen.cellRadii)
                          : chosen.method == DepthMethod::Detail
                              ? fmt::format("{} particles and stand-ins", chosen.treeParticles)
                              : std::string("exact sums");
  return {fmt::format("mean |ΔT| {:.5f} over all particles (limit {}), by {}", mean, kError, how), mean <= kError};
}

/// The ways timed, for one cloud.
class Lit {
 public:
  Lit(BenchCloud cloud, const LightingOptions& options)
      : cloud_(std::move(cloud)), options_(options), light_(benchLight()) {
    build();
  }

  std::uint64_t count() const { return cloud_.count(); }
  float radius() const { return cloud_.radius.front(); }

  void build() { tree_ = cloud_.tree(); }
  void lightExactly() { exact_ = opticalDepths(tree_, light_, options_); }
  void lightWithin() {
    found_ = approximateOpticalDepths(tree_, slotsOf(tree_), light_, options_, {.mean = kError}, chosen_);
  }

  BenchCheck checkTree() const {
    const std::string broken = validate(tree_, kDefaultParticlesPerCell);
    return {broken.empty() ? "the tree keeps every promise of its layout" : broken, broken.empty()};
  }
  BenchCheck checkExact() const { return againstBruteForce(tree_, exact_, light_, options_); }
  /// After lightExactly().
  BenchCheck checkWithin() const { return withinError(found_, exact_, light_, chosen_); }

 private:
  BenchCloud cloud_;
  LightingOptions options_;
  layout::Light light_;
  Octree tree_;
  std::vector<float> exact_, found_;
  Approximation chosen_;
};

/// Time per particle of one way, relative to that on the smallest cloud.
struct Series {
  std::string name;
  void (Lit::*work)();
  BenchCheck (Lit::*check)() const;
  std::vector<double> relative{1};

  /// The greatest rise from a cloud to a larger one.
  double rise() const {
    double least = INFINITY, rise = 0;
    for (const double time : relative) {
      least = std::min(least, time);
      rise = std::max(rise, time / least);
    }
    return rise;
  }
};

void timeAgainst(Bench& bench, Series& series, Lit& smallest, Lit& larger) {
  const auto contender = [&](Lit& lit, const std::string& name) {
    return Contender{.name = name, .work = [&] { (lit.*series.work)(); }, .count = lit.count()};
  };
  const Comparison* times = bench.compare(fmt::format("{}, {}", series.name, larger.count()), "particles",
                                          contender(smallest, fmt::format("on {} particles", smallest.count())),
                                          contender(larger, series.name), [&] {
                                            const BenchCheck check = (smallest.*series.check)();
                                            return check.passed ? (larger.*series.check)() : check;
                                          });
  if (times)
    series.relative.push_back(median(times->ratios()) * static_cast<double>(smallest.count()) /
                              static_cast<double>(larger.count()));
}

}  // namespace

void benchScaling(Bench& bench) {
  const LightingOptions options;
  std::vector<Series> all{{"octree build", &Lit::build, &Lit::checkTree},
                          {"exact lighting", &Lit::lightExactly, &Lit::checkExact},
                          {fmt::format("lighting, error {}", kError), &Lit::lightWithin, &Lit::checkWithin}};
  Lit smallest(
      benchCloud(std::max<std::uint64_t>(bench.count() >> kDoublings, 2), options.falloff, {.finer = 1 << kMiddle}),
      options);
  for (int doublings = 1; doublings <= kDoublings; ++doublings) {
    Lit larger(benchCloud(bench.count() >> (kDoublings - doublings), options.falloff, {.radius = smallest.radius()}),
               options);
    for (Series& series : all) timeAgainst(bench, series, smallest, larger);
  }
  for (const Series& series : all)
    if (series.work != &Lit::build && series.relative.size() == kDoublings + 1)
      bench.addFloor({fmt::format("{}: rise of the time per particle", series.name), series.rise(), kMostRise});
}

}  // namespace mote
