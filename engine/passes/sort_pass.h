// Bitonic sort of (key, index) pairs on the device.
#pragma once
#include <array>
#include <cstdint>

#include "engine/vulkan/device.h"

namespace mote {

/// Sorts any number of layout::SortPair in place, ascending as 64-bit numbers: equal keys stand in index order, as
/// after std::stable_sort. O(N log² N) comparisons in Σ ⌈s / m⌉ dispatches for s = m+1 … ⌈log2 N⌉ (57 for 2²⁰ pairs and
/// m = 4), each of which reads and writes every pair once.
class SortPass {
 public:
  /// Most pairs that one sort takes.
  static constexpr std::uint32_t kMaxCount = 1u << 30;

  /// 2^log2Elements pairs an invocation (1–5), or 0 for the fastest, 4.
  explicit SortPass(const Device& device, std::uint32_t log2Elements = 0);

  /// Bytes of the pair buffer: one more pair than `count`, which stands for everything beyond the end.
  static std::uint64_t pairBytes(std::uint32_t count) { return (std::uint64_t{count} + 1) * 8; }

  /// Sorts the first `count` pairs of `pairs` (≥ pairBytes(count)). Orders itself after compute and copies recorded
  /// before; what reads the result needs a barrier from compute.
  void record(CommandBuffer& commands, const Buffer& pairs, std::uint32_t count) const;

  /// Writes the indices of sorted pairs to `indices` (count × uint32), ready as an index buffer. Orders itself after
  /// compute; what reads the result needs a barrier from compute (barrier::computeToIndexAndVertexInput).
  void recordExtract(CommandBuffer& commands, const Buffer& pairs, std::uint32_t count, const Buffer& indices) const;

 private:
  std::uint32_t log2Elements_;
  std::array<ComputePipeline, 3> merge_;  // by layout::kSort…
  ComputePipeline extract_;
};

}  // namespace mote
