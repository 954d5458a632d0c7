// A tile of a light grid in parts, for devices that cannot hold it at once.
//
// All goes by depth: of each group of bins first the strands' blocks, then the receivers that lie in it. A part is as
// much of that row as there is room for. What a block stores stays where it is, in one array for all parts, until the
// receivers that look at it are through and the strand's next block is put on it: never more than one block a strand
// beside the part's own. So every sum is made in the order in which the whole tile makes it, and has the same bits.
// The least that cannot be cut are the particles of one work.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/passes/grid_blocks.h"

namespace mote {

class GridParts {
 public:
  /// `tile` must outlive this. Takes 16 bytes a block, and 4 a particle and receiver; time n log n.
  explicit GridParts(const GridArrays& tile);

  /// Room that will do for every part.
  const GridCounts& least() const { return least_; }
  /// Begins with the first part, in room for `most` of everything, at least `least`. Parts are of one `channel`.
  void start(const GridCounts& most, std::size_t channel);
  /// Sets `to` to the next part; false: none is left. Its own channel is its first, and its stored blocks are numbered
  /// for an array of most.stored that keeps what the parts before left in it.
  bool next(GridArrays& to);
  /// Which of the tile's receivers the part has, in its order.
  std::span<const std::uint32_t> receivers() const { return receivers_; }

 private:
  static constexpr std::size_t kColumns = std::size_t{layout::kTileBlocks} * layout::kTileBlocks;

  /// Work number `first` of a strand, or where `strand` is kReads the receivers order_[first … end).
  struct Step {
    std::uint32_t group, strand, first, end;
  };
  /// What a part has of a strand: works, and the stored block that it had come to: 0 none.
  struct Chosen {
    std::uint32_t before = 0;
    std::vector<std::uint32_t> works;
  };
  static constexpr std::uint32_t kReads = ~0u;

  void setSteps();
  void setLeast();
  /// Puts a step into the part; false: it does not fit.
  bool add(const Step& step);
  bool addWork(const Step& step);
  bool addReceivers(const Step& step);
  void putKernels(GridArrays& to) const;
  void putStrand(const Chosen& chosen, GridArrays& to) const;
  void putReceivers(GridArrays& to) const;

  const GridArrays& tile_;
  std::vector<std::uint32_t> order_;  // receivers by group
  std::vector<Step> steps_;
  GridCounts least_, most_;
  std::size_t channel_ = 0;

  std::size_t next_ = 0;               // step
  std::vector<std::uint32_t> last_;    // stored block that a strand has come to, by the tile's number
  std::vector<std::uint32_t> slotOf_;  // of stored blocks, by the tile's number
  std::vector<std::uint32_t> free_;    // slots
  // Of the part:
  GridCounts has_;
  std::vector<Chosen> chosen_;                     // by strand
  std::vector<std::uint32_t> kernels_, localOf_;   // the tile's numbers, and back
  std::vector<std::uint32_t> groups_, receivers_;  // that are read, both by group
  std::vector<std::uint32_t> over_;                // slots that are free once the part is through
};

}  // namespace mote
