// One tile or patch of a light grid, and the steps that fill and read it (light_grid.h).
//
// Nodes stand [row][column][bin]: a kernel adds to a few short runs of bins, and a ray's depths lie side by side.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "host/lighting/grid/patches.h"
#include "shaders/glsl/layout/grid.h"

namespace mote {

/// Bins go in groups of so many, the lanes of a vector on every machine. Groups that nothing needs are left out.
constexpr int kGroupBins = 4;
/// Kernels on up to so many nodes across and up to so many groups of bins go a vector of particles at a time; others
/// one by one.
constexpr int kMostWindow = 10, kMostGroups = 2;
/// Nodes beyond a tile's on each side, so that such kernels need no clipping: a centre stands up to half a window
/// outside, and its nodes as many from there.
constexpr int kNodeMargin = kMostWindow;
/// Particles of a step; arrays have room for one more.
constexpr std::size_t kGridBatch = 16;

/// Share of a particle that lies before its centre plus x radii of depth, −1 ≤ x ≤ 1: the end caps of DESIGN §2
/// averaged over the smooth kernel, ½ ± (0.9|x| − 0.5|x|³ + 0.1 x⁶).
inline float depthShare(float x) {
  const float a = std::min(std::abs(x), 1.0f), a2 = a * a;
  const float half = 0.9f * a - 0.5f * (a2 * a) + 0.1f * (a2 * a2 * a2);
  return x < 0 ? 0.5f - half : 0.5f + half;
}

/// Numbers of particles or receivers: where they stand in a row in the tree, there; else collected.
class GridSource {
 public:
  float operator[](std::size_t i) const { return from_[i]; }
  const float* at(std::size_t i) const { return from_ + i; }
  /// Until the next call; as long as the array may be read a vector beyond its end.
  void lend(const float* from) { from_ = from; }
  /// Room for `size`, and for one more step.
  float* collect(std::size_t size) {
    if (own_.size() < size + kGridBatch) own_.resize(size + size / 2 + kGridBatch);
    from_ = own_.data();
    return own_.data();
  }

 private:
  const float* from_ = nullptr;
  std::vector<float> own_;
};

/// Points in a tile.
struct GridPoints {
  GridSource sourceX, sourceY, sourceZ;  ///< as they were found [scene units]
  std::vector<float> x, y;               ///< nodes from the tile's corner
  std::vector<float> depth;              ///< bins from the tile's base
  std::vector<std::int32_t> bin;         ///< that the depth lies in
  std::size_t count = 0;
  void resize(std::size_t size);
  /// The sources are the tree's, from a slot on.
  void lend(const Octree& tree, std::size_t begin);
};

/// Particles in a tile.
struct GridParticles {
  GridPoints points;
  GridSource radius, peak[3];
  /// Half width in cells of what a kernel covers; 0: nothing is put down.
  std::vector<float> half;
  /// q = a·Δx² + b·Δx·Δy + c·Δy² in nodes; `mass` is the integral of F in cells.
  std::vector<float> a, b, c, mass;
  /// 1 / the q from which on weights are 0 (KernelWeights).
  std::vector<float> slope;
  /// In bins: of the kernel's middle, the centre less the mean sag over the kernel (column.h), and the radius.
  std::vector<float> depth, depthRadius;
  std::vector<std::int32_t> firstBin, lastBin;
  /// Point lights, nearer than kCurvedRadii: z²/r², narrowed; the footprint's two sides differ, so q is taken by its
  /// full formula, and `mass` is a solid angle over the cell's area. Else 0.
  std::vector<float> curved;
  /// Share of its peak that a particle finds of itself where it stands.
  std::vector<float> own;
  /// Those that go alone (kAlone), ascending.
  std::vector<std::uint32_t> alone;
  void resize(std::size_t size);
};

/// Set up again for each tile; holds on to its memory.
struct GridTile {
  const GridShape* shape = nullptr;
  LightFrame frame;
  double firstColumn = 0, firstRow = 0;  ///< node numbers of the tile's corner
  double bin = 0;                        ///< of depth [scene units]
  double depthBase = 0;                  ///< in bins, whole
  layout::uint falloff = layout::kFalloffSmooth;
  std::size_t channels = 1;

  GridParticles particles;
  /// The first of `particles` where receivers are slots; else `otherPoints`.
  std::size_t receivers = 0;
  bool receiversAreParticles = false;
  GridPoints otherPoints;
  const GridPoints& receiverPoints() const { return receiversAreParticles ? particles.points : otherPoints; }

  /// Groups from firstGroup on: the place in a node's run of bins where each begins, or −1 for those left out. Every
  /// run begins with a group of zeros, what lies before everything.
  int firstGroup = 0;
  std::vector<std::int32_t> groupAt;
  int run = 0;                ///< bins of a node, where nodes are its own; else 0
  int columns = 0, rows = 0;  ///< cells
  int margin = kNodeMargin;   ///< nodes beyond these on each side
  /// The runs of all nodes, of each channel: at first what lies in each bin, then the optical depth up to its end. A
  /// patch has those of its field.
  float* values[3] = {};
  /// Where a node's run begins: nodeAt[row · pitch + column] from the corner, up to `margin` before it and behind.
  const std::int32_t* nodeAt = nullptr;
  int pitch = 0;
  static constexpr std::int32_t kNoNode = std::numeric_limits<std::int32_t>::min();

  /// Takes what a tile of a plan has from the tree, and places everything. Bins are made longer, by twos, where a tile
  /// is so deep that its nodes would take more than 64 MiB.
  void setUp(const Octree& tree, const Receivers& receivers, const GridPlan& plan, const GridPlan::Tile& planned,
             const GridShape& all, layout::uint kernel);
  /// The same for a patch; it has no receivers.
  void setUp(const Octree& tree, const GridPatch& patch, const GridShape& all, layout::uint kernel);
  /// Takes the patch's particles that stand on its face as `otherPoints`, placed.
  void placeStanding(const Octree& tree, const GridPatch& patch, const GridShape& all);
  /// Makes nodes of its own, all 0, with runs of one length side by side.
  void allotNodes();
  bool hasOwnNodes() const { return run > 0; }
  /// What lies in each bin becomes the optical depth up to its end.
  void sum();

  int stride() const { return columns + 1 + 2 * margin; }
  std::size_t nodeCount() const {
    return static_cast<std::size_t>(stride()) * static_cast<std::size_t>(rows + 1 + 2 * margin);
  }
  std::int32_t node(int column, int row) const { return nodeAt[static_cast<std::ptrdiff_t>(row) * pitch + column]; }
  /// Where the run's bins of a group begin; < 0: left out.
  int placeOfGroup(int group) const {
    const int at = group - firstGroup;
    return at < 0 || at >= static_cast<int>(groupAt.size()) ? -1 : groupAt[static_cast<std::size_t>(at)];
  }

 private:
  std::vector<float> ownValues_[3];
  std::vector<std::int32_t> ownNodeAt_;
};

constexpr int kAlone = kMostWindow + 1;
/// Nodes across of the window that a particle goes through a batch with; 0: it is not put down, kAlone: it goes alone.
inline int windowOf(const GridParticles& p, std::size_t i) {
  if (!(p.half[i] > 0)) return 0;
  const float nodes = std::max(std::ceil(2 * p.half[i]), 2.0f);
  const bool alone =
      nodes > kMostWindow || p.curved[i] > 0 || (p.lastBin[i] >> 2) - (p.firstBin[i] >> 2) >= kMostGroups;
  return alone ? kAlone : static_cast<int>(nodes);
}

/// How far from its centre a kernel that is not curved has nodes: 1 for a tent, else the greater half width of its
/// ellipse. `window`: windowOf.
inline float reachOf(const GridParticles& p, std::size_t i, int window) {
  if (window == 2) return 1;
  if (window != kAlone) return p.half[i];
  return std::sqrt(std::max(p.a[i], p.c[i]) / (p.slope[i] * (p.a[i] * p.c[i] - 0.25f * (p.b[i] * p.b[i]))));
}

/// Of a particle that goes alone: the nodes that its kernel covers, whether the tile has them or not, what its weights
/// are multiplied with for a peak of 1 (0: it is not put down), and GridParticles::own.
struct LoneKernel {
  int firstColumn = 0, firstRow = 0, columns = 0, rows = 0;
  float scale = 0, own = 0;
};

/// Weights and GridParticles::own of a kernel that reaches farther, or is curved, are weighAlone's.
constexpr float kMostReach = 32;

/// Nodes first … end − 1 of a tile that a kernel covers, for who puts it down elsewhere: a device.
struct CoveredNodes {
  std::int32_t firstColumn = 0, endColumn = 0, firstRow = 0, endRow = 0;

  /// More than a kernel has [cells]: a device may round otherwise.
  static constexpr float kSlack = 1e-3f;

  CoveredNodes() = default;
  /// Of a kernel about (x, y) that goes so far.
  CoveredNodes(float x, float y, float reach) {
    constexpr float kEnd = kTileCells + 1;
    const auto first = [&](float low) { return static_cast<std::int32_t>(std::ceil(std::clamp(low, 0.0f, kEnd))); };
    const auto end = [&](float high) {
      return static_cast<std::int32_t>(std::floor(std::clamp(high, -1.0f, kEnd - 1)) + 1);
    };
    firstColumn = first(x - (reach + kSlack)), endColumn = end(x + (reach + kSlack));
    firstRow = first(y - (reach + kSlack)), endRow = end(y + (reach + kSlack));
  }
  bool empty() const { return firstColumn >= endColumn || firstRow >= endRow; }
};

/// The blocks of a tile (shaders/glsl/layout/grid.h) that those nodes lie in.
struct CoveredBlocks {
  std::uint32_t first = 0;              ///< by rows
  std::uint32_t columns = 0, rows = 0;  ///< 0: none

  CoveredBlocks() = default;
  explicit CoveredBlocks(const CoveredNodes& nodes) {
    if (nodes.empty()) return;
    const auto block = [](std::int32_t node) { return static_cast<std::uint32_t>(node) / layout::kBlockEdge; };
    const std::uint32_t row = block(nodes.firstRow), column = block(nodes.firstColumn);
    first = row * layout::kTileBlocks + column;
    columns = block(nodes.endColumn - 1) - column + 1, rows = block(nodes.endRow - 1) - row + 1;
  }
  /// In one word: a byte of columns, one of rows, and the first.
  explicit CoveredBlocks(std::uint32_t word) : first(word >> 16), columns(word & 255), rows(word >> 8 & 255) {}
  /// Of one that goes alone: CoveredNodes's constructors say which.
  static constexpr std::uint32_t kAny = ~std::uint32_t{0};
};

/// The steps on vectors, the same bits on every instruction set.
/// Places of points, bins included.
void placePoints(const GridTile& tile, GridPoints& points);
/// Places of particles and their kernels.
void placeParticles(GridTile& tile);
LoneKernel weighAlone(const GridTile& tile, std::size_t particle);
/// Puts one that goes alone down, on the tile's nodes.
void putDownAlone(GridTile& tile, std::size_t particle);
/// For who puts them down elsewhere, a device: their kernels, with weights for a peak of 1 where there are several
/// channels, GridParticles::own, and of those that go by batches which of the tile's blocks they cover (CoveredBlocks;
/// of others kAny). Of those that are curved or reach farther than kMostReach, weights and own are not set, for
/// weighAlone. `kernels` and `blocks` have room for a step more.
void weighTile(GridTile& tile, layout::GridKernel* kernels, std::uint32_t* blocks);
/// Puts down those that go by batches, and lists those that go alone.
void putDownBatches(GridTile& tile);
/// Every node's run of bins becomes the sums up to each bin's end.
void sumRuns(std::span<float> nodes, int run);
/// Optical depths of all receivers, [channel][receiver].
void readTile(const GridTile& tile, std::vector<float>& depths);

}  // namespace mote
