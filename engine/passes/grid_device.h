// Tiles of a light grid on the device: buffers, pipelines and dispatches (light_grid_pass.h says what for).
#pragma once
#include <array>
#include <map>
#include <span>
#include <vector>

#include "engine/passes/grid_join.h"
#include "engine/vulkan/device.h"

namespace mote {

class GridDevice {
 public:
  /// How a submission goes through its tiles.
  struct Manner {
    layout::uint falloff;
    bool colours;  ///< peaks stand apart from the kernels
    std::size_t channels;
    double cell;  ///< of point lights; else 0
  };

  /// `device` must outlive this.
  explicit GridDevice(const Device& device);

  /// How many of the tiles, from the first on, go through the device together: those that fill 64 MiB, or what the
  /// budget leaves of it. 0: not even the first fits.
  std::size_t batchThatFits(std::span<const GridArrays* const> tiles, const Manner& manner);
  /// Optical depths of all their receivers, [channel][receiver]. Throws MachineError where they do not fit.
  std::vector<float> run(std::span<const GridArrays* const> tiles, const Manner& manner);
  /// The same bits of one tile, in parts (grid_parts.h). Throws MachineError where not even the least would fit.
  std::vector<float> runInParts(const GridArrays& tile, const Manner& manner);

  /// Device seconds so far, from timestamps.
  double seconds() const { return seconds_; }
  /// Gives all buffers back to the budget.
  void release();

 private:
  struct FillVariant {
    layout::uint falloff;
    std::uint32_t kinds;
    bool colours;
    auto operator<=>(const FillVariant&) const = default;
  };
  enum Array : std::size_t {
    kKernels,
    kPeaks,
    kEntries,
    kWorks,
    kSums,
    kBlocks,
    kStrands,
    kStored,
    kTable,
    kReceivers,
    kDepths,
    kArrays
  };
  struct Buffers {
    Buffer kernels, peaks, entries, works, sums, blocks, strands, stored, table, receivers, depths;
    std::array<Buffer*, kArrays> all() {
      return {&kernels, &peaks, &entries, &works, &sums, &blocks, &strands, &stored, &table, &receivers, &depths};
    }
  };
  /// Bytes of each Array.
  using Sizes = std::array<std::uint64_t, kArrays>;
  const ComputePipeline& fill(const FillVariant& variant);
  static Sizes sizesOf(const GridCounts& counts, const Manner& manner);
  /// Of no tile: the block of zeros.
  static Sizes noTiles();
  static Sizes sum(const Sizes& a, const Sizes& b);
  bool fits(const Sizes& sizes);
  /// Whether texel views can be as long as what is read through them.
  bool texelsFit(const Sizes& sizes) const;
  void makeRoom(const Sizes& sizes);
  /// The steps of `run`: arrays to the device, what all dispatches are told, and one channel's nodes.
  std::vector<GridWorks> upload(std::span<const GridArrays* const> tiles, const Sizes& sizes, std::size_t channels);
  layout::GridParams params(double cell) const;
  void fillNodes(CommandBuffer& commands, std::span<const GridWorks> all, layout::GridParams params,
                 const Manner& manner);

  const Device& device_;
  TimestampQueries queries_;
  std::uint32_t readGroupSize_;  // a workgroup costs lavapipe an allocation, some 50 ns
  std::uint32_t groupSize_;      // of the others, whose lanes do much more: what balances its threads best
  std::map<FillVariant, ComputePipeline> fills_;
  std::array<ComputePipeline, 2> sums_;  // the second where blocks may have been begun
  ComputePipeline read_;
  Buffers buffers_;
  // Of buffers_, so they go before them.
  TexelView kernelTexels_, entryTexels_, sumTexels_, storedTexels_, tableTexels_, receiverTexels_;
  double seconds_ = 0;
};

}  // namespace mote
