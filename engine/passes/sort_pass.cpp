#include "engine/passes/sort_pass.h"

#include <algorithm>

#include "shaders/glsl/layout/sort.h"
#include "spirv.h"

namespace mote {
namespace {

constexpr std::uint32_t kGroupSize = 64;  // no shared memory, so it need only fill a subgroup

// More pairs an invocation mean fewer dispatches but more registers. lavapipe, 2²⁰ pairs, CPU seconds over all threads,
// and those of compiling: 8 pairs 0.26, 0.06; 16 pairs 0.213, 0.08; 32 pairs 0.218, 0.16. Graphics processors have
// registers for 16 (32 words) without losing occupancy.
constexpr std::uint32_t kLog2Elements = 4;

std::uint64_t groups(std::uint64_t invocations) { return (invocations + kGroupSize - 1) / kGroupSize; }

}  // namespace

SortPass::SortPass(const Device& device, std::uint32_t log2Elements)
    : log2Elements_(log2Elements > 0 ? log2Elements : kLog2Elements) {
  MOTE_CHECK(log2Elements_, <=, 5u);
  for (std::uint32_t work : {layout::kSortBlocks, layout::kSortFlip, layout::kSortDisperse})
    merge_[work] = device.createComputePipeline(
        spirv::bitonic_merge_comp, sizeof(layout::SortParams),
        std::array{SpecializationConstant{0, kGroupSize}, SpecializationConstant{1, log2Elements_},
                   SpecializationConstant{2, work}});
  extract_ = device.createComputePipeline(spirv::bitonic_extract_comp, sizeof(layout::SortParams),
                                          std::array{SpecializationConstant{0, kGroupSize}});
}

void SortPass::record(CommandBuffer& commands, const Buffer& pairs, std::uint32_t count) const {
  MOTE_CHECK(count, <=, kMaxCount);
  MOTE_CHECK(pairs.size(), >=, pairBytes(count));
  commands.barrier(barrier::workToWork);
  if (count < 2) return;
  commands.fill(pairs, ~0u, count * std::uint64_t{sizeof(layout::SortPair)}, sizeof(layout::SortPair));
  commands.barrier(barrier::transferToCompute);

  layout::SortParams params{pairs.address(), 0, count, 0};
  const std::uint32_t m = log2Elements_;
  const auto pass = [&](std::uint32_t work, std::uint32_t log2Stride) {
    const std::uint32_t log2Block = log2Stride + m;
    const std::uint64_t blocks = (std::uint64_t{count} + (1ull << log2Block) - 1) >> log2Block;
    params.log2Stride = log2Stride;
    commands.dispatchRow(merge_[work], params, groups(blocks << log2Stride));
  };
  pass(layout::kSortBlocks, 0);
  for (std::uint32_t stage = m + 1; count > 1ull << (stage - 1); ++stage) {
    commands.barrier(barrier::computeToCompute);
    pass(layout::kSortFlip, stage - m);
    for (std::uint32_t left = stage - m; left > 0;) {
      // The last pass may repeat steps that are done: where a step has been, it finds nothing to swap.
      left -= std::min(left, m);
      commands.barrier(barrier::computeToCompute);
      pass(layout::kSortDisperse, left);
    }
  }
}

void SortPass::recordExtract(CommandBuffer& commands, const Buffer& pairs, std::uint32_t count,
                             const Buffer& indices) const {
  MOTE_CHECK(indices.size(), >=, count * std::uint64_t{4});
  commands.barrier(barrier::computeToCompute);
  commands.dispatchRow(extract_, layout::SortParams{pairs.address(), indices.address(), count, 0}, groups(count));
}

}  // namespace mote
