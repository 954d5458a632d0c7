#include "host/lighting/light_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/core/bins.h"
#include "host/core/cap.h"
#include "host/core/error.h"
#include "host/core/falloff.h"
#include "host/lighting/beam_kernel.h"
#include "host/lighting/grid_tile.h"

namespace mote {
namespace {

/// Receivers are counted into tiles by this many blocks.
constexpr std::uint64_t kNoTile = ~std::uint64_t{0};

/// The faces of a light: one plane, or the six of a cube along the world's axes.
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

/// Where receivers are: tile by tile.
struct TilePlan {
  struct Tile {
    std::size_t face;
    double column, row;  ///< of tiles
    std::size_t begin, end;
  };
  std::vector<Tile> tiles;
  std::vector<std::uint32_t> receiver;  ///< ascending in each tile
};

/// A tile as one number, in an order that keeps neighbours near: face, row, column.
struct TileKey {
  static constexpr std::int64_t kHalf = 1 << 29;
  static std::uint64_t of(std::size_t face, double column, double row) {
    const auto number = [](double tile) {
      return static_cast<std::uint64_t>(std::clamp(tile, -double(kHalf), double(kHalf - 1)) + double(kHalf));
    };
    return static_cast<std::uint64_t>(face) << 60 | number(row) << 30 | number(column);
  }
  static TilePlan::Tile tile(std::uint64_t key, std::size_t begin, std::size_t end) {
    const auto number = [](std::uint64_t bits) {
      return static_cast<double>(static_cast<std::int64_t>(bits & 0x3fffffff) - kHalf);
    };
    return {static_cast<std::size_t>(key >> 60), number(key), number(key >> 30), begin, end};
  }
};

std::uint64_t tileOf(const vec3& point, const std::vector<LightFrame>& faces, double tileSize) {
  const LightFrame& first = faces[0];
  if (!first.perspective) {
    const double u = glm::dot(dvec3(point), first.u), v = glm::dot(dvec3(point), first.v);
    return TileKey::of(0, std::floor(u / tileSize), std::floor(v / tileSize));
  }
  const dvec3 p = dvec3(point) - first.origin, size = glm::abs(p);
  const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
  if (size[axis] == 0) return kNoTile;
  const double u = p[(axis + 1) % 3] / size[axis], v = p[(axis + 2) % 3] / size[axis];
  return TileKey::of(static_cast<std::size_t>(2 * axis + (p[axis] < 0)), std::floor(u / tileSize),
                     std::floor(v / tileSize));
}

/// The distinct keys, ascending.
std::vector<std::uint64_t> distinct(const std::vector<std::uint64_t>& keyOf) {
  constexpr std::size_t kGrain = 1 << 16;
  std::vector<std::vector<std::uint64_t>> parts((keyOf.size() + kGrain - 1) / kGrain);
  const auto ascendingOnce = [](std::vector<std::uint64_t>& keys) {
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  };
  parallelBlocks(keyOf.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint64_t>& part = parts[begin / kGrain];
    std::uint64_t last = kNoTile;
    for (std::size_t k = begin; k < end; ++k)
      if (keyOf[k] != last && keyOf[k] != kNoTile) part.push_back(last = keyOf[k]);
    ascendingOnce(part);
  });
  std::vector<std::uint64_t> keys;
  for (const auto& part : parts) keys.insert(keys.end(), part.begin(), part.end());
  ascendingOnce(keys);
  return keys;
}

/// The receivers tile by tile.
TilePlan planTiles(const Receivers& receivers, const std::vector<LightFrame>& faces, double cell,
                   std::span<const std::uint8_t> reached) {
  std::vector<std::uint64_t> keyOf(receivers.size(), kNoTile);
  parallelBlocks(keyOf.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      if (reached.empty() || reached[k] != 0) keyOf[k] = tileOf(receivers.position(k), faces, cell * kTileCells);
  });
  const std::vector<std::uint64_t> keys = distinct(keyOf);
  const auto each = [&](std::size_t begin, std::size_t end, const auto& put) {
    std::uint64_t last = kNoTile;
    std::size_t tile = 0;
    for (std::size_t k = begin; k < end; ++k) {
      if (keyOf[k] == kNoTile) continue;
      if (keyOf[k] != last) {
        last = keyOf[k];
        tile = static_cast<std::size_t>(std::lower_bound(keys.begin(), keys.end(), last) - keys.begin());
      }
      put(tile, static_cast<std::uint32_t>(k));
    }
  };
  Binned<std::uint32_t> binned = sortIntoBins<std::uint32_t>(keyOf.size(), keys.size(), each);
  TilePlan plan;
  for (std::size_t tile = 0; tile < keys.size(); ++tile)
    plan.tiles.push_back(TileKey::tile(keys[tile], binned.start[tile], binned.start[tile + 1]));
  plan.receiver = std::move(binned.items);
  return plan;
}

/// Takes from each receiver what its own particle put into the grid. Receivers and gathered particles both ascend where
/// receivers are slots, so looking them up is one walk.
void removeOwn(const GridTile& tile, const Receivers& receivers, std::size_t channels, std::vector<float>& depths) {
  const std::vector<std::uint32_t>& slot = tile.column.gathered.slot;
  const auto begin = slot.begin(), end = begin + static_cast<std::ptrdiff_t>(tile.column.gathered.count);
  const std::size_t count = tile.receiver.size();
  auto at = begin;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t self = receivers.selfOf(tile.receiver[k]);
    if (self == kNoSlot) continue;
    int steps = 8;
    while (at != end && *at < self && --steps > 0) ++at;
    if (at == end || *at != self) at = std::lower_bound(begin, end, self);
    if (at == end || *at != self) continue;
    const auto index = static_cast<std::size_t>(at - begin);
    for (std::size_t c = 0; c < channels; ++c) {
      float& depth = depths[c * count + k];
      depth = std::max(depth - tile.column.gathered.peak[c][index] * tile.splats.own[index], 0.0f);
    }
  }
}

/// Adds what lies within a few radii of a point light, exactly.
void addNearLight(const GridTile& tile, const Receivers& receivers, const LightingOptions& options,
                  std::size_t channels, std::vector<float>& depths) {
  const GatheredParticles& found = tile.column.gathered;
  const dvec3& light = tile.frame.origin;
  const std::size_t count = tile.receiver.size();
  for (std::size_t i = 0; i < found.count; ++i) {
    if (tile.splats.place[i] != Place::NearLight) continue;
    const vec3 centre(dvec3(found.x[i], found.y[i], found.z[i]) - light);
    const float radius = found.radius[i], inverseSquare = inverseSquareOf(radius);
    for (std::size_t k = 0; k < count; ++k) {
      if (receivers.selfOf(tile.receiver[k]) == found.slot[i]) continue;
      const vec3 offset(dvec3(receivers.position(tile.receiver[k])) - light);
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
      for (std::size_t c = 0; c < channels; ++c) depths[c * count + k] += found.peak[c][i] * share;
    }
  }
}

/// Places of the tile's receivers, and how deep the deepest is [scene units].
double placeReceivers(GridTile& tile, const Receivers& receivers) {
  const std::size_t count = tile.receiver.size();
  tile.receiverX.resize(count), tile.receiverY.resize(count), tile.receiverDepth.resize(count);
  double deepest = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < count; ++k) {
    const dvec3 p = dvec3(receivers.position(tile.receiver[k])) - tile.frame.origin;
    const double z = glm::dot(p, tile.frame.axis), scale = (tile.frame.perspective ? 1 / z : 1) / tile.resolution.cell;
    const double depth = tile.frame.perspective ? glm::length(p) : z;
    if (k == 0) tile.depthBase = std::floor(depth / tile.resolution.bin);
    tile.receiverX[k] = static_cast<float>(glm::dot(p, tile.frame.u) * scale - tile.firstColumn);
    tile.receiverY[k] = static_cast<float>(glm::dot(p, tile.frame.v) * scale - tile.firstRow);
    tile.receiverDepth[k] = static_cast<float>(depth / tile.resolution.bin - tile.depthBase);
    deepest = std::max(deepest, depth);
  }
  return deepest;
}

}  // namespace

KernelMoments kernelMoments(layout::uint falloff) {
  switch (falloff) {
    case layout::kFalloffLinear: return {1.0 / 3, 0.15};
    case layout::kFalloffSphere: return {2.0 / 3, 0.2};
    default: return {1.0 / 3, 0.125};
  }
}

void GridTile::Splats::resize(std::size_t count) {
  const std::size_t size = count + 2 * kGridLanes;
  if (x.size() >= size) return;
  for (auto* array : {&x, &y, &depth, &depthRadius, &a, &b, &c, &mass, &own, &curved}) array->resize(size + size / 2);
  place.resize(size + size / 2);
}

std::vector<float> gridOpticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                     const LightingOptions& options, const GridResolution& resolution,
                                     std::span<const std::uint8_t> reached, const RaysDone& done) {
  MOTE_CHECK(resolution.cell, >, 0.0);
  MOTE_CHECK(resolution.bin, >, 0.0);
  const std::size_t channels = tree.channels();
  std::vector<float> depths(channels * receivers.size(), 0.0f);
  if (shadowless(light) || tree.particleCount() == 0) return depths;
  const std::vector<LightFrame> faces = facesOf(light);
  const TilePlan plan = planTiles(receivers, faces, resolution.cell, reached);
  const float slack = columnRules(tree, light, receivers.bounds()).slack;
  parallelBlocks(plan.tiles.size(), 1, [&](std::size_t t, std::size_t) {
    static thread_local GridTile tile;
    const TilePlan::Tile& where = plan.tiles[t];
    tile.frame = faces[where.face];
    tile.resolution = resolution;
    tile.falloff = options.falloff;
    tile.moments = kernelMoments(options.falloff);
    tile.firstColumn = where.column * kTileCells, tile.firstRow = where.row * kTileCells;
    tile.receiver.assign(plan.receiver.begin() + static_cast<std::ptrdiff_t>(where.begin),
                         plan.receiver.begin() + static_cast<std::ptrdiff_t>(where.end));
    const double deepest = placeReceivers(tile, receivers);
    // One cell more on each side: small particles are put down wider than they are.
    const dvec2 corner(tile.firstColumn, tile.firstRow), cells(kTileCells);
    tile.column.planes = planesAround(tile.frame, (corner - 1.0) * resolution.cell,
                                      (corner + cells + 1.0) * resolution.cell, deepest, slack);
    simdBeamKernel().gather(tree, tile.column);
    placeSplats(tile);
    fillTile(tile, channels);
    static thread_local std::vector<float> read;
    readTile(tile, channels, read);
    removeOwn(tile, receivers, channels, read);
    const std::size_t count = tile.receiver.size();
    addNearLight(tile, receivers, options, channels, read);
    for (std::size_t c = 0; c < channels; ++c)
      for (std::size_t k = 0; k < count; ++k) depths[c * receivers.size() + tile.receiver[k]] = read[c * count + k];
    if (done) done(count);
  });
  return depths;
}

}  // namespace mote
