// Which tiles a light grid has, and what belongs to each (light_grid.h).
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "host/core/raw_vector.h"
#include "host/lighting/exact/column.h"
#include "host/lighting/grid/light_grid.h"
#include "shaders/glsl/layout/grid.h"

namespace mote {

/// Particles nearer to a point light than this many radii are not ellipses on a cube's face: at its corners a second
/// order of (r/ρ) would be off by a tenth of their mass at ten radii.
constexpr double kCurvedRadii = 32;
/// What follows from the falloff F(q): its integral over the unit disc is π · mass, and its variance along one axis
/// `variance` of r².
struct KernelMoments {
  double mass, variance;
};
KernelMoments kernelMoments(layout::uint falloff);

/// How a kernel is put down on nodes, so that what receivers find between them comes nearest to it. Interpolation
/// widens it by a tent over a cell, so it is put down narrower. The margin of a smooth kernel, where F(q) is small, is
/// left out: its nodes are better spent on a finer grid. There weights are F(q) or the line that meets it at q = 0 and
/// is 0 at the support, whichever is less. On a finer grid the margin is a smaller share of the kernel, and weights
/// become F(q). All of it is chosen for the least mean square over the plane, of which tools/bench/fit_grid_kernels.py
/// has the numbers: up to seven nodes across, within 18 % of the best weights on as many.
struct KernelWeights {
  double tentBelow;  ///< the square of the radius [cells²] up to which it is a tent, on the four nodes about its centre
  double narrowing;  ///< taken from the square of the radius [cells²]
  double leastSupport;
  double margin;  ///< [cells]
  /// The square of the radius that q = 1 has when it is put down [cells²].
  double narrowed(double square) const { return std::max(square, tentBelow) - narrowing; }
  /// The square of the radius where weights become 0 [cells²], for one that is narrowed.
  double supported(double narrowed) const {
    return std::max(leastSupport * narrowed, narrowed - margin * std::sqrt(narrowed));
  }
};
KernelWeights kernelWeights(layout::uint falloff);

/// Along a tile's edge: wide enough that few particles lie in several, and their nodes still pass through the caches.
constexpr int kTileCells = 32;

/// What all tiles of a grid share.
struct GridShape {
  /// One plane for a directional light, else the six faces of a cube along the world's axes about the light.
  std::vector<LightFrame> faces;
  GridResolution resolution;
  int tileCells = 0;  ///< along a tile's edge
  KernelMoments moments{};
  KernelWeights weights{};

  bool perspective() const { return faces.front().perspective; }
};
GridShape gridShape(const layout::Light& light, const GridResolution& resolution, layout::uint falloff);

/// A tile by number on its face: it has the cells from column · tileCells, row · tileCells on.
struct TilePlace {
  std::size_t face = 0;
  double column = 0, row = 0;
};

/// The tiles that have receivers, neighbours near each other.
struct GridPlan {
  struct Tile {
    TilePlace place;
    /// Its receivers are items[begin … middle). Its particles are items[middle … end), and where receivers are slots
    /// also the receivers.
    std::size_t begin, middle, end;
  };
  std::vector<Tile> tiles;
  RawVector<std::uint32_t> items;  ///< numbers of receivers, slots; ascending in either part
  bool receiversAreSlots = false;
  /// Slots nearer to a point light than kNearLightRadii / 2 radii, ascending; they are in no grid.
  std::vector<std::uint32_t> nearLight;

  std::span<const std::uint32_t> receivers(const Tile& tile) const {
    return std::span(items).subspan(tile.begin, tile.middle - tile.begin);
  }
  std::span<const std::uint32_t> particles(const Tile& tile) const {
    const std::size_t begin = receiversAreSlots ? tile.begin : tile.middle;
    return std::span(items).subspan(begin, tile.end - begin);
  }
};

/// Every receiver that is reached (`reached` empty: all) goes to the tile where it stands, every particle to all tiles
/// that may have a node of its kernel. The result depends on nothing but the arguments. Takes 9 bytes a receiver and
/// a particle while it runs, and 4 for each entry of the result.
GridPlan planGrid(const Octree& tree, const Receivers& receivers, const GridShape& shape,
                  std::span<const std::uint8_t> reached);

/// Where a sphere's kernel has nodes on a face [cells]. `centre`: relative to the light, in front of the face.
struct NodeRange {
  dvec2 lo, hi;
};
NodeRange nodeRange(const dvec3& centre, double radius, const LightFrame& face, const GridShape& shape);
/// The same for one nearer than kCurvedRadii to a point light, whose kernel is narrowed to `radius`.
NodeRange curvedNodeRange(const dvec3& centre, double radius, const LightFrame& face, double cell);

/// Tiles beyond ±2²³ count as the last, so that a tile's number is exact in double. Ordered by face, row, column.
double tileKey(const TilePlace& tile);
TilePlace tileOfKey(double key);
/// Of a point at the light itself.
constexpr double kNoTile = -1;

/// What locate says of a particle, beside the tile of its centre.
enum LocateFlags : std::uint8_t {
  // Sides where the next tile may have nodes of its kernel, and the corners between them.
  kLeft = 1,
  kRight = 2,
  kBelow = 4,
  kAbove = 8,
  kAnywhere = 16,   ///< so may any tile
  kNearLight = 32,  ///< it is nearer to a point light than kNearLightRadii / 2 radii
  kPoint = 64       ///< its radius is 0
};
struct LocatePoints {
  const float *x, *y, *z;
  const float* radius;  ///< null: all 0
  std::size_t count;    ///< the arrays may end there
};
/// Keys of tiles and LocateFlags of points; the same bits on every instruction set.
void locate(const LocatePoints& points, const GridShape& shape, double* keys, std::uint8_t* flags);

/// Bounds of points, 1 … of them; the same on every instruction set.
struct PointBounds {
  vec3 lo, hi;
  float leastRadius, greatestRadius;
};
PointBounds boundsOf(const LocatePoints& points);

}  // namespace mote
