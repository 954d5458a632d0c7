// The steps of a tile of a light grid, compiled once for each instruction set (Google Highway). Vectors are eight wide
// whatever the machine has, and no multiply-add is fused, so every instruction set gives the same bits.
#include <algorithm>
#include <cmath>
#include <utility>

#include "host/lighting/grid_tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/grid_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, kGridLanes>;
using Vec = hn::Vec<Tag>;
constexpr Tag kTag;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));
constexpr int kVectors = kGridLanes / kLanes;

// ---- place

using Wide = hn::CappedTag<double, 8>;
using Narrow = hn::Rebind<float, Wide>;
using WideVec = hn::Vec<Wide>;
constexpr Wide kWide;
constexpr Narrow kNarrow;

HWY_INLINE WideVec set(double value) { return hn::Set(kWide, value); }
HWY_INLINE WideVec widen(const float* from) { return hn::PromoteTo(kWide, hn::LoadU(kNarrow, from)); }
HWY_INLINE void store(WideVec value, float* to) { hn::StoreU(hn::DemoteTo(kNarrow, value), kNarrow, to); }
HWY_INLINE WideVec along(WideVec x, WideVec y, WideVec z, const dvec3& axis) {
  return hn::Add(hn::Add(hn::Mul(x, set(axis.x)), hn::Mul(y, set(axis.y))), hn::Mul(z, set(axis.z)));
}

/// Narrowed by the variance that the interpolation adds (a tent over a cell: 1/6 of its square along each axis), but
/// never so much that no node is covered.
constexpr double kTentVariance = 1.0 / 6, kLeastRadius = 1.05;

template <bool kPerspective>
HWY_NOINLINE void placeAll(GridTile& tile) {
  const LightFrame& frame = tile.frame;
  const GatheredParticles& found = tile.column.gathered;
  GridTile::Splats& splats = tile.splats;
  splats.resize(found.count);
  const WideVec perCell = set(1 / tile.resolution.cell), perBin = set(1 / tile.resolution.bin), one = set(1);
  const WideVec narrowing = set(kTentVariance / tile.moments.variance), least = set(kLeastRadius * kLeastRadius);
  const WideVec mass = set(kPi * tile.moments.mass);
  for (std::size_t i = 0; i < found.count; i += hn::Lanes(kWide)) {
    const WideVec r = widen(&found.radius[i]);
    const WideVec px = hn::Sub(widen(&found.x[i]), set(frame.origin.x)),
                  py = hn::Sub(widen(&found.y[i]), set(frame.origin.y)),
                  pz = hn::Sub(widen(&found.z[i]), set(frame.origin.z));
    const WideVec x = along(px, py, pz, frame.u), y = along(px, py, pz, frame.v), z = along(px, py, pz, frame.axis);
    WideVec u = x, v = y, depth = z, cells = hn::Mul(r, perCell);  // cells: the radius in nodes on the axis
    WideVec sag = hn::Zero(kWide);
    WideVec formA = one, formB = hn::Zero(kWide), formC = one, stretch = one;
    if constexpr (kPerspective) {
      depth = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
      u = hn::Div(x, z), v = hn::Div(y, z), cells = hn::Div(cells, z);
      sag = hn::Div(hn::Mul(set(tile.moments.variance), hn::Mul(r, r)), depth);  // ⟨b²⟩ / 2ρ
      // b² = z² · (Δu² + Δv² + (Δu·v − Δv·u)²) / n, n = 1 + u² + v² (column.h): an ellipse of the area π (r/z)² √n.
      const WideVec uu = hn::Mul(u, u), vv = hn::Mul(v, v), n = hn::Add(one, hn::Add(uu, vv));
      formA = hn::Div(hn::Add(one, vv), n), formC = hn::Div(hn::Add(one, uu), n);
      formB = hn::Div(hn::Mul(set(-2), hn::Mul(u, v)), n);
      stretch = hn::Sqrt(n);
      std::uint8_t nearBits[8] = {}, aheadBits[8] = {};
      hn::StoreMaskBits(kWide, hn::Lt(depth, hn::Mul(set(kNearLightRadii / 2), r)), nearBits);
      hn::StoreMaskBits(kWide, hn::Gt(z, hn::Mul(set(kLeastCosine / 2), depth)), aheadBits);
      for (std::size_t lane = 0; lane < hn::Lanes(kWide); ++lane)
        splats.place[i + lane] = nearBits[0] >> lane & 1    ? Place::NearLight
                                 : aheadBits[0] >> lane & 1 ? Place::Sorted
                                                            : Place::Behind;
    } else {
      for (std::size_t lane = 0; lane < hn::Lanes(kWide); ++lane) splats.place[i + lane] = Place::Sorted;
    }
    const WideVec square = hn::Max(hn::Sub(hn::Mul(cells, cells), narrowing), least);
    store(hn::Sub(hn::Mul(u, perCell), set(tile.firstColumn)), &splats.x[i]);
    store(hn::Sub(hn::Mul(v, perCell), set(tile.firstRow)), &splats.y[i]);
    store(hn::Sub(hn::Mul(depth, perBin), set(tile.depthBase)), &splats.own[i]);
    store(hn::Sub(hn::Mul(hn::Sub(depth, sag), perBin), set(tile.depthBase)), &splats.depth[i]);
    store(hn::Mul(r, perBin), &splats.depthRadius[i]);
    store(hn::Div(formA, square), &splats.a[i]);
    store(hn::Div(formB, square), &splats.b[i]);
    store(hn::Div(formC, square), &splats.c[i]);
    WideVec total = hn::Mul(hn::Mul(mass, hn::Mul(cells, cells)), stretch);
    WideVec curved = hn::Zero(kWide);
    if constexpr (kPerspective) {
      const auto near = hn::Lt(depth, hn::Mul(set(kCurvedRadii), r));
      const WideVec full = hn::Div(hn::Mul(hn::Div(hn::Mul(z, z), hn::Mul(r, r)), hn::Mul(cells, cells)), square);
      curved = hn::IfThenElseZero(near, full);
      // Over the solid angle: ∫ F dΩ = π · mass · s² · (1 + variance · s²) with s = r/ρ, to the second order.
      const WideVec s = hn::Div(r, depth), s2 = hn::Mul(s, s);
      const WideVec angle = hn::Mul(hn::Mul(mass, s2), hn::Add(one, hn::Mul(set(tile.moments.variance), s2)));
      total = hn::IfThenElse(near, hn::Mul(angle, hn::Mul(perCell, perCell)), total);
    }
    store(curved, &splats.curved[i]);
    store(total, &splats.mass[i]);
  }
}

void place(GridTile& tile) { return tile.frame.perspective ? placeAll<true>(tile) : placeAll<false>(tile); }

// ---- fill

template <layout::uint kFalloff>
HWY_INLINE Vec falloffOf(Vec q) {
  const Vec one = hn::Set(kTag, 1.0f), zero = hn::Zero(kTag);
  if constexpr (kFalloff == layout::kFalloffLinear) return hn::Max(hn::Sub(one, hn::Sqrt(q)), zero);
  const Vec u = hn::Max(hn::Sub(one, q), zero);
  if constexpr (kFalloff == layout::kFalloffSphere) return hn::Sqrt(u);
  return hn::Mul(u, u);
}

/// The nodes that a splat covers: rows of whole vectors.
struct Footprint {
  int x0, y0, vectors, rows;
  float* values;
  float* row(int y) const {
    return values + static_cast<std::size_t>(y) * static_cast<std::size_t>(vectors) * kGridLanes;
  }
  float at(int x, int y) const {
    const int column = x - x0, r = y - y0;
    return column < 0 || r < 0 || column >= vectors * kGridLanes || r >= rows ? 0.0f : row(r)[column];
  }
};

/// F at the nodes of one splat; the sum of them all.
template <layout::uint kFalloff>
HWY_INLINE float drawFootprint(GridTile& tile, std::size_t i, Footprint& f) {
  const GridTile::Splats& s = tile.splats;
  const float x = s.x[i], y = s.y[i], a = s.a[i], b = s.b[i], c = s.c[i];
  // Half widths of the ellipse a·x² + b·x·y + c·y² = 1.
  const float determinant = a * c - 0.25f * (b * b);
  const float halfX = std::sqrt(c / determinant), halfY = std::sqrt(a / determinant);
  f.x0 = static_cast<int>(std::ceil(x - halfX)), f.y0 = static_cast<int>(std::ceil(y - halfY));
  f.rows = std::max(static_cast<int>(std::floor(y + halfY)) - f.y0 + 1, 0);
  f.vectors = (static_cast<int>(std::floor(x + halfX)) - f.x0) / kGridLanes + 1;
  const std::size_t size = static_cast<std::size_t>(f.rows) * static_cast<std::size_t>(f.vectors) * kGridLanes;
  if (tile.footprint.size() < size) tile.footprint.resize(2 * size);
  f.values = tile.footprint.data();
  Vec sums[kVectors];
  for (int v = 0; v < kVectors; ++v) sums[v] = hn::Zero(kTag);
  for (int row = 0; row < f.rows; ++row) {
    const float dy = static_cast<float>(f.y0 + row) - y;
    const Vec cdy2 = hn::Set(kTag, c * (dy * dy)), bdy = hn::Set(kTag, b * dy), av = hn::Set(kTag, a);
    float* values = f.row(row);
    for (int chunk = 0; chunk < f.vectors; ++chunk)
      for (int v = 0; v < kVectors; ++v) {
        const auto first = static_cast<float>(f.x0 + chunk * kGridLanes + v * kLanes);
        const Vec dx = hn::Sub(hn::Add(hn::Iota(kTag, 0), hn::Set(kTag, first)), hn::Set(kTag, x));
        const Vec q = hn::Add(hn::Mul(hn::Add(hn::Mul(av, dx), bdy), dx), cdy2);
        const Vec value = falloffOf<kFalloff>(hn::Max(q, hn::Zero(kTag)));
        hn::StoreU(value, kTag, values + chunk * kGridLanes + v * kLanes);
        sums[v] = hn::Add(sums[v], value);
      }
  }
  alignas(32) float lanes[kGridLanes];
  for (int v = 0; v < kVectors; ++v) hn::Store(sums[v], kTag, lanes + v * kLanes);
  return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}

/// The same with q by its full formula, and the sum weighted by the solid angle of each node's cell.
template <layout::uint kFalloff>
HWY_NOINLINE float drawCurvedFootprint(GridTile& tile, std::size_t i, Footprint& f) {
  const GridTile::Splats& s = tile.splats;
  const GatheredParticles& found = tile.column.gathered;
  const double cell = tile.resolution.cell;
  const float k = s.curved[i];
  // The sphere's outline on the plane, as wide as its narrowed or widened kernel.
  const dvec3 p = dvec3(found.x[i], found.y[i], found.z[i]) - tile.frame.origin;
  const double x = glm::dot(p, tile.frame.u), y = glm::dot(p, tile.frame.v), z = glm::dot(p, tile.frame.axis);
  const double r = z / std::sqrt(static_cast<double>(k));
  const auto outline = [&](double across, double sign) {
    const double half = std::asin(std::min(r / std::sqrt(across * across + z * z), 0.99));
    const double angle = std::clamp(std::atan2(across, z) + sign * half, -1.4, 1.4);
    return std::tan(angle) / cell;
  };
  f.x0 = static_cast<int>(std::ceil(outline(x, -1) - tile.firstColumn));
  f.y0 = static_cast<int>(std::ceil(outline(y, -1) - tile.firstRow));
  f.vectors = (static_cast<int>(std::floor(outline(x, 1) - tile.firstColumn)) - f.x0) / kGridLanes + 1;
  f.rows = std::max(static_cast<int>(std::floor(outline(y, 1) - tile.firstRow)) - f.y0 + 1, 0);
  const std::size_t size = static_cast<std::size_t>(f.rows) * static_cast<std::size_t>(f.vectors) * kGridLanes;
  if (tile.footprint.size() < size) tile.footprint.resize(2 * size);
  f.values = tile.footprint.data();
  const auto pu = static_cast<float>(x / z), pv = static_cast<float>(y / z), step = static_cast<float>(cell);
  const Vec one = hn::Set(kTag, 1.0f), scale = hn::Set(kTag, k);
  Vec sums[kVectors];
  for (int v = 0; v < kVectors; ++v) sums[v] = hn::Zero(kTag);
  for (int row = 0; row < f.rows; ++row) {
    const auto nodeV = static_cast<float>((f.y0 + row + tile.firstRow) * cell);
    const Vec v2 = hn::Set(kTag, nodeV), dv = hn::Set(kTag, pv - nodeV), dv2 = hn::Mul(dv, dv);
    float* values = f.row(row);
    for (int chunk = 0; chunk < f.vectors; ++chunk)
      for (int v = 0; v < kVectors; ++v) {
        const auto first = static_cast<float>(f.x0 + chunk * kGridLanes + v * kLanes + tile.firstColumn);
        const Vec u = hn::Mul(hn::Add(hn::Iota(kTag, 0), hn::Set(kTag, first)), hn::Set(kTag, step));
        const Vec du = hn::Sub(hn::Set(kTag, pu), u), cross = hn::Sub(hn::Mul(du, v2), hn::Mul(dv, u));
        const Vec n = hn::Add(one, hn::Add(hn::Mul(u, u), hn::Mul(v2, v2)));
        const Vec b2 = hn::Add(hn::Add(hn::Mul(du, du), dv2), hn::Mul(cross, cross));
        const Vec value = falloffOf<kFalloff>(hn::Div(hn::Mul(b2, scale), n));
        hn::StoreU(value, kTag, values + chunk * kGridLanes + v * kLanes);
        sums[v] = hn::Add(sums[v], hn::Div(value, hn::Mul(n, hn::Sqrt(n))));
      }
  }
  alignas(32) float lanes[kGridLanes];
  for (int v = 0; v < kVectors; ++v) hn::Store(sums[v], kTag, lanes + v * kLanes);
  return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}

/// What a receiver at the splat's own place finds of it, relative to `scale` · F.
HWY_INLINE float ownShare(const GridTile& tile, std::size_t i, const Footprint& f, float scale, float receiverDepth) {
  const GridTile::Splats& s = tile.splats;
  const float fx = std::floor(s.x[i]), fy = std::floor(s.y[i]), fd = std::floor(receiverDepth);
  const int x = static_cast<int>(fx), y = static_cast<int>(fy);
  const float wx = s.x[i] - fx, wy = s.y[i] - fy, wd = receiverDepth - fd;
  const float lower = f.at(x, y) + wx * (f.at(x + 1, y) - f.at(x, y));
  const float upper = f.at(x, y + 1) + wx * (f.at(x + 1, y + 1) - f.at(x, y + 1));
  const float inverse = 1.0f / s.depthRadius[i];
  const float before = depthShare((fd - s.depth[i]) * inverse), after = depthShare((fd + 1.0f - s.depth[i]) * inverse);
  return scale * (lower + wy * (upper - lower)) * (before + wd * (after - before));
}

template <layout::uint kFalloff>
HWY_NOINLINE void fillAll(GridTile& tile, int channels) {
  GridTile::Splats& s = tile.splats;
  const GatheredParticles& found = tile.column.gathered;
  for (std::size_t i = 0; i < found.count; ++i) {
    const float receiverDepth = std::exchange(s.own[i], 0.0f);
    if (s.place[i] != Place::Sorted) continue;
    Footprint f;
    const float sum = s.curved[i] > 0 ? drawCurvedFootprint<kFalloff>(tile, i, f) : drawFootprint<kFalloff>(tile, i, f);
    if (!(sum > 0)) continue;
    const float scale = s.mass[i] / sum, depth = s.depth[i], radius = s.depthRadius[i], inverse = 1.0f / radius;
    s.own[i] = ownShare(tile, i, f, scale, receiverDepth);
    const int rowBegin = std::max(f.y0, 0), rowEnd = std::min(f.y0 + f.rows, kTileRows);
    const int chunkBegin = f.x0 >= 0 ? 0 : (-f.x0) / kGridLanes;
    const int first = static_cast<int>(std::floor(depth - radius)), last = static_cast<int>(std::floor(depth + radius));
    float before = 0;
    for (int bin = std::max(first, tile.firstLayer); bin <= last && bin < tile.firstLayer + tile.layers; ++bin) {
      const float after = depthShare((static_cast<float>(bin + 1) - depth) * inverse);
      const float share = scale * (after - before);
      before = after;
      for (int channel = 0; channel < channels; ++channel) {
        const Vec weight = hn::Set(kTag, found.peak[channel][i] * share);
        float* layer = tile.layer(channel, bin - tile.firstLayer + 1);
        for (int y = rowBegin; y < rowEnd; ++y) {
          const float* values = f.row(y - f.y0);
          float* row = layer + static_cast<std::size_t>(y) * kTileStride;
          for (int chunk = chunkBegin; chunk < f.vectors; ++chunk) {
            const int x = f.x0 + chunk * kGridLanes;
            if (x > kTileCells) break;
            if (x >= 0) {
              for (int v = 0; v < kVectors; ++v) {
                const Vec value = hn::Mul(weight, hn::LoadU(kTag, values + chunk * kGridLanes + v * kLanes));
                float* to = row + x + v * kLanes;
                hn::StoreU(hn::Add(hn::LoadU(kTag, to), value), kTag, to);
              }
            } else {
              for (int lane = -x; lane < kGridLanes; ++lane)
                row[x + lane] += found.peak[channel][i] * share * values[chunk * kGridLanes + lane];
            }
          }
        }
      }
    }
  }
}

HWY_NOINLINE void sumLayers(GridTile& tile, int channels) {
  constexpr std::size_t kLayer = std::size_t{kTileRows} * kTileStride;
  for (int channel = 0; channel < channels; ++channel)
    for (int edge = 2; edge <= tile.layers; ++edge) {
      const float* before = tile.layer(channel, edge - 1);
      float* here = tile.layer(channel, edge);
      for (std::size_t n = 0; n < kLayer; n += kLanes)
        hn::StoreU(hn::Add(hn::LoadU(kTag, here + n), hn::LoadU(kTag, before + n)), kTag, here + n);
    }
}

/// Layers from the first particle to the deepest receiver.
void allotLayers(GridTile& tile, int channels) {
  const GridTile::Splats& s = tile.splats;
  float nearest = std::numeric_limits<float>::infinity(), deepest = -nearest;
  for (std::size_t i = 0; i < tile.column.gathered.count; ++i)
    if (s.place[i] == Place::Sorted) nearest = std::min(nearest, s.depth[i] - s.depthRadius[i]);
  for (const float depth : tile.receiverDepth) deepest = std::max(deepest, depth);
  tile.layers = 0;
  if (!(nearest < deepest)) return;
  tile.firstLayer = static_cast<int>(std::floor(nearest));
  tile.layers = static_cast<int>(std::floor(deepest)) - tile.firstLayer + 1;
  const std::size_t size = static_cast<std::size_t>(tile.layers + 1) * kTileRows * kTileStride;
  for (int channel = 0; channel < channels; ++channel) tile.nodes[channel].assign(size, 0.0f);
}

void fill(GridTile& tile, std::size_t channelCount) {
  const int channels = static_cast<int>(channelCount);
  allotLayers(tile, channels);
  switch (tile.falloff) {
    case layout::kFalloffLinear: fillAll<layout::kFalloffLinear>(tile, channels); break;
    case layout::kFalloffSphere: fillAll<layout::kFalloffSphere>(tile, channels); break;
    default: fillAll<layout::kFalloffSmooth>(tile, channels); break;
  }
  sumLayers(tile, channels);
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(place);
HWY_EXPORT(fill);

void placeSplats(GridTile& tile) { HWY_DYNAMIC_DISPATCH(place)(tile); }
void fillTile(GridTile& tile, std::size_t channels) { HWY_DYNAMIC_DISPATCH(fill)(tile, channels); }

void readTile(const GridTile& tile, std::size_t channels, std::vector<float>& depths) {
  const std::size_t count = tile.receiver.size();
  depths.assign(channels * count, 0.0f);
  if (tile.layers == 0) return;
  constexpr std::size_t kLayer = std::size_t{kTileRows} * kTileStride;
  const auto lastCell = static_cast<float>(kTileCells - 1);
  for (std::size_t k = 0; k < count; ++k) {
    const float depth = tile.receiverDepth[k] - static_cast<float>(tile.firstLayer);
    if (depth <= 0) continue;
    const float fx = std::min(std::max(std::floor(tile.receiverX[k]), 0.0f), lastCell),
                fy = std::min(std::max(std::floor(tile.receiverY[k]), 0.0f), lastCell), fd = std::floor(depth);
    const float wx = tile.receiverX[k] - fx, wy = tile.receiverY[k] - fy, wd = depth - fd;
    const std::size_t at = static_cast<std::size_t>(fd) * kLayer + static_cast<std::size_t>(fy) * kTileStride +
                           static_cast<std::size_t>(fx);
    for (std::size_t c = 0; c < channels; ++c) {
      const float* n = tile.nodes[c].data() + at;
      const auto across = [&](const float* p) {
        const float lower = p[0] + wx * (p[1] - p[0]);
        const float upper = p[kTileStride] + wx * (p[kTileStride + 1] - p[kTileStride]);
        return lower + wy * (upper - lower);
      };
      const float before = across(n), after = across(n + kLayer);
      depths[c * count + k] = before + wd * (after - before);
    }
  }
}

}  // namespace mote
#endif
