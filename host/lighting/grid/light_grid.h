// Approximate optical depths from a grid: cells on a light's plane, bins of depth behind them.
//
// Each particle's kernel is put down on the nodes of the cells it covers, its total kept, and is split over the bins of
// depth by the share of it that lies in each; summed along the depth, a node holds the optical depth of the ray that
// passes it. A receiver interpolates between four nodes and two edges of bins and takes away what it put there itself.
// The interpolation widens kernels, so they are put down narrower (KernelWeights in plan.h).
//
// The cost is linear in particles, whatever they overlap. There are two ways, the same grid but for rounding:
//   by patches (patches.h, field.h), where the particles light themselves and the grid has not many more nodes
//     than particles: runs of slots go straight into one field of nodes, as they stand in memory;
//   tile by tile (plan.h, tile.h): particles and receivers are sorted first, a tile's nodes pass through the
//     caches, and nothing is as large as the whole grid.
//
// The nodes stand at whole multiples of a cell about the light (point lights: on the faces of a cube along the world's
// axes; directional: in the world), so a grid does not move with the particles' bounding box.
#pragma once
#include "host/lighting/lighting.h"

namespace mote {

/// How fine a grid is.
struct GridResolution {
  double cell = 0;  ///< of a cell's edge; directional: [scene units], point: on the plane one unit from the light
  double bin = 0;   ///< of depth [scene units]
};

/// As opticalDepths, approximately. Point lights: particles within four radii of the light are added exactly.
/// `light.castsShadows == 0` or `shadowDensity == 0` gives zeros. The same bits on any number of threads and any
/// instruction set. About 0.05 µs a particle and thread for cells of 0.8 radii or more, 0.1 at 0.45, 0.2 at 0.3. By
/// patches it takes at most 32 bytes a particle beside the result and 2 MiB, tile by tile 18 and one tile a thread.
std::vector<float> gridOpticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                     const LightingOptions& options, const GridResolution& resolution,
                                     std::span<const std::uint8_t> reached = {}, const RaysDone& done = {});

}  // namespace mote
