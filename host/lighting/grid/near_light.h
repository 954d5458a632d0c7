// What lies within a few radii of a point light, which no light grid has (light_grid.h): added exactly.
#pragma once
#include "host/lighting/grid/plan.h"

namespace mote {

/// Adds the slots `nearLight` of a plan to the optical depths of a tile's receivers, [channel][receiver].
/// `slack`: ColumnRules::slack.
void addNearLight(const Octree& tree, std::span<const std::uint32_t> nearLight, const GridShape& shape,
                  const TilePlace& place, const Receivers& receivers, std::span<const std::uint32_t> members,
                  const LightingOptions& options, float slack, std::vector<float>& depths);

}  // namespace mote
