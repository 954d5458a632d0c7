// Patches of a light grid (light_grid.h): the nodes that a run of neighbouring slots touches.
//
// Slots stand in Morton order, so a few thousand of them lie in a small box, and all that they put down fits in a
// processor's own cache: nothing is sorted, and particles are read from memory one after the other.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "host/lighting/grid/plan.h"

namespace mote {

struct GridPatch {
  std::size_t face = 0;
  std::uint32_t begin = 0, end = 0;  ///< its slots
  /// Those of them that have nodes on the face, where it has not all, and which of these stand on it (0 or 1).
  std::vector<std::uint32_t> some;
  std::vector<std::uint8_t> stands;

  double firstColumn = 0, firstRow = 0;  ///< of the first cell that a particle stands in; whole
  int columns = 0, rows = 0;             ///< cells
  int margin = 0;                        ///< nodes beyond these that kernels reach, on each side
  double firstBin = 0;                   ///< a whole multiple of kGroupBins
  int bins = 0;                          ///< as well
  /// All kernels, those too that do not go by batches (tile.h): nodes on the face that they lie between, and bins,
  /// whole multiples of kGroupBins.
  NodeRange nodes{};
  double nearestBin = 0, deepestBin = 0;

  std::size_t count() const { return some.empty() ? end - begin : some.size(); }
  std::size_t slot(std::size_t i) const { return some.empty() ? begin + i : some[i]; }
  bool standsOnFace(std::size_t i) const { return some.empty() || stands[i] != 0; }
  /// The nodes that its batches may touch.
  NodeRange footprint() const {
    const dvec2 first(firstColumn - margin, firstRow - margin);
    return {first, first + dvec2(columns + 2 * margin, rows + 2 * margin)};
  }
};

/// Patches of all slots, in their order. They are at most so many nodes wide, in either direction, and so many bins
/// deep: a fraction of the cloud, so that there are always some that have nothing in common.
struct PatchPlan {
  std::vector<GridPatch> patches;
  int mostNodes = 0, mostBins = 0;
};

/// Follows from the arguments alone. None if some particle has no radius, or is so near to a point light that it is in
/// no grid (GridPlan::nearLight), or if particles stand so far apart that most had a patch of their own. Takes some 15
/// bytes a particle at most.
std::optional<PatchPlan> planPatches(const Octree& tree, const GridShape& shape);

}  // namespace mote
