#include "engine/passes/depth_order.h"

#include <algorithm>
#include <bit>

#include "engine/passes/depth_key_pass.h"
#include "engine/passes/part_size.h"
#include "engine/passes/sort_pass.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/splat/merge_runs.h"
#include "host/splat/splat.h"
#include "shaders/glsl/layout/sort.h"

namespace mote {
namespace {

// A pair on the device and the number that it is compared as are the same bytes.
static_assert(std::endian::native == std::endian::little && sizeof(layout::SortPair) == sizeof(std::uint64_t));

}  // namespace

std::vector<layout::uint> depthOrderInRuns(const Device& device, std::span<const layout::SplatParticle> particles,
                                           const layout::SplatCamera& camera, float keyScale, double& deviceSeconds) {
  const auto sizes = [](std::uint64_t count) {
    return std::vector<std::uint64_t>{count * sizeof(layout::SplatParticle),
                                      SortPass::pairBytes(static_cast<std::uint32_t>(count))};
  };
  const std::size_t most = std::min<std::size_t>(particles.size(), SortPass::kMaxCount);
  const auto run = static_cast<std::size_t>(
      partThatFits(device, most, kLeastPart, sizes, device.stagingCost(), "the particles to sort"));
  const Buffer points = device.createBuffer(sizes(run)[0]), pairs = device.createBuffer(sizes(run)[1]);
  const DepthKeyPass keys(device);
  const SortPass sort(device);
  TimestampQueries queries = device.createTimestampQueries(1);
  std::vector<std::uint64_t> all(particles.size());
  std::vector<std::size_t> start;
  for (std::size_t first = 0; first < all.size(); first += run) {
    const auto count = static_cast<std::uint32_t>(std::min(run, all.size() - first));
    device.upload(points, particles.subspan(first, count));
    queries.reset();
    device.run([&](CommandBuffer& commands) {
      const std::uint32_t span = queries.begin(commands, "sort");
      keys.record(commands, points, count, camera.position, keyScale, pairs, viewAxis(camera));
      sort.record(commands, pairs, count);
      queries.end(commands, span);
    });
    deviceSeconds += queries.results().at(0).seconds;
    device.downloadBytes(pairs, 0, &all[first], count * sizeof(std::uint64_t));
    // The device counts from the run's first; within a run that orders equal keys alike.
    parallelBlocks(count, 1 << 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) all[first + i] += first;
    });
    start.push_back(first);
  }
  logVerbose(fmt::format("depth order: {} runs of at most {} particles", start.size(), run));
  start.push_back(all.size());
  return mergeRuns(all, start);
}

}  // namespace mote
