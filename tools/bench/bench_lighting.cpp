// mote bench lighting: a noise cloud lit by one point light: build of the octree, then the exact optical depths on TBB
// against plain packets (equal radii, and radii over a decade) and in the compute shader, and the light grid on both.
#include <tbb/parallel_sort.h>

#include <cmath>

#include "engine/passes/light_grid_pass.h"
#include "engine/passes/light_pass.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/lighting/lighting.h"
#include "host/octree/octree.h"
#include "tools/bench/bench.h"
#include "tools/bench/bench_cloud.h"
#include "tools/bench/plain_packets.h"

namespace mote {
namespace {

constexpr std::uint64_t kSeed = 0;
constexpr double kRounding = 2e-5;             // |ΔT| that is left without a cutoff, as in mote crosscheck
constexpr std::uint64_t kScalarMost = 20'000;  // particles lit on the scalar path too: a fraction of a second

constexpr double kRadiusRange = 10;  // greatest / least, where radii vary

constexpr double kMostBuildSeconds = 0.2, kLeastRays = 1.0, kLeastAgainstPlain = 2.5, kMostRatio = 5,
                 kMostGridRatio = 3;  // the floors

// Cells of light grids [radii]: about the coarsest that an error asks for, and a fine one.
constexpr double kGridCells[] = {1.0, 0.35};

/// The build, with the sort of as many numbers beside it: a yardstick of the machine's speed at that moment.
Octree timeBuild(Bench& bench, const BenchCloud& cloud) {
  std::vector<std::uint64_t> numbers;
  Octree tree;
  const Contender sort{.name = "tbb::parallel_sort of 64-bit numbers",
                       .work = [&] { tbb::parallel_sort(numbers.begin(), numbers.end()); },
                       .prepare =
                           [&] {
                             numbers.resize(cloud.position.size());
                             for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = hashBits(kSeed, i);
                           }};
  const Contender build{
      .name = "octree build", .work = [&] { tree = cloud.tree(); }, .prepare = [&] { tree = Octree(); }};
  const Comparison* times = bench.compare("octree build", "particles", sort, build, [&]() -> BenchCheck {
    const std::string broken = validate(tree, kDefaultParticlesPerCell);
    return {broken.empty() ? "the tree keeps every promise of its layout" : broken, broken.empty()};
  });
  if (times)
    bench.addFloor({"octree build [s per million particles]",
                    times->medianB() / static_cast<double>(bench.count()) * 1e6, kMostBuildSeconds});
  return tree;
}

/// The SIMD path against the scalar one on a smaller cloud, bit for bit.
BenchCheck scalarCheck(std::uint64_t count, const layout::Light& light, const LightingOptions& options) {
  const BenchCloud cloud = benchCloud(std::min(count, kScalarMost), options.falloff);
  const Octree tree = cloud.tree();
  const bool same = opticalDepths(tree, light, options) == opticalDepthsScalar(tree, light, options);
  return {fmt::format("SIMD {} the scalar path on {} particles", same ? "equals" : "is not", tree.particleCount()),
          same};
}

/// Two sets of exact optical depths may differ by what their cutoffs leave open.
BenchCheck sameLight(const std::vector<float>& first, const std::vector<float>& second, const layout::Light& light,
                     const LightingOptions& options) {
  const std::vector<float> a = transmittances(first, light), b = transmittances(second, light);
  const double limit = std::max<double>(options.cutoff, kRounding);
  double worst = 0, mean = 0;
  std::size_t beyond = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double error = std::abs(double(a[i]) - double(b[i]));
    worst = std::max(worst, error);
    beyond += !(error <= limit);  // also where it is not a number, which max() passes over
    mean += a[i] / static_cast<double>(a.size());
  }
  return {fmt::format("worst |ΔT| {:.1e} (limit {:.0e}, {} beyond), mean T {:.3f}", worst, limit, beyond, mean),
          beyond == 0};
}

void addFloors(Bench& bench, const Comparison& times) {
  bench.addFloor(
      {"lighting on TBB [M rays/s]", static_cast<double>(bench.count()) / times.medianA() * 1e-6, kLeastRays, true});
  if (!times.timesB.wall.empty())
    bench.addFloor({"lighting in compute / on TBB [time]", median(times.ratios()), kMostRatio});
}

/// CPU seconds of B over those of A, run by run: both use all threads, and others' load disturbs these least.
std::vector<double> coreRatios(const Comparison& times) {
  std::vector<double> ratios;
  for (std::size_t run = 0; run < times.timesB.core.size(); ++run)
    ratios.push_back(times.timesB.core[run] / times.timesA.core[run]);
  return ratios;
}

void lightGrids(Bench& bench, const Octree& tree, const layout::Light& light, const LightingOptions& options) {
  if (!bench.device()) return;
  LightGridPass pass(*bench.device());
  const double radius = tree.radius.front(), distance = glm::length(light.position);  // equal radii about the origin
  for (const double cell : kGridCells) {
    const GridResolution resolution{cell * radius / distance, 2 * cell * radius};
    const std::string name = fmt::format("light grid, cells of {:g} radi{}", cell, cell == 1 ? "us" : "i");
    std::vector<float> onHost, onDevice;
    const Contender host{"light grid on TBB",
                         [&] { onHost = gridOpticalDepths(tree, slotsOf(tree), light, options, resolution); }};
    const Contender compute{"light grid in compute on the device",
                            [&] { onDevice = pass.opticalDepths(tree, slotsOf(tree), light, options, resolution); }};
    const LightingOptions exact{.cutoff = 0};  // neither stops early: rounding alone may differ
    const Comparison* times =
        bench.compare(name, "rays", host, compute, [&] { return sameLight(onHost, onDevice, light, exact); });
    if (times)
      bench.addFloor(
          {fmt::format("{}: in compute / on TBB [CPU time]", name), median(coreRatios(*times)), kMostGridRatio});
  }
}

void againstPlainPackets(Bench& bench, const std::string& name, const BenchCloud& cloud, const layout::Light& light,
                         const LightingOptions& options) {
  const Octree tree = cloud.tree();
  const Octree fine = cloud.tree(kPlainPacketLeaf);
  std::vector<float> beams, packets;
  const Contender ours{"lighting on TBB", [&] { beams = opticalDepths(tree, light, options); }};
  const Contender plain{"plain packets of 16 rays", [&] { packets = plainPacketDepths(fine, light, options); }};
  const Comparison* times =
      bench.compare(name, "rays", ours, plain, [&] { return sameLight(beams, packets, light, options); });
  if (times)
    bench.addFloor({fmt::format("{}: plain packets / lighting on TBB [time]", name), median(times->ratios()),
                    kLeastAgainstPlain, true});
}

}  // namespace

void benchLighting(Bench& bench) {
  const LightingOptions options;
  const layout::Light light = benchLight();
  const BenchCloud cloud = benchCloud(bench.count(), options.falloff);
  const Octree tree = timeBuild(bench, cloud);
  againstPlainPackets(bench, "exact, equal radii", cloud, light, options);
  againstPlainPackets(bench, "exact, radii 10:1", benchCloud(bench.count(), options.falloff, {.range = kRadiusRange}),
                      light, options);

  std::vector<float> onHost, onDevice;
  const Contender host{"lighting on TBB", [&] { onHost = opticalDepths(tree, light, options); }};
  const Device* device = bench.device();
  const Comparison* times = nullptr;
  if (device) {
    LightPass pass(*device, options.falloff, options.endpoint);
    pass.setTree(tree);
    const Contender compute{"lighting in compute on the device",
                            [&] { onDevice = pass.opticalDepths(light, options); }};
    times = bench.compare("lighting", "rays", host, compute, [&] {
      return both(scalarCheck(bench.count(), light, options), sameLight(onHost, onDevice, light, options));
    });
  } else {
    times = bench.compare("lighting", "rays", host, std::nullopt,
                          [&] { return scalarCheck(bench.count(), light, options); });
  }
  if (times) addFloors(bench, *times);
  lightGrids(bench, tree, light, options);
}

}  // namespace mote
