#include "host/lighting/light_grid.h"

#include <algorithm>
#include <cmath>

#include "host/core/cap.h"
#include "host/core/error.h"
#include "host/core/falloff.h"
#include "host/core/parallel.h"
#include "host/lighting/beam_kernel.h"
#include "host/lighting/grid_tile.h"

namespace mote {
namespace {

/// Along a tile's edge: wide enough that few particles lie in several, and their nodes still pass through the caches.
constexpr int kTileCells = 64;

/// Copies what a tile has from the tree.
void fetchParticles(const Octree& tree, std::span<const std::uint32_t> slots, GridTile& tile) {
  GridParticles& to = tile.particles;
  to.resize(slots.size(), tile.channels);
  const std::vector<float>* peaks[] = {&tree.peak, &tree.peakGreen, &tree.peakBlue};
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const std::uint32_t slot = slots[i];
    to.points.sourceX[i] = tree.x[slot], to.points.sourceY[i] = tree.y[slot], to.points.sourceZ[i] = tree.z[slot];
    to.radius[i] = tree.radius[slot];
    for (std::size_t c = 0; c < tile.channels; ++c) to.peak[c][i] = (*peaks[c])[slot];
  }
}

void fetchReceivers(const Receivers& receivers, std::span<const std::uint32_t> members, GridTile& tile) {
  GridPoints& to = tile.otherPoints;
  to.resize(members.size());
  for (std::size_t k = 0; k < members.size(); ++k) {
    const vec3 position = receivers.position(members[k]);
    to.sourceX[k] = position.x, to.sourceY[k] = position.y, to.sourceZ[k] = position.z;
  }
}

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

/// Whether the support of a particle may touch what planes enclose.
bool touches(const ColumnPlanes& planes, const vec3& position, float radius) {
  const vec3 p = position - planes.origin;
  for (std::size_t k = 0; k < kColumnPlanes; ++k)
    if (p.x * planes.x[k] + p.y * planes.y[k] + p.z * planes.z[k] - planes.offset[k] > radius) return false;
  return true;
}

/// Adds what lies within a few radii of a point light, exactly.
void addNearLight(const Octree& tree, std::uint32_t slot, const dvec3& light, const Receivers& receivers,
                  std::span<const std::uint32_t> members, const LightingOptions& options, std::vector<float>& depths) {
  const vec3 centre(dvec3(tree.position(slot)) - light);
  const float radius = tree.radius[slot], inverseSquare = inverseSquareOf(radius);
  const std::vector<float>* peaks[] = {&tree.peak, &tree.peakGreen, &tree.peakBlue};
  const std::size_t count = members.size();
  for (std::size_t k = 0; k < count; ++k) {
    if (receivers.selfOf(members[k]) == slot) continue;
    const vec3 offset(dvec3(receivers.position(members[k])) - light);
    const float length = glm::length(offset);
    const vec3 direction = offset / length;
    const float fromLight = glm::dot(centre, direction);
    const float s = options.endpoint == layout::kEndpointClamp ? std::clamp(fromLight, 0.0f, length) : fromLight;
    const vec3 across = centre - s * direction;
    const float q = glm::dot(across, across) * inverseSquare;
    if (q >= 1) continue;
    float share = falloff(q, options.falloff);
    if (options.endpoint == layout::kEndpointSoft) {
      const float halfChord = radius * std::sqrt(1 - q);
      share *= cap(length - fromLight, halfChord) * cap(fromLight, halfChord);
    }
    for (std::size_t c = 0; c < tree.channels(); ++c) depths[c * count + k] += (*peaks[c])[slot] * share;
  }
}

/// Planes around the rays of a tile's receivers.
ColumnPlanes planesOf(const GridTile& tile, const Receivers& receivers, std::span<const std::uint32_t> members,
                      float slack) {
  double deepest = 0;
  for (const std::uint32_t k : members)
    deepest = std::max(deepest, glm::distance(dvec3(receivers.position(k)), tile.frame.origin));
  const double cell = tile.shape->resolution.cell;
  const dvec2 corner(tile.firstColumn, tile.firstRow), end = corner + double(tile.shape->tileCells);
  return planesAround(tile.frame, corner * cell, end * cell, deepest, slack);
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
  const GridShape shape{gridFaces(light), resolution, kTileCells, kernelMoments(options.falloff)};
  const GridPlan plan = planGrid(tree, receivers, shape, reached);
  const float slack = columnRules(tree, light, receivers.bounds()).slack;
  parallelBlocks(plan.tiles.size(), 1, [&](std::size_t t, std::size_t) {
    static thread_local GridTile tile;
    static thread_local std::vector<float> read;
    const std::span<const std::uint32_t> members = plan.receivers(plan.tiles[t]), slots = plan.particles(plan.tiles[t]);
    tile.shape = &shape;
    tile.falloff = options.falloff;
    tile.channels = channels;
    tile.receivers = members.size(), tile.receiversAreParticles = plan.receiversAreSlots;
    fetchParticles(tree, slots, tile);
    if (!plan.receiversAreSlots) fetchReceivers(receivers, members, tile);
    tile.place(plan.tiles[t].place, dvec3(receivers.position(members.front())));
    fillTile(tile);
    readTile(tile, read);
    removeOwn(tile, receivers, members, slots, read);
    if (!plan.nearLight.empty()) {
      const ColumnPlanes planes = planesOf(tile, receivers, members, slack);
      for (const std::uint32_t slot : plan.nearLight)
        if (touches(planes, tree.position(slot), tree.radius[slot]))
          addNearLight(tree, slot, tile.frame.origin, receivers, members, options, read);
    }
    for (std::size_t c = 0; c < channels; ++c)
      for (std::size_t k = 0; k < members.size(); ++k)
        depths[c * receivers.size() + members[k]] = read[c * members.size() + k];
    if (done) done(members.size());
  });
  return depths;
}

}  // namespace mote
