#include "host/lighting/grid/plan.h"

#include <algorithm>
#include <cmath>

#include "host/core/bins.h"

namespace mote {
namespace {

constexpr double kRowTiles = 1 << 24, kFaceTiles = kRowTiles * kRowTiles;

/// Keys and flags of all points.
struct Located {
  RawVector<double> key;
  RawVector<std::uint8_t> flags;

  Located(std::span<const float> x, std::span<const float> y, std::span<const float> z, const float* radius,
          const GridShape& shape)
      : key(x.size()), flags(x.size()) {
    parallelBlocks(x.size(), 1 << 13, [&](std::size_t begin, std::size_t end) {
      locate({x.data() + begin, y.data() + begin, z.data() + begin, radius ? radius + begin : nullptr, end - begin},
             shape, key.data() + begin, flags.data() + begin);
    });
  }
};

/// Calls one(key) for each run of receivers of one tile that are reached.
template <class One>
void eachReached(const RawVector<double>& keyOf, std::span<const std::uint8_t> reached, std::size_t begin,
                 std::size_t end, const One& one) {
  double last = kNoTile;
  for (std::size_t k = begin; k < end; ++k)
    if (keyOf[k] != last && keyOf[k] != kNoTile && (reached.empty() || reached[k] != 0)) one(last = keyOf[k]);
}

/// Keys of the tiles that have receivers, ascending.
std::vector<double> tilesWithReceivers(const RawVector<double>& keyOf, std::span<const std::uint8_t> reached) {
  constexpr std::size_t kGrain = 1 << 16;
  std::vector<std::vector<double>> parts((keyOf.size() + kGrain - 1) / kGrain);
  const auto ascendingOnce = [](std::vector<double>& keys) {
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  };
  parallelBlocks(keyOf.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<double>& part = parts[begin / kGrain];
    eachReached(keyOf, reached, begin, end, [&](double key) { part.push_back(key); });
    ascendingOnce(part);
  });
  std::vector<double> keys;
  for (const auto& part : parts) keys.insert(keys.end(), part.begin(), part.end());
  ascendingOnce(keys);
  return keys;
}

/// Tiles by key: those before are looked at first, as neighbours mostly share theirs.
class TileLookup {
 public:
  static constexpr std::size_t kNone = ~std::size_t{0};
  explicit TileLookup(const std::vector<double>& keys) : keys_(keys) {}

  std::size_t operator()(double key) {
    if (key == last_) return tile_;
    const auto found = std::lower_bound(keys_.begin(), keys_.end(), key);
    last_ = key;
    return tile_ = found != keys_.end() && *found == key ? static_cast<std::size_t>(found - keys_.begin()) : kNone;
  }

 private:
  const std::vector<double>& keys_;
  double last_ = kNoTile;
  std::size_t tile_ = kNone;
};

/// Every tile that may have nodes of a particle's kernel.
class TilesOfParticle {
 public:
  TilesOfParticle(const std::vector<double>& keys, const GridShape& shape) : keys_(keys), shape_(shape) {
    for (const double key : keys) {
      const TilePlace tile = tileOfKey(key);
      const dvec2 place(tile.column, tile.row);
      Range& range = rows_[tile.face];
      range = range.empty ? Range{false, place, place} : Range{false, min(range.lo, place), max(range.hi, place)};
    }
  }

  template <class Put>
  void operator()(const vec3& position, float radius, const Put& put) const {
    for (std::size_t f = 0; f < shape_.faces.size(); ++f) {
      const LightFrame& face = shape_.faces[f];
      const dvec3 centre = dvec3(position) - face.origin;
      if (rows_[f].empty) continue;
      if (face.perspective && !(glm::dot(centre, face.axis) > kLeastCosine / 2 * glm::length(centre))) continue;
      const NodeRange nodes = nodeRange(centre, radius, face, shape_);
      const double size = shape_.tileCells;
      // A tile has the nodes on both of its edges. Rounding may go either way: a little more on each side.
      constexpr double kSlack = 1e-3;
      const dvec2 lo = max(floor((ceil(nodes.lo - kSlack) - 1.0) / size), rows_[f].lo),
                  hi = min(floor((nodes.hi + kSlack) / size), rows_[f].hi);
      if (!(lo.x <= hi.x)) continue;
      for (double row = lo.y; row <= hi.y; ++row) {
        const double last = tileKey({f, hi.x, row});
        auto at = std::lower_bound(keys_.begin(), keys_.end(), tileKey({f, lo.x, row}));
        for (; at != keys_.end() && *at <= last; ++at) put(static_cast<std::size_t>(at - keys_.begin()));
      }
    }
  }

 private:
  struct Range {
    bool empty = true;
    dvec2 lo{}, hi{};
  };
  const std::vector<double>& keys_;
  const GridShape& shape_;
  Range rows_[6];
};

/// Tile t's receivers have bin 2t, its other particles 2t + 1.
class Binning {
 public:
  Binning(const Octree& tree, const std::vector<double>& keys, const GridShape& shape)
      : tree_(tree), keys_(keys), tilesOf_(keys, shape) {
    // The tiles around each, row by row.
    TileLookup lookup(keys);
    for (const double key : keys)
      for (int side = 0; side < 9; ++side) around_.push_back(lookup(neighbour(key, side % 3 - 1, side / 3 - 1)));
  }

  template <class Put>
  void receivers(const Located& located, std::span<const std::uint8_t> reached, std::size_t begin, std::size_t end,
                 const Put& put) const {
    TileLookup lookup(keys_);
    for (std::size_t k = begin; k < end; ++k)
      if (located.key[k] != kNoTile && (reached.empty() || reached[k] != 0))
        put(2 * lookup(located.key[k]), static_cast<std::uint32_t>(k));
  }

  template <class Put>
  void particles(const Located& located, std::size_t begin, std::size_t end, const Put& put) const {
    TileLookup lookup(keys_);
    for (std::size_t slot = begin; slot < end; ++slot)
      particle(located, slot, TileLookup::kNone, lookup(located.key[slot]), put);
  }

  /// Receivers that are the slots.
  template <class Put>
  void slots(const Located& located, std::span<const std::uint8_t> reached, std::size_t begin, std::size_t end,
             const Put& put) const {
    TileLookup lookup(keys_);
    for (std::size_t slot = begin; slot < end; ++slot) {
      const std::size_t home = located.key[slot] == kNoTile ? TileLookup::kNone : lookup(located.key[slot]);
      if (home != TileLookup::kNone && located.flags[slot] == 0 && reached.empty()) {
        // Most stand within their tile, and so do their neighbours: a run.
        std::size_t last = slot + 1;
        while (last < end && located.key[last] == located.key[slot] && located.flags[last] == 0) ++last;
        put(2 * home, static_cast<std::uint32_t>(slot), static_cast<std::uint32_t>(last));
        slot = last - 1;
        continue;
      }
      const bool receives = home != TileLookup::kNone && (reached.empty() || reached[slot] != 0);
      if (receives) put(2 * home, static_cast<std::uint32_t>(slot));
      particle(located, slot, receives ? home : TileLookup::kNone, home, put);
    }
  }

 private:
  /// `but`: a tile that has it already; `home`: where its centre is.
  template <class Put>
  void particle(const Located& located, std::size_t slot, std::size_t but, std::size_t home, const Put& put) const {
    const std::uint8_t flags = located.flags[slot];
    if ((flags & (kNearLight | kPoint)) != 0) return;
    const auto other = [&](std::size_t tile) {
      if (tile != but) put(2 * tile + 1, static_cast<std::uint32_t>(slot));
    };
    if ((flags & kAnywhere) != 0) {
      tilesOf_(tree_.position(slot), tree_.radius[slot], other);
      return;
    }
    if (home != TileLookup::kNone) other(home);
    if (flags == 0) return;
    const int left = (flags & kLeft) != 0 ? -1 : 0, right = (flags & kRight) != 0 ? 1 : 0;
    const int below = (flags & kBelow) != 0 ? -1 : 0, above = (flags & kAbove) != 0 ? 1 : 0;
    for (int row = below; row <= above; ++row)
      for (int column = left; column <= right; ++column) {
        if (row == 0 && column == 0) continue;
        const std::size_t tile = home != TileLookup::kNone
                                     ? around_[9 * home + static_cast<std::size_t>(3 * (row + 1) + column + 1)]
                                     : TileLookup(keys_)(neighbour(located.key[slot], column, row));
        if (tile != TileLookup::kNone) other(tile);
      }
  }

  static double neighbour(double key, int columns, int rows) { return key + columns + rows * kRowTiles; }

  const Octree& tree_;
  const std::vector<double>& keys_;
  TilesOfParticle tilesOf_;
  std::vector<std::size_t> around_;
};

std::vector<LightFrame> facesOf(const layout::Light& light) {
  if (light.type == layout::kLightDirectional)
    return {frameAbout(dvec3(0), glm::normalize(dvec3(light.direction)), false)};
  std::vector<LightFrame> faces;
  for (int k = 0; k < 6; ++k) {
    dvec3 axis(0), u(0), v(0);
    axis[k / 2] = k % 2 == 0 ? 1 : -1, u[(k / 2 + 1) % 3] = 1, v[(k / 2 + 2) % 3] = 1;
    faces.push_back({true, dvec3(light.position), u, v, axis});
  }
  return faces;
}

std::vector<std::uint32_t> slotsNearLight(const Located& located) {
  std::vector<std::uint32_t> slots;
  for (std::size_t slot = 0; slot < located.flags.size(); ++slot)
    if ((located.flags[slot] & kNearLight) != 0) slots.push_back(static_cast<std::uint32_t>(slot));
  return slots;
}

}  // namespace

KernelMoments kernelMoments(layout::uint falloff) {
  switch (falloff) {
    case layout::kFalloffLinear: return {1.0 / 3, 0.15};
    case layout::kFalloffSphere: return {2.0 / 3, 0.2};
    default: return {1.0 / 3, 0.125};
  }
}

KernelWeights kernelWeights(layout::uint falloff) {
  switch (falloff) {
    case layout::kFalloffLinear: return {1.9, 0.65, 1, 0};
    case layout::kFalloffSphere: return {1.4, 0.4, 1, 0};
    default: return {2.25, 0.73, 0.75, 0.72};
  }
}

GridShape gridShape(const layout::Light& light, const GridResolution& resolution, layout::uint falloff) {
  return {facesOf(light), resolution, kTileCells, kernelMoments(falloff), kernelWeights(falloff)};
}

NodeRange curvedNodeRange(const dvec3& centre, double radius, const LightFrame& face, double cell) {
  const double z = glm::dot(centre, face.axis);
  const auto outline = [&](double across, double sign) {
    const double half = std::asin(std::min(radius / std::sqrt(across * across + z * z), 0.99));
    return std::tan(std::clamp(std::atan2(across, z) + sign * half, -1.4, 1.4)) / cell;
  };
  const double x = glm::dot(centre, face.u), y = glm::dot(centre, face.v);
  return {{outline(x, -1), outline(y, -1)}, {outline(x, 1), outline(y, 1)}};
}

NodeRange nodeRange(const dvec3& centre, double radius, const LightFrame& face, const GridShape& shape) {
  const double cell = shape.resolution.cell, z = face.perspective ? glm::dot(centre, face.axis) : 1;
  const double cells = radius / (z * cell), square = cells * cells;
  const double support = std::sqrt(shape.weights.supported(shape.weights.narrowed(square)));
  if (face.perspective && glm::length(centre) < kCurvedRadii * radius)
    return curvedNodeRange(centre, support * z * cell, face, cell);
  const dvec2 place(glm::dot(centre, face.u) / z, glm::dot(centre, face.v) / z);
  dvec2 half(1);
  if (square > shape.weights.tentBelow) half = support * (face.perspective ? sqrt(1.0 + place * place) : dvec2(1));
  return {place / cell - half, place / cell + half};
}

double tileKey(const TilePlace& tile) {
  const auto number = [](double x) { return std::clamp(x + kRowTiles / 2, 0.0, kRowTiles - 1); };
  return static_cast<double>(tile.face) * kFaceTiles + number(tile.row) * kRowTiles + number(tile.column);
}

TilePlace tileOfKey(double key) {
  const double face = std::floor(key / kFaceTiles), onFace = key - face * kFaceTiles;
  const double row = std::floor(onFace / kRowTiles);
  return {static_cast<std::size_t>(face), onFace - row * kRowTiles - kRowTiles / 2, row - kRowTiles / 2};
}

GridPlan planGrid(const Octree& tree, const Receivers& receivers, const GridShape& shape,
                  std::span<const std::uint8_t> reached) {
  const Receivers slots = slotsOf(tree);
  GridPlan plan;
  plan.receiversAreSlots = areSlotsOf(tree, receivers);
  const Located particles(slots.x, slots.y, slots.z, tree.radius.data(), shape);
  const Located points = plan.receiversAreSlots ? Located({}, {}, {}, nullptr, shape)
                                                : Located(receivers.x, receivers.y, receivers.z, nullptr, shape);
  const std::vector<double> keys = tilesWithReceivers(plan.receiversAreSlots ? particles.key : points.key, reached);
  const Binning binning(tree, keys, shape);
  Binned<std::uint32_t> binned;
  if (plan.receiversAreSlots)
    sortIntoBins(
        slots.size(), 2 * keys.size(),
        [&](std::size_t begin, std::size_t end, const auto& put) {
          binning.slots(particles, reached, begin, end, put);
        },
        binned);
  else  // first all receivers, then all particles
    sortIntoBins(
        receivers.size() + slots.size(), 2 * keys.size(),
        [&](std::size_t begin, std::size_t end, const auto& put) {
          const std::size_t split = std::clamp(receivers.size(), begin, end);
          binning.receivers(points, reached, begin, split, put);
          binning.particles(particles, split - receivers.size(), end - receivers.size(), put);
        },
        binned);
  for (std::size_t tile = 0; tile < keys.size(); ++tile)
    plan.tiles.push_back(
        {tileOfKey(keys[tile]), binned.start[2 * tile], binned.start[2 * tile + 1], binned.start[2 * tile + 2]});
  plan.items = std::move(binned.items);
  if (shape.perspective()) plan.nearLight = slotsNearLight(particles);
  return plan;
}

}  // namespace mote
