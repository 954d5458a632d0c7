// The nodes of a light grid that goes by patches (patches.h).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/core/raw_vector.h"
#include "host/lighting/grid/patches.h"
#include "host/lighting/grid/tile.h"

namespace mote {

/// All nodes that have something to read, each with the bins that anything lies in.
struct GridField {
  /// A rectangle of nodes; that at column, row of the face is nodeAt[firstNode + (row − firstRow) · columns + column −
  /// firstColumn].
  struct Face {
    double firstColumn = 0, firstRow = 0;
    double firstBin = 0;
    int bins = 0;
    int columns = 0, rows = 0;
    std::size_t firstNode = 0;
  };
  std::vector<Face> faces;
  /// Where the face's first bin would be in `values`, or GridTile::kNoNode. What lies before a node's bins is 0.
  std::vector<std::int32_t> nodeAt;
  RawVector<float> values[3];  ///< of each channel

  /// The nodes that patches have; no values yet. `fits`: they take at most `mostFloats` a channel, and 32-bit numbers
  /// are enough.
  GridField(std::span<const GridPatch> patches, std::size_t faceCount, std::size_t mostFloats);
  bool fits = false;

  /// Makes the values, all 0.
  void allot(std::size_t channels);
  /// Lets a tile that is set up for a patch have the field's nodes; other patches' threads must leave them alone.
  void lend(const GridPatch& patch, GridTile& to);
  /// Every node's bins become the sums up to each bin's end.
  void sum();

 private:
  struct Run {
    std::int32_t begin, bins;
  };
  std::vector<Run> runs_;
  std::size_t floats_ = 0;
};

/// A particle that goes alone (tile.h) on a face; on another it may go by batches.
struct Loner {
  std::size_t face;
  std::uint32_t slot;
};

/// Patches that have no node in common, each loner in all that have nodes of it.
std::vector<GridPatch> patchesOfLoners(const GridField& field, const Octree& tree, const GridShape& shape,
                                       std::span<const Loner> loners);

/// Optical depths at points placed on a patch, [channel][point], from a field that is summed; the same bits on every
/// instruction set.
void readField(const GridField& field, const GridPatch& patch, const GridPoints& points, std::size_t channels,
               std::vector<float>& depths);

}  // namespace mote
