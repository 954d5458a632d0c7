// The light grid in compute shaders: mote::gridOpticalDepths (host/lighting/grid/light_grid.h) on the device.
//
// The host plans the tiles, places particles and receivers, in double, weighs the kernels in the same step, and sorts
// each tile's particles by the blocks of 4 × 4 nodes and 4 bins that their kernels touch (grid_blocks.h). The device
// puts them down (grid_fill.comp, a lane a block), sums along the depth (grid_sum.comp) and reads what the receivers
// find (grid_read.comp). Blocks that no particle touches are not stored. The dispatches are what grows with a finer
// grid. Sums of weights are left to the host, as it has the kernels in its vectors anyhow: on lavapipe a shader of its
// own took four times as long, mostly to load them.
//
// This suits hardware: a kernel is loaded once for 64 multiply-adds on sums in registers; lanes tell each other
// nothing, neighbours have about as many particles, tens of thousands of lanes are under way at once; there is no
// atomic, shared memory or barrier of a workgroup, so sums are always in the same order, on subgroups of any size. On
// an H100 it is the host's share that takes the time (docs/performance.md).
#pragma once
#include <tbb/enumerable_thread_specific.h>

#include <vector>

#include "engine/passes/grid_device.h"
#include "host/lighting/grid/light_grid.h"

namespace mote {

class LightGridPass {
 public:
  /// `device` must outlive the pass.
  explicit LightGridPass(const Device& device) : device_(device), grid_(device) {}

  /// As mote::gridOpticalDepths, T within 2e-5 of it; the same bits each time, whatever the device's budget (tested on
  /// lavapipe; a driver may contract the pipelines of parts otherwise). Tiles go through the device in batches of about
  /// 64 MiB, or what the budget leaves of it. Each takes there 32 bytes a particle (44 with three channels), 4 for each
  /// block that it touches, 20 a receiver (28), and 808 a block that is touched. A tile that does not fit goes in parts
  /// (grid_parts.h), one channel after the other; throws MachineError where not even the least fits, which is 0.2 MiB
  /// at most. The host holds about the same as the device, without what is stored, of a million particles and receivers
  /// at a time, or of one tile. On lavapipe 3 times the CPU time of gridOpticalDepths (docs/performance.md).
  std::vector<float> opticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                   const LightingOptions& options, const GridResolution& resolution,
                                   std::span<const std::uint8_t> reached = {}, const RaysDone& done = {});

  /// Device seconds of all opticalDepths calls so far, from timestamps.
  double deviceSeconds() const { return grid_.seconds(); }
  /// Gives back what the last opticalDepths needed, to the device's budget and the host; the next takes it again.
  void release();

 private:
  /// A tile that is set up.
  struct Work {
    const GridPlan::Tile* planned = nullptr;
    GridArrays arrays;
  };
  /// Of each thread: hundreds of bytes for each particle of a tile.
  struct Workspace {
    GridTile tile;
    GridBlocks blocks;
    std::vector<float> read;
  };
  struct Call;

  /// Sets up tiles of the plan from number `begin` on: as many as keep all threads busy.
  std::span<const Work> setUpTiles(const Call& call, std::size_t begin);
  /// Depths that `run` found to the receivers they belong to, with what particles near the light add.
  void keep(Call& call, std::span<const Work> works, std::span<const float> found);

  const Device& device_;
  GridDevice grid_;
  std::vector<Work> works_;  // of tiles that are set up together; their memory serves the next ones
  tbb::enumerable_thread_specific<Workspace> workspaces_;
};

}  // namespace mote
