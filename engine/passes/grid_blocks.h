// A tile of a light grid as the device takes it: particles by blocks of nodes and bins (shaders/glsl/layout/grid.h).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/lighting/grid/tile.h"
#include "shaders/glsl/layout/grid.h"

namespace mote {

/// What kernels of a strand are; a strand with several kinds has all their bits.
enum GridKernelKinds : std::uint32_t { kTentKernels = 1, kEllipseKernels = 2, kCurvedKernels = 4 };

/// Particles of a block that are summed at once: where there are more, their sums are added up part by part, however
/// much a device may hold, so that a small budget can have the same bits. So many are far more than usual, and 1 MiB.
constexpr std::uint32_t kMostBlockEntries = 1 << 15;
/// Of a GridReceiver: of one group.
constexpr std::uint32_t kGroupPlaces = layout::kTileBlocks * layout::kTileBlocks * layout::kBlockBins;

/// How many of each a tile has, or a part of one.
struct GridCounts {
  std::uint64_t kernels = 0, entries = 0, blocks = 0, strands = 0, table = 0, receivers = 0;
  std::uint64_t stored = 0;  ///< blocks, without the one of zeros

  bool within(const GridCounts& most) const {
    return kernels <= most.kernels && entries <= most.entries && blocks <= most.blocks && strands <= most.strands &&
           table <= most.table && receivers <= most.receivers && stored <= most.stored;
  }
};

/// Everything that dispatches read, of one tile.
struct GridArrays {
  /// Pieces of strands, which go through the device together.
  struct Pieces {
    struct Key {
      std::uint32_t round = 0;  ///< after those of earlier rounds
      std::uint32_t kinds = 0;
      bool goesOn = false;  ///< the first block of each has sums already
      auto operator<=>(const Key&) const = default;
    };
    Key key;
    std::vector<layout::GridStrand> strands;
  };

  std::vector<layout::GridKernel> kernels;
  std::vector<float> peaks[3];  ///< of the kernels, where there are three channels
  std::vector<std::uint32_t> entries;
  std::vector<layout::GridBlock> blocks;
  std::vector<Pieces> pieces;  ///< in the order of their keys
  std::vector<layout::GridEntryPair> table;
  std::vector<layout::GridReceiver> receivers;
  std::vector<float> own[3];       ///< of the receivers: what each finds of its own particle
  std::uint32_t storedBlocks = 0;  ///< without the one of zeros

  GridCounts counts() const;
};
/// Those with this key, put into their place if there were none.
GridArrays::Pieces& piecesOf(std::vector<GridArrays::Pieces>& all, const GridArrays::Pieces::Key& key);

/// Makes the arrays of a tile; holds on to its memory from tile to tile. A piece of a strand has as many steps as a
/// shader may take, `mostSteps`: one a block, and one for each `lanes` of its particles; and of a block at most
/// kMostBlockEntries. Linear in particles and in the blocks that they touch.
class GridBlocks {
 public:
  /// `tile` is set up, and is weighed here; `members` are its receivers, `slots` its particles.
  void setUp(GridTile& tile, const Receivers& receivers, std::span<const std::uint32_t> members,
             std::span<const std::uint32_t> slots, std::uint32_t lanes, std::uint32_t mostSteps, GridArrays& to);

 private:
  struct Entry {
    std::uint32_t block, kernel;  // block: with its group, as in start_
  };
  void setKernels(GridTile& tile, GridArrays& to);
  void sortEntries(GridArrays& to);
  void setBlocks(const GridTile& tile, std::uint32_t lanes, std::uint32_t mostSteps, GridArrays& to) const;

  std::size_t groups_ = 0;
  std::vector<float> scale_;          // of the tile's particles
  std::vector<Entry> found_;          // particle by particle
  std::vector<std::uint32_t> start_;  // [block][group]: of entries
  std::vector<std::uint32_t> kinds_;  // [block]
};

/// Where the arrays of several tiles go, one behind the other; the device's own memory, perhaps.
struct GridTargets {
  std::span<layout::GridKernel> kernels;
  std::span<float> peaks;  ///< [channel][kernel]; none where there is one channel
  std::span<std::uint32_t> entries;
  std::span<layout::GridBlock> blocks;
  std::span<layout::GridEntryPair> table;
  std::span<layout::GridReceiver> receivers;
  std::span<float> own;  ///< [channel][receiver]
};
/// Puts the arrays of tiles behind one another, numbers set right. Spans are as long as the tiles' arrays together.
void join(std::span<const GridArrays* const> tiles, std::size_t channels, const GridTargets& to);
/// … and the pieces of their strands.
std::vector<GridArrays::Pieces> joinPieces(std::span<const GridArrays* const> tiles);

}  // namespace mote
