#include "host/lighting/light_grid.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/lighting/grid_near_light.h"
#include "host/lighting/grid_tile.h"

namespace mote {
namespace {

/// Takes from each receiver what its own particle put into the grid.
void removeOwn(const GridTile& tile, const Receivers& receivers, std::span<const std::uint32_t> members,
               std::span<const std::uint32_t> slots, std::vector<float>& depths) {
  const std::size_t count = members.size();
  const auto remove = [&](std::size_t k, std::size_t particle) {
    for (std::size_t c = 0; c < tile.channels; ++c) {
      float& depth = depths[c * count + k];
      depth = std::max(depth - tile.particles.peak[c][particle] * tile.particles.own[particle], 0.0f);
    }
  };
  for (std::size_t k = 0; k < count; ++k) {
    if (tile.receiversAreParticles) {
      remove(k, k);
      continue;
    }
    const std::uint32_t self = receivers.selfOf(members[k]);
    const auto at = std::lower_bound(slots.begin(), slots.end(), self);
    if (at != slots.end() && *at == self) remove(k, static_cast<std::size_t>(at - slots.begin()));
  }
}

}  // namespace

std::vector<float> gridOpticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                     const LightingOptions& options, const GridResolution& resolution,
                                     std::span<const std::uint8_t> reached, const RaysDone& done) {
  MOTE_CHECK(resolution.cell, >, 0.0);
  MOTE_CHECK(resolution.bin, >, 0.0);
  const std::size_t channels = tree.channels();
  std::vector<float> depths(channels * receivers.size(), 0.0f);
  if (shadowless(light) || tree.particleCount() == 0) return depths;
  const GridShape shape = gridShape(light, resolution, options.falloff);
  const GridPlan plan = planGrid(tree, receivers, shape, reached);
  const float slack = columnRules(tree, light, receivers.bounds()).slack;
  // Of each thread, and gone with this call: hundreds of bytes for each particle of a tile.
  struct Workspace {
    GridTile tile;
    std::vector<float> read;
  };
  tbb::enumerable_thread_specific<Workspace> workspaces;
  parallelBlocks(plan.tiles.size(), 1, [&](std::size_t t, std::size_t) {
    auto& [tile, read] = workspaces.local();
    const std::span<const std::uint32_t> members = plan.receivers(plan.tiles[t]), slots = plan.particles(plan.tiles[t]);
    tile.setUp(tree, receivers, plan, plan.tiles[t], shape, options.falloff);
    tile.allotNodes();
    fillTile(tile);
    readTile(tile, read);
    removeOwn(tile, receivers, members, slots, read);
    addNearLight(tree, plan.nearLight, shape, plan.tiles[t].place, receivers, members, options, slack, read);
    for (std::size_t c = 0; c < channels; ++c)
      for (std::size_t k = 0; k < members.size(); ++k)
        depths[c * receivers.size() + members[k]] = read[c * members.size() + k];
    if (done) done(members.size());
  });
  return depths;
}

}  // namespace mote
