// One tile of a light grid, and the steps that fill and read it (light_grid.h).
#pragma once
#include <cstdint>
#include <vector>

#include "host/lighting/column.h"
#include "host/lighting/light_grid.h"

namespace mote {

/// Cells along a tile's edge: wide enough that few particles lie in two tiles, few enough that a hundred layers of
/// nodes stay in the second cache.
constexpr int kTileCells = 32;
/// Particles nearer to a point light than this many radii are not ellipses on a cube's face: at its corners a second
/// order of (r/ρ) would be off by a tenth of their mass at ten radii.
constexpr double kCurvedRadii = 32;
/// Lanes of a row of nodes, whatever the machine has.
constexpr int kGridLanes = 8;
/// Nodes of a row: those of the cells, and room for a whole vector from the last.
constexpr int kTileStride = kTileCells + kGridLanes;
constexpr int kTileRows = kTileCells + 1;

/// What follows from the falloff F(q): its integral over the unit disc is π · mass, and its variance along one axis
/// `variance` of r².
struct KernelMoments {
  double mass, variance;
};
KernelMoments kernelMoments(layout::uint falloff);

/// Share of a particle that lies before its centre plus x radii of depth, −1 ≤ x ≤ 1: the end caps of DESIGN §2
/// averaged over the smooth kernel, ½ ± (0.9|x| − 0.5|x|³ + 0.1 x⁶).
inline float depthShare(float x) {
  const float a = std::min(std::abs(x), 1.0f), a2 = a * a;
  const float half = 0.9f * a - 0.5f * (a2 * a) + 0.1f * (a2 * a2 * a2);
  return x < 0 ? 0.5f - half : 0.5f + half;
}

/// Set up again for each tile; holds on to its memory.
struct GridTile {
  LightFrame frame;
  GridResolution resolution;
  double firstColumn = 0, firstRow = 0;  ///< node numbers of the tile's corner
  double depthBase = 0;                  ///< in bins, whole
  layout::uint falloff = layout::kFalloffSmooth;
  KernelMoments moments{};

  Column column;  ///< planes and gathered particles
  /// Of gathered particles: place in nodes from the tile's corner, depth and radius in bins, and the quadratic form of
  /// q = a·Δx² + b·Δx·Δy + c·Δy² in nodes; `mass` is the integral of F in cells. `depth` is less
  /// by the mean sag over the kernel (column.h). `own`: at first the centre's own depth, when the tile is filled the
  /// share of its peak that the particle finds of itself where it stands.
  struct Splats {
    std::vector<float> x, y, depth, depthRadius, a, b, c, mass, own;
    /// Point lights, nearer than kCurvedRadii: z²/r², narrowed; the footprint's two sides differ, so q is taken by its
    /// full formula, and `mass` is a solid angle over the cell's area. Else 0.
    std::vector<float> curved;
    std::vector<Place> place;
    void resize(std::size_t count);
  } splats;

  std::vector<std::uint32_t> receiver;
  std::vector<float> receiverX, receiverY, receiverDepth;

  int firstLayer = 0, layers = 0;  ///< edges of bins: layers + 1 of them, from depthBase + firstLayer on
  std::vector<float> nodes[3];     ///< [edge][row][column]; edge 0 is empty, then optical depth before each edge
  float* layer(int channel, int edge) {
    return nodes[channel].data() + static_cast<std::size_t>(edge) * kTileRows * kTileStride;
  }
  std::vector<float> footprint;  ///< of one particle at a time
};

/// The steps on vectors, the same bits on every instruction set.
/// column.gathered → splats.
void placeSplats(GridTile& tile);
/// Puts the splats down and sums along the depth.
void fillTile(GridTile& tile, std::size_t channels);
/// Optical depths of all receivers, [channel][k] with `count` receivers a channel.
void readTile(const GridTile& tile, std::size_t channels, std::vector<float>& depths);

}  // namespace mote
