#include "host/lighting/grid/patches.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "host/core/parallel.h"
#include "host/lighting/grid/tile.h"

namespace mote {
namespace {

/// Slots of a patch: so many that their arrays and nodes stay in a second-level cache.
constexpr std::size_t kMostSlots = 2048;
/// With fewer slots a patch, and more than so many patches, nothing is gained.
constexpr std::size_t kLeastSlots = 16, kMostPatches = 4096;
/// Runs at the edge of a face are split down to so many, as each of their particles is looked at by itself.
constexpr std::size_t kMostAtEdge = 256;
/// Bounds are widened by so much for what rounding does [cells, bins].
constexpr double kCellSlack = 1e-3, kBinSlack = 1e-2;
/// Kernels that go by batches lie in fewer bins.
constexpr double kMostBins = kGroupBins * kMostGroups;

struct Range {
  double lo, hi;
};

/// What is known of particles and where they stand on a face.
struct Extent {
  dvec2 lo{INFINITY}, hi{-INFINITY};    ///< places of the centres [cells]
  Range distance{INFINITY, -INFINITY};  ///< of the centres along the light's way [scene units]
  double half = 1;                      ///< greatest half width of those that go by batches [cells], at least
  double radius = 0;                    ///< greatest [scene units]
  NodeRange nodes{dvec2(INFINITY), dvec2(-INFINITY)};  ///< of all kernels
};

/// The patch with all of an extent; false if that were too large for the numbers it has.
bool cover(const Extent& extent, const GridShape& shape, GridPatch& patch) {
  const double bin = shape.resolution.bin;
  const dvec2 first = floor(extent.lo - kCellSlack), last = floor(extent.hi + kCellSlack);
  if (!(std::max(last.x - first.x, last.y - first.y) < 1 << 16)) return false;
  patch.firstColumn = first.x, patch.firstRow = first.y;
  patch.columns = static_cast<int>(last.x - first.x) + 1, patch.rows = static_cast<int>(last.y - first.y) + 1;
  const double window = std::clamp(std::ceil(2 * extent.half), 2.0, double(kMostWindow));
  patch.margin = (static_cast<int>(window) - 1) / 2;
  // Kernels are put down a little before their centres (their mean sag, at most an eighth of a radius).
  const double before = 1.125 * extent.radius, behind = std::min(extent.radius, kMostBins * bin);
  const auto whole = [&](double distance, double slack) { return std::floor(distance / bin + slack); };
  const auto groups = [](double bins) { return std::floor(bins / kGroupBins) * kGroupBins; };
  patch.firstBin = groups(whole(extent.distance.lo - std::min(before, kMostBins * bin), -kBinSlack));
  patch.nearestBin = groups(whole(extent.distance.lo - before, -kBinSlack));
  patch.deepestBin = groups(whole(extent.distance.hi + extent.radius, kBinSlack)) + kGroupBins;
  const double end = groups(whole(extent.distance.hi + behind, kBinSlack)) + kGroupBins;
  if (!(end - patch.firstBin < 1 << 20)) return false;
  patch.bins = static_cast<int>(end - patch.firstBin);
  patch.nodes = {floor(extent.nodes.lo), ceil(extent.nodes.hi)};
  return true;
}

/// Half width of a kernel [cells] (placeParticles, in single precision); an upper bound where `z` is a lower and
/// `slope` an upper one.
double halfWidth(double radius, double z, double slope, const GridShape& shape) {
  const double cells = radius / (shape.resolution.cell * z), square = cells * cells;
  if (!(square > shape.weights.tentBelow)) return 1;
  const double wide = shape.weights.supported(shape.weights.narrowed(square));
  return std::max(std::sqrt(wide * (1 + slope * slope)) * (1 + 1e-6), 1.0);
}

class Planner {
 public:
  Planner(const Octree& tree, const GridShape& shape, int mostNodes, int mostBins)
      : tree_(tree), shape_(shape), mostNodes_(mostNodes), mostBins_(mostBins) {}

  /// Adds the patches of a run of slots; false where some particle cannot be in one.
  bool add(std::size_t begin, std::size_t end, std::vector<GridPatch>& patches) const {
    const LocatePoints points{tree_.x.data() + begin, tree_.y.data() + begin, tree_.z.data() + begin,
                              tree_.radius.data() + begin, end - begin};
    const PointBounds bounds = boundsOf(points);
    if (!(bounds.leastRadius > 0)) return false;
    GridPatch patch;
    patch.begin = static_cast<std::uint32_t>(begin), patch.end = static_cast<std::uint32_t>(end);
    const std::optional<Extent> extent = shape_.perspective() ? onFace(bounds, patch.face) : onPlane(bounds);
    if (!extent && end - begin > kMostAtEdge) return halves(begin, end - begin, patches);
    if (!extent) return addAtEdge(points, begin, patches);
    const bool fits = cover(*extent, shape_, patch) && small(patch);
    if (!fits) return halves(begin, end - begin, patches);
    patches.push_back(std::move(patch));
    return true;
  }

 private:
  bool halves(std::size_t begin, std::size_t count, std::vector<GridPatch>& patches) const {
    return count > 1 && add(begin, begin + count / 2, patches) && add(begin + count / 2, begin + count, patches);
  }

  bool small(const GridPatch& patch) const {
    const NodeRange nodes = patch.footprint();
    return std::max(nodes.hi.x - nodes.lo.x, nodes.hi.y - nodes.lo.y) < mostNodes_ && patch.bins <= mostBins_;
  }

  std::optional<Extent> onPlane(const PointBounds& bounds) const {
    const LightFrame& frame = shape_.faces.front();
    const dvec3 lo = dvec3(bounds.lo) - frame.origin, hi = dvec3(bounds.hi) - frame.origin;
    const dvec3 centre = 0.5 * (lo + hi), size = 0.5 * (hi - lo);
    const auto along = [&](const dvec3& axis) {
      const double middle = glm::dot(centre, axis), reach = glm::dot(size, glm::abs(axis));
      return Range{middle - reach, middle + reach};
    };
    const Range u = along(frame.u), v = along(frame.v);
    const double cell = shape_.resolution.cell, radius = bounds.greatestRadius;
    const double half = halfWidth(radius, 1, 0, shape_);
    const dvec2 first = dvec2(u.lo, v.lo) / cell, last = dvec2(u.hi, v.hi) / cell;
    return Extent{first, last, along(frame.axis), half, radius, {first - half, last + half}};
  }

  /// None if they reach beyond a face, or too near to the light.
  std::optional<Extent> onFace(const PointBounds& bounds, std::size_t& face) const {
    const dvec3 origin = shape_.faces.front().origin;
    const dvec3 lo = dvec3(bounds.lo) - origin, hi = dvec3(bounds.hi) - origin, sum = glm::abs(lo + hi);
    const int k = sum.x >= sum.y && sum.x >= sum.z ? 0 : sum.y >= sum.z ? 1 : 2;
    const bool negative = lo[k] + hi[k] < 0;
    face = static_cast<std::size_t>(2 * k + (negative ? 1 : 0));
    const Range z = negative ? Range{-hi[k], -lo[k]} : Range{lo[k], hi[k]};
    Extent extent;
    extent.radius = bounds.greatestRadius;
    if (!(z.lo > 1.001 * kCurvedRadii * extent.radius)) return {};
    dvec2 nearest, farthest;
    for (int i = 0; i < 2; ++i) {
      const double low = lo[(k + 1 + i) % 3], high = hi[(k + 1 + i) % 3];
      extent.lo[i] = low / (low < 0 ? z.lo : z.hi), extent.hi[i] = high / (high < 0 ? z.hi : z.lo);
      nearest[i] = std::max({low, -high, 0.0}), farthest[i] = std::max(-low, high);
    }
    const dvec2 slopes = max(abs(extent.lo), abs(extent.hi));
    const double cell = shape_.resolution.cell, slope = std::max(slopes.x, slopes.y);
    extent.half = halfWidth(extent.radius, z.lo, slope, shape_);
    if (!(slope + (extent.half + 3) * cell < 1)) return {};
    extent.lo /= cell, extent.hi /= cell;
    extent.nodes = {extent.lo - extent.half, extent.hi + extent.half};
    extent.distance = {glm::length(dvec3(nearest, z.lo)), glm::length(dvec3(farthest, z.hi))};
    return extent;
  }

  /// A patch on each face that has nodes of their kernels.
  bool addAtEdge(const LocatePoints& points, std::size_t begin, std::vector<GridPatch>& patches) const {
    std::vector<double> keys(points.count);
    std::vector<std::uint8_t> flags(points.count);
    locate(points, shape_, keys.data(), flags.data());
    const double last = 1 / shape_.resolution.cell + 1;  // receivers on a face read nodes up to there
    const std::size_t before = patches.size();
    bool fit = true;
    for (std::size_t face = 0; face < shape_.faces.size(); ++face) {
      const LightFrame& frame = shape_.faces[face];
      Extent extent;
      GridPatch patch;
      patch.face = face;
      patch.begin = static_cast<std::uint32_t>(begin), patch.end = static_cast<std::uint32_t>(begin + points.count);
      for (std::size_t i = 0; i < points.count; ++i) {
        const dvec3 centre = dvec3(points.x[i], points.y[i], points.z[i]) - frame.origin;
        const double radius = points.radius[i], z = glm::dot(centre, frame.axis), distance = glm::length(centre);
        if (keys[i] == kNoTile || (flags[i] & kNearLight) != 0) return false;
        if (!(z > kLeastCosine / 2 * distance)) continue;
        const NodeRange nodes = nodeRange(centre, radius, frame, shape_);
        const bool stands = tileOfKey(keys[i]).face == face;
        if (!stands && (nodes.lo.x > last || nodes.lo.y > last || nodes.hi.x < -last || nodes.hi.y < -last)) continue;
        const dvec2 place(glm::dot(centre, frame.u) / z, glm::dot(centre, frame.v) / z);
        const double half = halfWidth(radius, z, std::max(std::abs(place.x), std::abs(place.y)), shape_);
        extent.nodes = {min(extent.nodes.lo, nodes.lo), max(extent.nodes.hi, nodes.hi)};
        extent.lo = min(extent.lo, place / shape_.resolution.cell);
        extent.hi = max(extent.hi, place / shape_.resolution.cell);
        extent.half = std::max(extent.half, half), extent.radius = std::max(extent.radius, radius);
        extent.distance = {std::min(extent.distance.lo, distance), std::max(extent.distance.hi, distance)};
        patch.some.push_back(static_cast<std::uint32_t>(begin + i));
        patch.stands.push_back(stands ? 1 : 0);
      }
      if (patch.some.empty()) continue;
      if (!cover(extent, shape_, patch)) return false;
      fit = fit && small(patch);
      patches.push_back(std::move(patch));
    }
    if (fit) return true;
    patches.resize(before);
    return halves(begin, points.count, patches);
  }

  const Octree& tree_;
  const GridShape& shape_;
  int mostNodes_, mostBins_;
};

/// A cloud is so many times as large as its largest patches, but these stay between so many nodes and bins: smaller
/// ones are slow, larger ones are put down by few threads.
constexpr double kParts = 8, kNodesFrom = 32, kNodesTo = 48, kBinsFrom = 32, kBinsTo = 64;

/// Ends of runs of slots: whole nodes, of at most kMostSlots (or a leaf), neighbours joined where both are small.
std::vector<std::size_t> runsOf(const Octree& tree) {
  std::vector<std::size_t> ends{0};
  for (std::size_t index = 0; index < tree.nodeCount();) {
    const layout::Node& node = tree.nodes[index];
    const std::size_t end = tree.nodes[node.skip].first;
    if (end - node.first > kMostSlots && node.skip != index + 1) {
      ++index;
      continue;
    }
    index = node.skip;
    const bool join = ends.size() > 1 && end - ends[ends.size() - 2] <= kMostSlots / 4;
    if (join)
      ends.back() = end;
    else
      ends.push_back(end);
  }
  return ends;
}

}  // namespace

std::optional<PatchPlan> planPatches(const Octree& tree, const GridShape& shape) {
  const Bounds bounds = tree.bounds();
  const dvec3 size(bounds.size());
  const double width = std::max({size.x, size.y, size.z});
  const double distance = shape.perspective() ? glm::length(dvec3(bounds.centre()) - shape.faces.front().origin) : 1;
  const double nodes = width / (shape.resolution.cell * distance), bins = width / shape.resolution.bin;
  PatchPlan plan;
  plan.mostNodes = static_cast<int>(std::clamp(nodes / kParts, kNodesFrom, kNodesTo));
  plan.mostBins = static_cast<int>(std::clamp(bins / kParts, kBinsFrom, kBinsTo)) / kGroupBins * kGroupBins;
  const std::vector<std::size_t> ends = runsOf(tree);
  const Planner planner(tree, shape, plan.mostNodes, plan.mostBins);
  std::vector<std::vector<GridPatch>> parts(ends.size() - 1);
  const std::size_t most = kMostPatches + tree.particleCount() / kLeastSlots;
  std::atomic<std::size_t> count = 0;
  std::atomic<bool> all = true;
  parallelBlocks(parts.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end && all; ++k)
      if (!planner.add(ends[k], ends[k + 1], parts[k]) || (count += parts[k].size()) > most) all = false;
  });
  if (!all) return {};
  for (auto& part : parts) std::move(part.begin(), part.end(), std::back_inserter(plan.patches));
  return plan;
}

}  // namespace mote
