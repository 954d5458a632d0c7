// A tile of a light grid as the device takes it: particles by blocks of nodes and bins (shaders/glsl/layout/grid.h).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/lighting/grid/tile.h"
#include "shaders/glsl/layout/grid.h"

namespace mote {

/// What kernels of a tile are; a tile with several kinds has all their bits.
enum GridKernelKinds : std::uint32_t { kTentKernels = 1, kEllipseKernels = 2, kCurvedKernels = 4, kSeveralRadii = 8 };

/// Particles that a lane sums up: where more meet in a block, several do, and their sums are added up one after the
/// other, however much a device may hold, so that a small budget can have the same bits.
constexpr std::uint32_t kMostWorkEntries = 1 << 11;
/// A work's entries begin where shaders load; so many are kept for `count`, the last of which may be there again.
constexpr std::uint32_t roomForEntries(std::uint32_t count) {
  return (count + layout::kEntriesAtOnce - 1) / layout::kEntriesAtOnce * layout::kEntriesAtOnce;
}
/// Of a GridReceiver: of one group.
constexpr std::uint32_t kGroupPlaces = layout::kTileBlocks * layout::kTileBlocks * layout::kBlockBins;

/// How many of each a tile has, or a part of one.
struct GridCounts {
  std::uint64_t kernels = 0, entries = 0, works = 0, strands = 0, table = 0, receivers = 0;
  std::uint64_t stored = 0;  ///< blocks, without the one of zeros

  bool within(const GridCounts& most) const {
    return kernels <= most.kernels && entries <= most.entries && works <= most.works && strands <= most.strands &&
           table <= most.table && receivers <= most.receivers && stored <= most.stored;
  }
};

/// Everything that dispatches read, of one tile.
struct GridArrays {
  std::vector<layout::GridKernel> kernels;
  std::vector<float> peaks[3];  ///< of the kernels, where there are three channels
  std::vector<std::uint32_t> entries;
  std::vector<layout::GridWork> works;  ///< strand by strand, by depth
  std::vector<std::uint32_t> blocks;    ///< that each is of
  std::vector<layout::GridStrand> strands;
  std::vector<layout::GridPlaces> table;
  std::vector<layout::GridReceiver> receivers;
  std::vector<float> own[3];       ///< of the receivers: what each finds of its own particle
  std::uint32_t storedBlocks = 0;  ///< without the one of zeros
  std::uint32_t kinds = 0;         ///< of the kernels that have entries
  bool begun = false;              ///< a work may go on with a block that another one has begun

  GridCounts counts() const;
};

/// Makes the arrays of a tile; holds on to its memory from tile to tile. Linear in particles and in the blocks that
/// they touch.
class GridBlocks {
 public:
  /// `tile` is set up, and is weighed here; `members` are its receivers, `slots` its particles.
  void setUp(GridTile& tile, const Receivers& receivers, std::span<const std::uint32_t> members,
             std::span<const std::uint32_t> slots, GridArrays& to);

 private:
  /// Blocks of a particle's kernel; those that the tile has not are no part of it.
  struct Place {
    std::uint32_t first = 0;   ///< with its group, as in start_
    std::uint16_t groups = 0;  ///< 0: none
    std::uint8_t columns = 0, rows = 0;
  };
  void setKernels(GridTile& tile, GridArrays& to);
  CoveredNodes setLone(GridTile& tile, std::size_t i, layout::GridKernel& kernel) const;
  template <class Add>
  static void forEachBlock(const Place& place, std::uint32_t groups, const Add& add);
  void sortEntries(GridArrays& to);
  void setWorks(const GridTile& tile, GridArrays& to) const;

  std::size_t groups_ = 0;
  float inverseRadius_ = 0;            // of all kernels, unless they are kSeveralRadii
  std::vector<std::uint32_t> blocks_;  // of the tile's particles (CoveredBlocks)
  std::vector<Place> places_;          // of the tile's particles
  std::vector<std::uint32_t> start_;   // [block][group]: of entries
};

}  // namespace mote
