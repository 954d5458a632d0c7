// Optical depths by way of voxels: particles rasterised into an OpenVDB grid of extinction, then one march a particle.
#pragma once
#include <memory>
#include <vector>

#include "host/lighting/lighting.h"

namespace mote {

struct DensityGridOptions {
  int size = 128;  ///< voxels along the longest side of the particles' box, 8 … 1024
  float step = 1;  ///< of the march [voxels]
};

class DensityGrid {
 public:
  /// Of a tree with one channel, which must live as long.
  DensityGrid(const Octree& tree, const DensityGridOptions& options);
  ~DensityGrid();

  /// Rasterises: each particle is the ball whose projection is falloff smooth, at least a voxel in radius, its samples
  /// scaled to keep their integral. By the grid's leaves on TBB.
  void build();
  /// From every slot's place to the light or out of the grid by trilinear samples, empty leaves skipped, less half of
  /// the particle's own depth. Falloff smooth; ends at the cutoff. After build().
  std::vector<float> opticalDepths(const layout::Light& light, const LightingOptions& options) const;

 private:
  struct Grid;
  const Octree& tree_;
  DensityGridOptions options_;
  std::unique_ptr<Grid> grid_;
};

}  // namespace mote
