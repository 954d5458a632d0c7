#include "host/lighting/grid/field.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "host/core/parallel.h"

namespace mote {
namespace {

/// So many nodes a side have the same bins.
constexpr int kBrickNodes = 8;
/// Of patches of loners, along an edge.
constexpr int kLonerNodes = 64;
/// A face's rectangle has at most so many nodes, and as many for each patch.
constexpr double kMostNodes = 1 << 22, kNodesOfPatch = 1024;

/// Of nodes, inclusive, within a face's rectangle.
struct NodeBox {
  int left, right, top, bottom;
  NodeBox(const NodeRange& nodes, const GridField::Face& face)
      : left(static_cast<int>(std::max(nodes.lo.x - face.firstColumn, 0.0))),
        right(static_cast<int>(std::min(nodes.hi.x - face.firstColumn, face.columns - 1.0))),
        top(static_cast<int>(std::max(nodes.lo.y - face.firstRow, 0.0))),
        bottom(static_cast<int>(std::min(nodes.hi.y - face.firstRow, face.rows - 1.0))) {}
};

/// Bins of the bricks of a face.
class Bricks {
 public:
  struct Bins {
    double first = INFINITY, end = -INFINITY;
  };

  explicit Bricks(const GridField::Face& face)
      : face_(face),
        columns_((face.columns + kBrickNodes - 1) / kBrickNodes),
        bins_(static_cast<std::size_t>(columns_ * ((face.rows + kBrickNodes - 1) / kBrickNodes))) {}

  /// Where patches have nodes; afterwards also what passes over these.
  void add(const NodeRange& nodes, double first, double end, bool anew) {
    const NodeBox box(nodes, face_);
    for (int row = box.top / kBrickNodes; row <= box.bottom / kBrickNodes && box.top <= box.bottom; ++row)
      for (int column = box.left / kBrickNodes; column <= box.right / kBrickNodes && box.left <= box.right; ++column) {
        Bins& bins = bins_[static_cast<std::size_t>(row * columns_ + column)];
        if (!anew && bins.end < bins.first) continue;
        bins.first = std::min(bins.first, first), bins.end = std::max(bins.end, end);
      }
  }
  const Bins& of(int row, int column) const {
    return bins_[static_cast<std::size_t>(row / kBrickNodes * columns_ + column / kBrickNodes)];
  }

 private:
  const GridField::Face& face_;
  int columns_;
  std::vector<Bins> bins_;
};

}  // namespace

GridField::GridField(std::span<const GridPatch> patches, std::size_t faceCount, std::size_t mostFloats)
    : faces(faceCount) {
  std::vector<NodeRange> ranges(faceCount, {dvec2(INFINITY), dvec2(-INFINITY)});
  std::vector<double> count(faceCount, 0);
  for (Face& face : faces) face.firstBin = INFINITY;
  for (const GridPatch& patch : patches) {
    const NodeRange own = patch.footprint();
    NodeRange& range = ranges[patch.face];
    range.lo = min(range.lo, own.lo), range.hi = max(range.hi, own.hi);
    faces[patch.face].firstBin = std::min(faces[patch.face].firstBin, patch.nearestBin);
    ++count[patch.face];
  }
  const double most = std::min<double>(static_cast<double>(mostFloats), std::numeric_limits<std::int32_t>::max() / 2);
  for (std::size_t f = 0; f < faceCount; ++f) {
    if (count[f] == 0) continue;
    Face& face = faces[f];
    const dvec2 size = ranges[f].hi - ranges[f].lo + 1.0;
    if (!(size.x * size.y <= kMostNodes + kNodesOfPatch * count[f])) return;
    face.firstColumn = ranges[f].lo.x, face.firstRow = ranges[f].lo.y;
    face.columns = static_cast<int>(size.x), face.rows = static_cast<int>(size.y);
    face.firstNode = nodeAt.size();
    Bricks bricks(face);
    for (const GridPatch& patch : patches)
      if (patch.face == f) bricks.add(patch.footprint(), patch.firstBin, patch.firstBin + patch.bins, true);
    for (const GridPatch& patch : patches)
      if (patch.face == f) bricks.add(patch.nodes, patch.nearestBin, patch.deepestBin, false);
    for (int row = 0; row < face.rows; ++row)
      for (int column = 0; column < face.columns; ++column) {
        const Bricks::Bins& bins = bricks.of(row, column);
        nodeAt.push_back(GridTile::kNoNode);
        if (bins.end < bins.first) continue;
        // Before them a group of zeros, what lies before everything.
        const double first = bins.first - face.firstBin, length = bins.end - bins.first + kGroupBins;
        if (!(static_cast<double>(floats_) + length <= most && bins.end - face.firstBin < 1 << 30)) return;
        const Run run{static_cast<std::int32_t>(floats_), static_cast<std::int32_t>(length)};
        nodeAt.back() = run.begin + kGroupBins - static_cast<std::int32_t>(first);
        runs_.push_back(run);
        face.bins = std::max(face.bins, static_cast<int>(bins.end - face.firstBin));
        floats_ += static_cast<std::size_t>(run.bins);
      }
  }
  fits = true;
}

void GridField::allot(std::size_t channels) {
  for (std::size_t c = 0; c < channels; ++c) {
    values[c].resize(floats_ + kGridBatch);
    parallelBlocks(values[c].size(), 1 << 18,
                   [&](std::size_t begin, std::size_t end) { std::fill_n(&values[c][begin], end - begin, 0.0f); });
  }
}

void GridField::lend(const GridPatch& patch, GridTile& to) {
  const Face& face = faces[patch.face];
  const auto shift = static_cast<std::int32_t>(patch.firstBin - face.firstBin);
  for (std::int32_t& place : to.groupAt) place += shift;
  to.pitch = face.columns;
  to.nodeAt = nodeAt.data() + face.firstNode +
              static_cast<std::ptrdiff_t>(patch.firstRow - face.firstRow) * face.columns +
              static_cast<std::ptrdiff_t>(patch.firstColumn - face.firstColumn);
  for (std::size_t c = 0; c < to.channels; ++c) to.values[c] = values[c].data();
}

void GridField::sum() {
  parallelBlocks(runs_.size(), 1 << 8, [&](std::size_t begin, std::size_t end) {
    for (RawVector<float>& all : values)
      for (std::size_t k = begin; k < end && !all.empty(); ++k)
        sumRuns({all.data() + runs_[k].begin, static_cast<std::size_t>(runs_[k].bins)}, runs_[k].bins);
  });
}

std::vector<GridPatch> patchesOfLoners(const GridField& field, const Octree& tree, const GridShape& shape,
                                       std::span<const Loner> loners) {
  struct Entry {
    std::size_t face;
    int row, column;  // of patches
    std::uint32_t slot;
    auto place() const { return std::tuple(face, row, column); }
  };
  std::vector<Entry> entries;
  for (const auto& [f, slot] : loners) {
    const dvec3 centre = dvec3(tree.position(slot)) - shape.faces[f].origin;
    const NodeBox box(nodeRange(centre, tree.radius[slot], shape.faces[f], shape), field.faces[f]);
    if (box.left > box.right || box.top > box.bottom) continue;
    for (int row = box.top / kLonerNodes; row <= box.bottom / kLonerNodes; ++row)
      for (int column = box.left / kLonerNodes; column <= box.right / kLonerNodes; ++column)
        entries.push_back({f, row, column, slot});
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.place() < b.place(); });
  std::vector<GridPatch> patches;
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const Entry& entry = entries[k];
    const GridField::Face& face = field.faces[entry.face];
    if (k == 0 || entry.place() != entries[k - 1].place()) {
      GridPatch patch;
      patch.face = entry.face;
      const int left = entry.column * kLonerNodes, top = entry.row * kLonerNodes;
      patch.firstColumn = face.firstColumn + left, patch.firstRow = face.firstRow + top;
      patch.columns = std::min(kLonerNodes, face.columns - left) - 1;
      patch.rows = std::min(kLonerNodes, face.rows - top) - 1;
      patch.firstBin = face.firstBin, patch.bins = face.bins;
      patches.push_back(std::move(patch));
    }
    patches.back().some.push_back(entry.slot);
  }
  return patches;
}

}  // namespace mote
