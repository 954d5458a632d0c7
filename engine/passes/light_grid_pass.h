// The light grid in compute shaders: mote::gridOpticalDepths (host/lighting/light_grid.h) on the device.
//
// The host plans the tiles and places particles and receivers, in double, and sorts each tile's particles by the blocks
// of 4 × 4 nodes and 4 bins that their kernels touch (grid_blocks.h). Then the device weighs each particle
// (grid_weigh.comp), puts all down and sums along the depth (grid_fill.comp, a subgroup for all blocks over the same
// nodes), and reads what the receivers find (grid_read.comp). Blocks that no particle touches are not stored. Kernels
// wider than eight nodes, or near a point light, are weighed by the host, one by one, as gridOpticalDepths does it.
//
// This suits hardware: a particle is loaded once for 64 multiply-adds on sums in registers, kernels go by lanes and
// strands by subgroups, thousands of them at once; stores are side by side; there is no atomic, shared memory or
// barrier of a workgroup, so sums are always in the same order. (So it should; it was measured on lavapipe alone.)
#pragma once
#include <array>
#include <map>
#include <vector>

#include "engine/passes/grid_blocks.h"
#include "engine/vulkan/device.h"
#include "host/lighting/light_grid.h"

namespace mote {

class LightGridPass {
 public:
  /// `device` must outlive the pass.
  explicit LightGridPass(const Device& device);

  /// As mote::gridOpticalDepths, T within 2e-5 of it; the same bits each time on the same device. Tiles go through the
  /// device in batches of about 64 MiB, or what the budget leaves of it, but one at least: throws MachineError where a
  /// tile does not fit. On the host about 300 bytes a particle of a batch.
  std::vector<float> opticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                   const LightingOptions& options, const GridResolution& resolution,
                                   std::span<const std::uint8_t> reached = {}, const RaysDone& done = {});

  /// Device seconds of all opticalDepths calls so far, from timestamps.
  double deviceSeconds() const { return deviceSeconds_; }
  /// Gives back to the device's budget, and to the host, what the last opticalDepths needed; the next takes it again.
  void release() { buffers_ = {}, works_ = {}; }

 private:
  struct FillVariant {
    layout::uint falloff;
    std::uint32_t kinds;
    bool goesOn, colours;
    auto operator<=>(const FillVariant&) const = default;
  };
  struct Buffers {
    Buffer kernels, peaks, entries, blocks, strands, stored, table, receivers, depths;
    auto all() {
      return std::array{&kernels, &peaks, &entries, &blocks, &strands, &stored, &table, &receivers, &depths};
    }
  };
  /// Bytes of each, in that order.
  using Sizes = std::array<std::uint64_t, 9>;
  /// A tile that is set up.
  struct Work {
    const GridPlan::Tile* planned;
    GridBlocks blocks;
  };

  const ComputePipeline& fill(const FillVariant& variant);
  /// The block of zeros.
  static constexpr Sizes kNoTiles{0, 0, 0, 0, 0, layout::kBlockPairs * sizeof(layout::GridPair), 0, 0, 0};
  static Sizes sizesOf(const GridArrays& arrays, std::size_t channels);
  static Sizes sum(const Sizes& a, const Sizes& b);
  bool fits(const Sizes& sizes) const;
  void makeRoom(const Sizes& sizes);
  /// Optical depths of all receivers, [channel][receiver].
  std::vector<float> run(std::span<const GridArrays* const> tiles, std::size_t channels, layout::uint falloff,
                         double cell);

  const Device& device_;
  TimestampQueries queries_;
  std::uint32_t groupSize_, storeLanes_;
  std::map<FillVariant, ComputePipeline> fills_;
  ComputePipeline read_;
  Buffers buffers_;
  std::vector<Work> works_;
  double deviceSeconds_ = 0;
};

}  // namespace mote
