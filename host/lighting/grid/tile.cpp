#include "host/lighting/grid/tile.h"

#include <algorithm>

namespace mote {
namespace {

/// Groups between the first and the last of a tile's, and bytes of its nodes: what is deeper gets longer bins.
constexpr int kMostGroupRange = 1 << 18;
/// So few are kept without asking which are needed.
constexpr int kAlwaysGroups = 64;
constexpr std::size_t kMostTileBytes = std::size_t{64} << 20;

template <class T>
void growTo(std::vector<T>& array, std::size_t size) {
  if (array.size() < size + kGridBatch) array.resize(size + size / 2 + kGridBatch);
}

/// Takes what a tile has from the tree.
void fetchParticles(const Octree& tree, std::span<const std::uint32_t> slots, GridTile& tile) {
  GridParticles& to = tile.particles;
  to.resize(slots.size());
  const std::size_t count = slots.size();
  const float* peaks[] = {tree.peak.data(), tree.peakGreen.data(), tree.peakBlue.data()};
  float *x = to.points.sourceX.collect(count), *y = to.points.sourceY.collect(count),
        *z = to.points.sourceZ.collect(count), *radius = to.radius.collect(count), *peak[3];
  for (std::size_t c = 0; c < tile.channels; ++c) peak[c] = to.peak[c].collect(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t slot = slots[i];
    x[i] = tree.x[slot], y[i] = tree.y[slot], z[i] = tree.z[slot], radius[i] = tree.radius[slot];
    for (std::size_t c = 0; c < tile.channels; ++c) peak[c][i] = peaks[c][slot];
  }
}

/// … what a patch has.
void fetchParticles(const Octree& tree, const GridPatch& patch, GridTile& tile) {
  if (!patch.some.empty()) return fetchParticles(tree, patch.some, tile);
  GridParticles& to = tile.particles;
  to.resize(patch.count());
  to.points.lend(tree, patch.begin);
  to.radius.lend(tree.radius.data() + patch.begin);
  const std::vector<float>* peaks[] = {&tree.peak, &tree.peakGreen, &tree.peakBlue};
  for (std::size_t c = 0; c < tile.channels; ++c) to.peak[c].lend(peaks[c]->data() + patch.begin);
}

void fetchReceivers(const Receivers& receivers, std::span<const std::uint32_t> members, GridTile& tile) {
  GridPoints& to = tile.otherPoints;
  to.resize(members.size());
  float *x = to.sourceX.collect(to.count), *y = to.sourceY.collect(to.count), *z = to.sourceZ.collect(to.count);
  for (std::size_t k = 0; k < members.size(); ++k) {
    const vec3 position = receivers.position(members[k]);
    x[k] = position.x, y[k] = position.y, z[k] = position.z;
  }
}

/// Marks the groups that particles or receivers need; false where there are too many.
bool markGroups(GridTile& tile) {
  const GridParticles& p = tile.particles;
  const GridPoints& receivers = tile.receiverPoints();
  int nearest = std::numeric_limits<int>::max(), deepest = std::numeric_limits<int>::min();
  for (std::size_t k = 0; k < tile.receivers; ++k)
    nearest = std::min(nearest, receivers.bin[k]), deepest = std::max(deepest, receivers.bin[k]);
  for (std::size_t i = 0; i < p.points.count; ++i)
    if (p.half[i] > 0) nearest = std::min(nearest, p.firstBin[i]);
  tile.firstGroup = nearest >> 2;
  const int last = (deepest >> 2) - tile.firstGroup;
  if (last >= kMostGroupRange) return false;
  tile.groupAt.assign(static_cast<std::size_t>(last) + 1, -1);
  const auto mark = [&](int first, int end) {
    for (int group = (first >> 2) - tile.firstGroup; group <= std::min((end >> 2) - tile.firstGroup, last); ++group)
      tile.groupAt[static_cast<std::size_t>(group)] = 0;
  };
  if (last < kAlwaysGroups) {
    std::fill(tile.groupAt.begin(), tile.groupAt.end(), 0);
  } else {
    for (std::size_t k = 0; k < tile.receivers; ++k) mark(receivers.bin[k], receivers.bin[k]);
    for (std::size_t i = 0; i < p.points.count; ++i)
      if (p.half[i] > 0) mark(p.firstBin[i], p.lastBin[i]);
  }
  int groups = 1;
  for (std::int32_t& at : tile.groupAt)
    if (at == 0) at = kGroupBins * groups++;
  // An odd number, so that neighbouring runs do not share a few lines of the cache.
  tile.run = kGroupBins * (groups | 1);
  return tile.nodeCount() * static_cast<std::size_t>(tile.run) * sizeof(float) <= kMostTileBytes;
}

/// Where a patch stands.
void cover(const GridPatch& patch, const GridShape& shape, GridTile& tile) {
  tile.shape = &shape;
  tile.frame = shape.faces[patch.face];
  tile.columns = patch.columns, tile.rows = patch.rows, tile.margin = patch.margin;
  tile.firstColumn = patch.firstColumn, tile.firstRow = patch.firstRow;
  tile.bin = shape.resolution.bin, tile.depthBase = patch.firstBin;
}

}  // namespace

void GridPoints::resize(std::size_t size) {
  count = size;
  for (auto* array : {&x, &y, &depth}) growTo(*array, size);
  growTo(bin, size);
}

void GridPoints::lend(const Octree& tree, std::size_t begin) {
  static_assert(kSlotPadding >= kGridBatch);
  sourceX.lend(tree.x.data() + begin), sourceY.lend(tree.y.data() + begin), sourceZ.lend(tree.z.data() + begin);
}

void GridParticles::resize(std::size_t size) {
  points.resize(size);
  for (auto* array : {&half, &a, &b, &c, &mass, &slope, &depth, &depthRadius, &curved, &own}) growTo(*array, size);
  growTo(firstBin, size), growTo(lastBin, size);
}

void GridTile::setUp(const Octree& tree, const Receivers& from, const GridPlan& plan, const GridPlan::Tile& planned,
                     const GridShape& all, layout::uint kernel) {
  const std::span<const std::uint32_t> members = plan.receivers(planned);
  shape = &all, falloff = kernel;
  channels = tree.channels();
  columns = rows = shape->tileCells, margin = kNodeMargin;
  receivers = members.size(), receiversAreParticles = plan.receiversAreSlots;
  fetchParticles(tree, plan.particles(planned), *this);
  if (!receiversAreParticles) fetchReceivers(from, members, *this);
  frame = shape->faces[planned.place.face];
  firstColumn = planned.place.column * shape->tileCells, firstRow = planned.place.row * shape->tileCells;
  const dvec3 offset = dvec3(from.position(members.front())) - frame.origin;
  const double depth = frame.perspective ? glm::length(offset) : glm::dot(offset, frame.axis);
  for (bin = shape->resolution.bin;; bin *= 2) {
    depthBase = std::floor(depth / bin);
    placeParticles(*this);
    if (!receiversAreParticles) placePoints(*this, otherPoints);
    if (markGroups(*this)) break;
  }
}

void GridTile::setUp(const Octree& tree, const GridPatch& patch, const GridShape& all, layout::uint kernel) {
  cover(patch, all, *this);
  falloff = kernel, channels = tree.channels();
  receivers = 0, receiversAreParticles = false;
  fetchParticles(tree, patch, *this);
  placeParticles(*this);
  firstGroup = 0, run = 0;
  groupAt.resize(static_cast<std::size_t>(patch.bins / kGroupBins));
  for (std::size_t group = 0; group < groupAt.size(); ++group)
    groupAt[group] = static_cast<std::int32_t>(group) * kGroupBins;
}

void GridTile::placeStanding(const Octree& tree, const GridPatch& patch, const GridShape& all) {
  cover(patch, all, *this);
  GridPoints& to = otherPoints;
  to.resize(patch.count());
  if (patch.some.empty()) {
    to.lend(tree, patch.begin);
  } else {
    float *x = to.sourceX.collect(to.count), *y = to.sourceY.collect(to.count), *z = to.sourceZ.collect(to.count);
    to.count = 0;
    for (std::size_t i = 0; i < patch.some.size(); ++i) {
      if (patch.stands[i] == 0) continue;
      const vec3 position = tree.position(patch.some[i]);
      x[to.count] = position.x, y[to.count] = position.y, z[to.count] = position.z;
      ++to.count;
    }
  }
  placePoints(*this, to);
}

void GridTile::allotNodes() {
  for (std::size_t channel = 0; channel < channels; ++channel) {
    ownValues_[channel].assign(nodeCount() * static_cast<std::size_t>(run) + kGridBatch, 0.0f);
    values[channel] = ownValues_[channel].data();
  }
  ownNodeAt_.resize(nodeCount());
  for (std::size_t k = 0; k < ownNodeAt_.size(); ++k) ownNodeAt_[k] = static_cast<std::int32_t>(k) * run;
  pitch = stride();
  nodeAt = ownNodeAt_.data() + margin * pitch + margin;
}

void GridTile::sum() {
  for (std::size_t channel = 0; channel < channels; ++channel)
    sumRuns({values[channel], nodeCount() * static_cast<std::size_t>(run)}, run);
}

}  // namespace mote
