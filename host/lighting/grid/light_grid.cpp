#include "host/lighting/grid/light_grid.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/lighting/grid/field.h"
#include "host/lighting/grid/near_light.h"
#include "host/lighting/grid/tile.h"

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

/// Of each thread, and gone with a call: some hundred bytes for each particle of a tile or a patch.
struct Workspace {
  GridTile tile;
  std::vector<float> read;
};
using Workspaces = tbb::enumerable_thread_specific<Workspace>;

/// What a grid is made for.
struct Task {
  const Octree& tree;
  const Receivers& receivers;
  const LightingOptions& options;
  const GridShape& shape;
  std::span<const std::uint8_t> reached;
  const RaysDone& done;
};

// ---- tile by tile

void byTiles(const Task& task, float slack, std::vector<float>& depths) {
  const auto& [tree, receivers, options, shape, reached, done] = task;
  const GridPlan plan = planGrid(tree, receivers, shape, reached);
  Workspaces workspaces;
  parallelBlocks(plan.tiles.size(), 1, [&](std::size_t t, std::size_t) {
    auto& [tile, read] = workspaces.local();
    const std::span<const std::uint32_t> members = plan.receivers(plan.tiles[t]), slots = plan.particles(plan.tiles[t]);
    tile.setUp(tree, receivers, plan, plan.tiles[t], shape, options.falloff);
    tile.allotNodes();
    putDownBatches(tile);
    for (const std::uint32_t i : tile.particles.alone) putDownAlone(tile, i);
    tile.sum();
    readTile(tile, read);
    removeOwn(tile, receivers, members, slots, read);
    addNearLight(tree, plan.nearLight, shape, plan.tiles[t].place, receivers, members, options, slack, read);
    for (std::size_t c = 0; c < tile.channels; ++c)
      for (std::size_t k = 0; k < members.size(); ++k)
        depths[c * receivers.size() + members[k]] = read[c * members.size() + k];
    if (done) done(members.size());
  });
}

// ---- by patches

/// A field may have so many bytes, and so many for each particle beside. With more, tiles are faster (measured): nodes
/// are then more than particles, and a tile's stay in the caches.
constexpr std::size_t kFieldBytes = std::size_t{2} << 20, kFieldBytesOfParticle = 32;

/// Calls one(slot, index) for the particles of a patch that stand on its face.
template <class One>
void eachStanding(const GridPatch& patch, const One& one) {
  for (std::size_t i = 0; i < patch.count(); ++i)
    if (patch.standsOnFace(i)) one(patch.slot(i), i);
}

/// Calls run(patches) for sets of patches by number, several at once: none has a node's bins that one of another set
/// has meanwhile. The sets and their order follow from the patches.
template <class Run>
void eachApart(const PatchPlan& plan, const Run& run) {
  struct Place {
    int turn;  // neighbours differ
    std::size_t face;
    double bin, row, column;  // of boxes as large as a patch
    std::uint32_t patch;
    auto box() const { return std::tuple(turn, face, bin, row, column); }
  };
  const auto odd = [](double number) { return number - 2 * std::floor(number / 2) == 1 ? 1 : 0; };
  std::vector<Place> places;
  for (std::uint32_t k = 0; k < plan.patches.size(); ++k) {
    const GridPatch& patch = plan.patches[k];
    const dvec2 node = floor(patch.footprint().lo / double(plan.mostNodes));
    const double bin = std::floor(patch.firstBin / plan.mostBins);
    places.push_back({odd(bin) * 4 + odd(node.y) * 2 + odd(node.x), patch.face, bin, node.y, node.x, k});
  }
  std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.box() < b.box(); });
  std::vector<std::uint32_t> order;
  std::vector<std::size_t> starts;  // of boxes
  for (std::size_t begin = 0, end = 0; begin < places.size(); begin = end) {
    order.clear(), starts.clear();
    for (; end < places.size() && places[end].turn == places[begin].turn; ++end) {
      if (end == begin || places[end].box() != places[end - 1].box()) starts.push_back(order.size());
      order.push_back(places[end].patch);
    }
    starts.push_back(order.size());
    parallelBlocks(starts.size() - 1, 1, [&](std::size_t k, std::size_t) {
      run(std::span(order).subspan(starts[k], starts[k + 1] - starts[k]));
    });
  }
}

/// Puts a patch down; a particle's own share is left in `depths`. Returns those that go alone.
std::vector<Loner> putDownPatch(const Task& task, const GridPatch& patch, GridField& field, GridTile& tile,
                                std::vector<float>& depths) {
  std::vector<Loner> alone;
  tile.setUp(task.tree, patch, task.shape, task.options.falloff);
  field.lend(patch, tile);
  putDownBatches(tile);
  GridParticles& p = tile.particles;
  for (const std::uint32_t i : p.alone) {
    if (patch.standsOnFace(i)) p.own[i] = weighAlone(tile, i).own;
    alone.push_back({patch.face, static_cast<std::uint32_t>(patch.slot(i))});
  }
  for (std::size_t c = 0; c < tile.channels; ++c)
    eachStanding(patch, [&](std::size_t slot, std::size_t i) {
      depths[c * task.receivers.size() + slot] = p.peak[c][i] * p.own[i];
    });
  return alone;
}

/// All patches into the field.
void putDown(const Task& task, const PatchPlan& plan, Workspaces& workspaces, GridField& field,
             std::vector<float>& depths) {
  std::vector<std::vector<Loner>> alone(plan.patches.size());
  eachApart(plan, [&](std::span<const std::uint32_t> set) {
    GridTile& tile = workspaces.local().tile;
    for (const std::uint32_t k : set) alone[k] = putDownPatch(task, plan.patches[k], field, tile, depths);
  });
  std::vector<Loner> all;
  for (const auto& part : alone) all.insert(all.end(), part.begin(), part.end());
  const std::vector<GridPatch> loners = patchesOfLoners(field, task.tree, task.shape, all);
  parallelBlocks(loners.size(), 1, [&](std::size_t k, std::size_t) {
    GridTile& tile = workspaces.local().tile;
    tile.setUp(task.tree, loners[k], task.shape, task.options.falloff);
    field.lend(loners[k], tile);
    for (std::size_t i = 0; i < tile.particles.points.count; ++i) putDownAlone(tile, i);
  });
}

/// Reads what the particles of a patch find, less their own share.
void readPatch(const Task& task, const GridPatch& patch, const GridField& field, Workspace& work,
               std::vector<float>& depths) {
  auto& [tile, read] = work;
  tile.placeStanding(task.tree, patch, task.shape);
  const std::size_t channels = task.tree.channels(), count = task.receivers.size();
  readField(field, patch, tile.otherPoints, channels, read);
  std::size_t next = 0;
  eachStanding(patch, [&](std::size_t slot, std::size_t) {
    for (std::size_t c = 0; c < channels; ++c) {
      float& depth = depths[c * count + slot];
      depth = task.reached.empty() || task.reached[slot] != 0
                  ? std::max(read[c * tile.otherPoints.count + next] - depth, 0.0f)
                  : 0.0f;
    }
    ++next;
  });
  if (task.done) task.done(next);
}

/// False where that is not possible, or the field were too large; nothing is done then.
bool byPatches(const Task& task, std::vector<float>& depths) {
  const Octree& tree = task.tree;
  const std::optional<PatchPlan> plan = planPatches(tree, task.shape);
  if (!plan) return false;
  const std::vector<GridPatch>& patches = plan->patches;
  const std::size_t most = (kFieldBytes + kFieldBytesOfParticle * tree.particleCount()) / sizeof(float);
  GridField field(patches, task.shape.faces.size(), most / tree.channels());
  if (!field.fits) return false;
  field.allot(tree.channels());
  Workspaces workspaces;
  putDown(task, *plan, workspaces, field, depths);
  field.sum();
  parallelBlocks(patches.size(), 1,
                 [&](std::size_t k, std::size_t) { readPatch(task, patches[k], field, workspaces.local(), depths); });
  return true;
}

}  // namespace

std::vector<float> gridOpticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                     const LightingOptions& options, const GridResolution& resolution,
                                     std::span<const std::uint8_t> reached, const RaysDone& done) {
  MOTE_CHECK(resolution.cell, >, 0.0);
  MOTE_CHECK(resolution.bin, >, 0.0);
  std::vector<float> depths(tree.channels() * receivers.size(), 0.0f);
  if (shadowless(light) || tree.particleCount() == 0) return depths;
  const GridShape shape = gridShape(light, resolution, options.falloff);
  const Task task{tree, receivers, options, shape, reached, done};
  if (areSlotsOf(tree, receivers) && byPatches(task, depths)) return depths;
  byTiles(task, columnRules(tree, light, receivers.bounds()).slack, depths);
  return depths;
}

}  // namespace mote
