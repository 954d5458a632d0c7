// mote bench sort: (key, index) pairs of random keys on TBB and on the device.
#include <tbb/parallel_sort.h>

#include <algorithm>

#include "engine/passes/sort_pass.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "shaders/glsl/layout/sort.h"
#include "tools/bench/bench.h"

namespace mote {
namespace {

constexpr double kMostRatio = 10;

std::uint64_t asNumber(const layout::SortPair& pair) { return std::uint64_t{pair.key} << 32 | pair.index; }

std::vector<layout::SortPair> randomPairs(std::uint64_t count) {
  std::vector<layout::SortPair> pairs(count);
  parallelBlocks(pairs.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      pairs[i] = {.index = static_cast<layout::uint>(i), .key = static_cast<layout::uint>(hashBits(0, i) >> 32)};
  });
  return pairs;
}

BenchCheck sameOrder(const std::vector<std::uint64_t>& host, const std::vector<layout::SortPair>& device) {
  if (!std::is_sorted(host.begin(), host.end())) return {"tbb::parallel_sort leaves numbers unsorted", false};
  for (std::size_t i = 0; i < device.size(); ++i)
    if (asNumber(device[i]) != host[i])
      return {fmt::format("the device's pair {} is another than the host's", i), false};
  return {device.empty() ? "sorted on the host" : "both in the same order", true};
}

}  // namespace

void benchSort(Bench& bench) {
  const auto count = static_cast<std::uint32_t>(bench.count());
  const std::vector<layout::SortPair> pairs = randomPairs(count);

  std::vector<std::uint64_t> numbers;
  const Contender onTbb{.name = "tbb::parallel_sort of 64-bit numbers",
                        .work = [&] { tbb::parallel_sort(numbers.begin(), numbers.end()); },
                        .prepare =
                            [&] {
                              numbers.resize(pairs.size());
                              std::transform(pairs.begin(), pairs.end(), numbers.begin(), asNumber);
                            }};
  const Device* device = bench.device();
  if (!device) {
    bench.compare("sort", "pairs", onTbb, std::nullopt, [&] { return sameOrder(numbers, {}); });
    return;
  }
  const SortPass pass(*device);
  const Buffer buffer = device->createBuffer(SortPass::pairBytes(count));
  const Contender onDevice{
      .name = "bitonic sort on the device",
      .work = [&] { device->run([&](CommandBuffer& commands) { pass.record(commands, buffer, count); }); },
      .prepare = [&] { device->upload(buffer, std::span(pairs)); }};
  const Comparison* times = bench.compare("sort", "pairs", onTbb, onDevice, [&] {
    return sameOrder(numbers, device->download<layout::SortPair>(buffer, count));
  });
  if (times) bench.addFloor({"bitonic sort / tbb::parallel_sort", median(times->ratios()), kMostRatio});
}

}  // namespace mote
