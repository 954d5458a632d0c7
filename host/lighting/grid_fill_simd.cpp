// Kernels put down in a tile of a light grid, sums along the depth, and what receivers read, compiled once for each
// instruction set (Google Highway).
//
// What is computed for a particle alone goes a vector of particles at a time; what it adds to its nodes, a group of
// bins at a time, four wide on every machine. No multiply-add is fused, so every instruction set gives the same bits.
#include <algorithm>
#include <cmath>

#include "host/lighting/grid_tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/grid_fill_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, kGridBatch>;
using IntTag = hn::RebindToSigned<Tag>;
using Vec = hn::Vec<Tag>;
using IntVec = hn::Vec<IntTag>;
constexpr Tag kTag;
constexpr IntTag kIntTag;
constexpr std::size_t kLanes = hn::MaxLanes(Tag());

using GroupTag = hn::CappedTag<float, kGroupBins>;
constexpr GroupTag kGroupTag;
constexpr std::size_t kGroupLanes = hn::MaxLanes(GroupTag());  // one where there are no vectors

HWY_INLINE Vec set(float value) { return hn::Set(kTag, value); }
HWY_INLINE Vec load(const float* from) { return hn::LoadU(kTag, from); }

/// Numbers of a group's bins.
struct Group {
  hn::Vec<GroupTag> part[kGroupBins / kGroupLanes];
};
template <class Each>
HWY_INLINE Group eachPart(const Each& each) {
  Group group;
  for (std::size_t k = 0; k < kGroupBins / kGroupLanes; ++k) group.part[k] = each(k);
  return group;
}
HWY_INLINE Group scaled(const float* from, float factor) {
  return eachPart(
      [&](std::size_t k) { return hn::Mul(hn::LoadU(kGroupTag, from + k * kGroupLanes), hn::Set(kGroupTag, factor)); });
}
HWY_INLINE void addTo(float* to, float weight, const Group& shares) {
  for (std::size_t k = 0; k < kGroupBins / kGroupLanes; ++k) {
    float* at = to + k * kGroupLanes;
    const auto share = hn::Mul(hn::Set(kGroupTag, weight), shares.part[k]);
    hn::StoreU(hn::Add(hn::LoadU(kGroupTag, at), share), kGroupTag, at);
  }
}

template <layout::uint kFalloff, class D, class V>
HWY_INLINE V falloffOf(D d, V q) {
  const V one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  if constexpr (kFalloff == layout::kFalloffLinear) return hn::Max(hn::Sub(one, hn::Sqrt(hn::Max(q, zero))), zero);
  const V u = hn::Max(hn::Sub(one, q), zero);
  if constexpr (kFalloff == layout::kFalloffSphere) return hn::Sqrt(u);
  return hn::Mul(u, u);
}

/// depthShare, lane by lane.
template <class D, class V>
HWY_INLINE V depthShares(D d, V x) {
  const V a = hn::Min(hn::Abs(x), hn::Set(d, 1.0f)), a2 = hn::Mul(a, a);
  const V half = hn::Add(hn::Sub(hn::Mul(hn::Set(d, 0.9f), a), hn::Mul(hn::Set(d, 0.5f), hn::Mul(a2, a))),
                         hn::Mul(hn::Set(d, 0.1f), hn::Mul(hn::Mul(a2, a2), a2)));
  return hn::Add(hn::Set(d, 0.5f), hn::CopySignToAbs(half, x));
}

// ---- what a batch of particles puts down

/// The share of each that its own place sees along the depth: between the edges of the bin, as a receiver reads.
HWY_INLINE Vec ownDepthShare(const GridParticles& p, std::size_t i, Vec depth, Vec inverse) {
  const Vec bin = hn::ConvertTo(kTag, hn::LoadU(kIntTag, &p.points.bin[i])),
            into = hn::Sub(load(&p.points.depth[i]), bin);
  const Vec before = depthShares(kTag, hn::Mul(hn::Sub(bin, depth), inverse));
  const Vec after = depthShares(kTag, hn::Mul(hn::Sub(hn::Add(bin, set(1)), depth), inverse));
  return hn::Add(before, hn::Mul(into, hn::Sub(after, before)));
}

/// A window of n × n nodes has all that are nearer than n/2 to the centre in either direction.
struct Batch {
  alignas(64) float weight[kMostWindow * kMostWindow][kGridBatch];  ///< F at the window's nodes, row by row
  alignas(64) float share[kMostGroups][kGridBatch * kGroupBins];    ///< of the bins of each group, particle by particle
  alignas(64) float scale[kGridBatch];                              ///< of weights, for a peak of 1
  alignas(64) float own[kGridBatch];                                ///< GridParticles::own
  alignas(64) std::int32_t column[kGridBatch], row[kGridBatch];     ///< where the window begins
};

/// Shares of the bins, from the group of the first bin on.
HWY_INLINE void shareBins(const GridParticles& p, std::size_t i, std::size_t lane, Vec depth, Vec inverse,
                          Batch& batch) {
  const IntVec group = hn::ShiftRight<2>(hn::LoadU(kIntTag, &p.firstBin[i]));
  static_assert(kGroupBins == 4);
  const Vec begin = hn::ConvertTo(kTag, hn::ShiftLeft<2>(group));
  Vec before = hn::Zero(kTag);  // nothing lies before the first bin
  for (int g = 0; g < kMostGroups; ++g) {
    Vec share[kGroupBins];
    for (int k = 0; k < kGroupBins; ++k) {
      const Vec end = hn::Add(begin, set(static_cast<float>(g * kGroupBins + k + 1)));
      const Vec after = depthShares(kTag, hn::Mul(hn::Sub(end, depth), inverse));
      share[k] = hn::Sub(after, before);
      before = after;
    }
    hn::StoreInterleaved4(share[0], share[1], share[2], share[3], kTag, batch.share[g] + kGroupBins * lane);
  }
}

/// A window along one axis: where it begins, the centre's place in it, and in the cell there.
template <int kNodes>
struct Window {
  Vec begin, at, into;
  hn::Mask<Tag> late;  ///< an odd window whose middle node lies behind the centre

  explicit Window(Vec x) {
    const Vec below = hn::Floor(x), middle = kNodes % 2 == 0 ? below : hn::Floor(hn::Add(x, set(0.5f)));
    begin = hn::Sub(middle, set(static_cast<float>((kNodes - 1) / 2)));
    at = hn::Sub(x, begin), into = hn::Sub(x, below);
    late = hn::Gt(middle, below);
  }
};

HWY_INLINE Vec between(Vec from, Vec to, Vec at) { return hn::Add(from, hn::Mul(at, hn::Sub(to, from))); }

template <layout::uint kFalloff, int kNodes>
HWY_INLINE void weigh(const GridParticles& p, std::size_t first, Batch& batch) {
  constexpr int kBelow = (kNodes - 1) / 2;  // the node below the centre, or the middle one
  for (std::size_t lane = 0; lane < kGridBatch; lane += kLanes) {
    const std::size_t i = first + lane;
    const Window<kNodes> x(load(&p.points.x[i])), y(load(&p.points.y[i]));
    hn::StoreU(hn::ConvertTo(kIntTag, x.begin), kIntTag, batch.column + lane);
    hn::StoreU(hn::ConvertTo(kIntTag, y.begin), kIntTag, batch.row + lane);
    const Vec a = load(&p.a[i]), b = load(&p.b[i]), c = load(&p.c[i]), one = set(1);
    Vec sum = hn::Zero(kTag), near[3];  // what lies about the centre in the rows from kBelow − 1 on
    for (int row = 0; row < kNodes; ++row) {
      const Vec dy = hn::Sub(set(static_cast<float>(row)), y.at);
      const Vec cdy2 = hn::Mul(c, hn::Mul(dy, dy)), bdy = hn::Mul(b, dy);
      Vec values[kNodes];
      for (int column = 0; column < kNodes; ++column) {
        const Vec dx = hn::Sub(set(static_cast<float>(column)), x.at);
        if constexpr (kNodes == 2) {  // a tent
          values[column] = hn::Mul(hn::Sub(one, hn::Abs(dx)), hn::Sub(one, hn::Abs(dy)));
        } else {
          values[column] = falloffOf<kFalloff>(kTag, hn::Add(hn::Mul(hn::Add(hn::Mul(a, dx), bdy), dx), cdy2));
        }
        sum = hn::Add(sum, values[column]);
        hn::StoreU(values[column], kTag, batch.weight[row * kNodes + column] + lane);
      }
      if (row < kBelow - 1 || row > kBelow + 1) continue;
      Vec lower = values[kBelow], upper = values[kBelow + 1];
      if constexpr (kNodes % 2 == 1)
        lower = hn::IfThenElse(x.late, values[kBelow - 1], lower),
        upper = hn::IfThenElse(x.late, values[kBelow], upper);
      near[row - kBelow + 1] = between(lower, upper, x.into);
    }
    Vec lower = near[1], upper = near[2];
    if constexpr (kNodes % 2 == 1)
      lower = hn::IfThenElse(y.late, near[0], lower), upper = hn::IfThenElse(y.late, near[1], upper);
    const Vec depth = load(&p.depth[i]), inverse = hn::Div(one, load(&p.depthRadius[i]));
    const Vec scale = hn::Div(load(&p.mass[i]), sum);
    hn::StoreU(scale, kTag, batch.scale + lane);
    shareBins(p, i, lane, depth, inverse, batch);
    const Vec across = hn::Mul(scale, between(lower, upper, y.into));
    hn::StoreU(hn::Mul(across, ownDepthShare(p, i, depth, inverse)), kTag, batch.own + lane);
  }
}

// ---- the same for who puts them down elsewhere

/// Nodes across that have all of a batch's kernels, an even number, and which of them are tents.
struct BatchWindow {
  int nodes = 2;
  alignas(64) float tent[kGridBatch] = {};

  BatchWindow(const GridParticles& p, std::size_t first) {
    for (std::size_t lane = 0; lane < std::min(kGridBatch, p.points.count - first); ++lane) {
      const std::size_t i = first + lane;
      const int window = windowOf(p, i);
      if (window == 2) tent[lane] = 1;
      if (window <= 2 || p.curved[i] > 0) continue;
      const float reach = reachOf(p, i, window);
      if (reach <= kMostReach) nodes = std::max(nodes, 2 * static_cast<int>(std::ceil(reach)));
    }
  }
};

/// Sums of F over windows of any width, and F between the nodes where the particles stand.
template <layout::uint kFalloff>
HWY_NOINLINE void weighAll(GridTile& tile, float* scales) {
  GridParticles& p = tile.particles;
  for (std::size_t first = 0; first < p.points.count; first += kGridBatch) {
    const BatchWindow window(p, first);
    for (std::size_t lane = 0; lane < kGridBatch; lane += kLanes) {
      const std::size_t i = first + lane;
      const Vec x = load(&p.points.x[i]), y = load(&p.points.y[i]), one = set(1), zero = hn::Zero(kTag);
      const Vec a = load(&p.a[i]), b = load(&p.b[i]), c = load(&p.c[i]);
      const auto tent = hn::Gt(load(window.tent + lane), zero);
      const auto weight = [&](Vec dx, Vec dy) {
        const Vec q = hn::Add(hn::Mul(hn::Add(hn::Mul(a, dx), hn::Mul(b, dy)), dx), hn::Mul(c, hn::Mul(dy, dy)));
        return falloffOf<kFalloff>(kTag, q);
      };
      const Vec intoX = hn::Sub(x, hn::Floor(x)), intoY = hn::Sub(y, hn::Floor(y));
      Vec sum = one;  // of a tent
      if (!hn::AllTrue(kTag, tent)) {
        const Vec before = set(static_cast<float>(window.nodes / 2 - 1));
        const Vec beginX = hn::Neg(hn::Add(intoX, before)), beginY = hn::Neg(hn::Add(intoY, before));
        Vec all = zero;
        for (int row = 0; row < window.nodes; ++row) {
          const Vec dy = hn::Add(beginY, set(static_cast<float>(row)));
          for (int column = 0; column < window.nodes; ++column)
            all = hn::Add(all, weight(hn::Add(beginX, set(static_cast<float>(column))), dy));
        }
        sum = hn::IfThenElse(tent, one, all);
      }
      const Vec backX = hn::Sub(one, intoX), backY = hn::Sub(one, intoY);
      const auto corner = [&](Vec dx, Vec dy, Vec tentX, Vec tentY) {
        return hn::IfThenElse(tent, hn::Mul(tentX, tentY), weight(dx, dy));
      };
      const Vec leftX = hn::Neg(intoX), leftY = hn::Neg(intoY);
      const Vec lower = between(corner(leftX, leftY, backX, backY), corner(backX, leftY, intoX, backY), intoX);
      const Vec upper = between(corner(leftX, backY, backX, intoY), corner(backX, backY, intoX, intoY), intoX);
      const Vec inverse = hn::Div(one, load(&p.depthRadius[i])), scale = hn::Div(load(&p.mass[i]), sum);
      hn::StoreU(scale, kTag, scales + i);
      const Vec across = hn::Mul(scale, between(lower, upper, intoY));
      hn::StoreU(hn::Mul(across, ownDepthShare(p, i, load(&p.depth[i]), inverse)), kTag, &p.own[i]);
    }
  }
}

void weighBatches(GridTile& tile, float* scales) {
  switch (tile.falloff) {
    case layout::kFalloffLinear: return weighAll<layout::kFalloffLinear>(tile, scales);
    case layout::kFalloffSphere: return weighAll<layout::kFalloffSphere>(tile, scales);
    default: return weighAll<layout::kFalloffSmooth>(tile, scales);
  }
}

// ---- putting down

/// Adds one particle of a batch that was weighed for this window.
template <int kNodes>
HWY_INLINE void putDown(GridTile& tile, const Batch& batch, std::size_t first, std::size_t lane) {
  GridParticles& p = tile.particles;
  const std::size_t i = first + lane;
  p.own[i] = batch.own[lane];
  const int group = p.firstBin[i] >> 2, place = tile.placeOfGroup(group), next = tile.placeOfGroup(group + 1);
  const bool both = p.lastBin[i] >> 2 > group && next >= 0;
  if (place < 0) return;
  const std::size_t run = static_cast<std::size_t>(tile.run), row = run * static_cast<std::size_t>(tile.stride);
  const std::size_t at = tile.node(batch.column[lane], batch.row[lane]) + static_cast<std::size_t>(place);
  for (std::size_t channel = 0; channel < tile.channels; ++channel) {
    const float scale = batch.scale[lane] * p.peak[channel][i];
    const Group share = scaled(batch.share[0] + kGroupBins * lane, scale),
                further = scaled(batch.share[1] + kGroupBins * lane, scale);
    float* to = tile.nodes[channel].data() + at;
    for (int r = 0; r < kNodes; ++r, to += row)
      for (int c = 0; c < kNodes; ++c) {
        const float weight = batch.weight[r * kNodes + c][lane];
        addTo(to + static_cast<std::size_t>(c) * run, weight, share);
        if (both) addTo(to + static_cast<std::size_t>(c) * run + kGroupBins, weight, further);
      }
  }
}

// ---- what is too wide or too near for that, one by one

/// F at the nodes that a kernel covers, whether the tile has them or not.
struct Footprint {
  int x0, y0, columns, rows;
  std::vector<float> values;
  float at(int x, int y) const {
    const int column = x - x0, row = y - y0;
    return column < 0 || row < 0 || column >= columns || row >= rows ? 0.0f : values[index(column, row)];
  }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
  void resize(double x, double y, double endX, double endY) {
    x0 = static_cast<int>(std::ceil(x)), y0 = static_cast<int>(std::ceil(y));
    columns = std::max(static_cast<int>(std::floor(endX)) - x0 + 1, 0);
    rows = std::max(static_cast<int>(std::floor(endY)) - y0 + 1, 0);
    values.resize(index(0, rows) + kGridBatch);
  }
};

/// Calls row(y, x, values) for each vector of nodes: `values` are theirs, or beyond the row's end.
template <class Row>
HWY_INLINE void eachVector(Footprint& f, const Row& one) {
  for (int row = 0; row < f.rows; ++row)
    for (int column = 0; column < f.columns; column += static_cast<int>(kLanes))
      one(f.y0 + row, hn::Add(hn::Iota(kTag, 0), set(static_cast<float>(f.x0 + column))),
          &f.values[f.index(column, row)], std::min(kLanes, static_cast<std::size_t>(f.columns - column)));
}

/// In four parts, so that an addition need not wait for the last, and the same for vectors of any width.
HWY_INLINE float sumOf(const std::vector<float>& values, std::size_t count) {
  float part[4] = {};
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4)
    for (std::size_t j = 0; j < 4; ++j) part[j] += values[k + j];
  for (; k < count; ++k) part[0] += values[k];
  return (part[0] + part[1]) + (part[2] + part[3]);
}

template <layout::uint kFalloff>
HWY_INLINE float drawFootprint(const GridParticles& p, std::size_t i, Footprint& f) {
  const float x = p.points.x[i], y = p.points.y[i], a = p.a[i], b = p.b[i], c = p.c[i];
  // Half widths of the ellipse a·x² + b·x·y + c·y² = 1.
  const float determinant = a * c - 0.25f * (b * b);
  const float halfX = std::sqrt(c / determinant), halfY = std::sqrt(a / determinant);
  f.resize(x - halfX, y - halfY, x + halfX, y + halfY);
  eachVector(f, [&](int row, Vec column, float* values, std::size_t) {
    const float dy = static_cast<float>(row) - y;
    const Vec dx = hn::Sub(column, set(x));
    const Vec q = hn::Add(hn::Mul(hn::Add(hn::Mul(set(a), dx), set(b * dy)), dx), set(c * (dy * dy)));
    hn::StoreU(falloffOf<kFalloff>(kTag, q), kTag, values);  // the next row overwrites what is beyond
  });
  return sumOf(f.values, f.index(0, f.rows));
}

/// The same with q by its full formula, and the sum weighted by the solid angle of each node's cell.
template <layout::uint kFalloff>
HWY_NOINLINE float drawCurvedFootprint(const GridTile& tile, std::size_t i, Footprint& f,
                                       std::vector<float>& weighted) {
  const GridParticles& p = tile.particles;
  const double cell = tile.shape->resolution.cell;
  const float k = p.curved[i];
  const dvec3 centre = dvec3(p.points.sourceX[i], p.points.sourceY[i], p.points.sourceZ[i]) - tile.frame.origin;
  const double z = glm::dot(centre, tile.frame.axis);
  // As wide as its narrowed or widened kernel.
  const NodeRange nodes = curvedNodeRange(centre, z / std::sqrt(static_cast<double>(k)), tile.frame, cell);
  const dvec2 corner(tile.firstColumn, tile.firstRow), lo = nodes.lo - corner, hi = nodes.hi - corner;
  f.resize(lo.x, lo.y, hi.x, hi.y);
  weighted.resize(f.values.size());
  const auto pu = static_cast<float>(glm::dot(centre, tile.frame.u) / z),
             pv = static_cast<float>(glm::dot(centre, tile.frame.v) / z);
  const Vec one = set(1), step = set(static_cast<float>(cell)), firstColumn = set(static_cast<float>(tile.firstColumn));
  eachVector(f, [&](int row, Vec column, float* values, std::size_t) {
    const auto nodeV = static_cast<float>((row + tile.firstRow) * cell);
    const Vec v = set(nodeV), dv = set(pv - nodeV), u = hn::Mul(hn::Add(column, firstColumn), step);
    const Vec du = hn::Sub(set(pu), u), cross = hn::Sub(hn::Mul(du, v), hn::Mul(dv, u));
    const Vec n = hn::Add(one, hn::Add(hn::Mul(u, u), hn::Mul(v, v)));
    const Vec b2 = hn::Add(hn::Add(hn::Mul(du, du), hn::Mul(dv, dv)), hn::Mul(cross, cross));
    const Vec value = falloffOf<kFalloff>(kTag, hn::Div(hn::Mul(b2, set(k)), n));
    hn::StoreU(value, kTag, values);
    hn::StoreU(hn::Div(value, hn::Mul(n, hn::Sqrt(n))), kTag,
               &weighted[static_cast<std::size_t>(values - f.values.data())]);
  });
  return sumOf(weighted, f.index(0, f.rows));
}

/// What a receiver at the particle's own place finds of it, relative to `scale` · F.
float ownShare(const GridParticles& p, std::size_t i, const Footprint& f, float scale) {
  const float fx = std::floor(p.points.x[i]), fy = std::floor(p.points.y[i]), fd = static_cast<float>(p.points.bin[i]);
  const int x = static_cast<int>(fx), y = static_cast<int>(fy);
  const float wx = p.points.x[i] - fx, wy = p.points.y[i] - fy, wd = p.points.depth[i] - fd;
  const float lower = f.at(x, y) + wx * (f.at(x + 1, y) - f.at(x, y));
  const float upper = f.at(x, y + 1) + wx * (f.at(x + 1, y + 1) - f.at(x, y + 1));
  const float inverse = 1.0f / p.depthRadius[i];
  const float before = depthShare((fd - p.depth[i]) * inverse), after = depthShare((fd + 1.0f - p.depth[i]) * inverse);
  return scale * (lower + wy * (upper - lower)) * (before + wd * (after - before));
}

/// Draws the particle's kernel into `f`.
template <layout::uint kFalloff>
HWY_INLINE LoneKernel weighLone(const GridTile& tile, std::size_t i, Footprint& f) {
  static thread_local std::vector<float> weighted;
  const GridParticles& p = tile.particles;
  const float sum =
      p.curved[i] > 0 ? drawCurvedFootprint<kFalloff>(tile, i, f, weighted) : drawFootprint<kFalloff>(p, i, f);
  LoneKernel kernel{f.x0, f.y0, f.columns, f.rows};
  if (!(sum > 0)) return kernel;
  kernel.scale = p.mass[i] / sum;
  kernel.own = ownShare(p, i, f, kernel.scale);
  return kernel;
}

LoneKernel weighOne(const GridTile& tile, std::size_t i) {
  static thread_local Footprint f;
  switch (tile.falloff) {
    case layout::kFalloffLinear: return weighLone<layout::kFalloffLinear>(tile, i, f);
    case layout::kFalloffSphere: return weighLone<layout::kFalloffSphere>(tile, i, f);
    default: return weighLone<layout::kFalloffSmooth>(tile, i, f);
  }
}

template <layout::uint kFalloff>
HWY_NOINLINE void putDownAlone(GridTile& tile, std::size_t i) {
  static thread_local Footprint f;
  GridParticles& p = tile.particles;
  const LoneKernel kernel = weighLone<kFalloff>(tile, i, f);
  p.own[i] = kernel.own;
  if (!(kernel.scale > 0)) return;
  const float scale = kernel.scale, inverse = 1.0f / p.depthRadius[i];
  const int last = tile.shape->tileCells;
  const int rowBegin = std::max(f.y0, 0), rowEnd = std::min(f.y0 + f.rows - 1, last);
  const int columnBegin = std::max(f.x0, 0), columnEnd = std::min(f.x0 + f.columns - 1, last);
  for (int group = p.firstBin[i] >> 2; group <= p.lastBin[i] >> 2; ++group) {
    const int place = tile.placeOfGroup(group);
    if (place < 0) continue;
    alignas(16) float share[kGroupBins];
    for (int k = 0; k < kGroupBins; ++k) {
      const auto bin = static_cast<float>(group * kGroupBins + k);
      share[k] = depthShare((bin + 1 - p.depth[i]) * inverse) - depthShare((bin - p.depth[i]) * inverse);
    }
    for (std::size_t channel = 0; channel < tile.channels; ++channel) {
      const Group shares = scaled(share, scale * p.peak[channel][i]);
      for (int y = rowBegin; y <= rowEnd; ++y) {
        const float* weight = &f.values[f.index(columnBegin - f.x0, y - f.y0)];
        float* to = tile.nodes[channel].data() + tile.node(columnBegin, y) + place;
        for (int x = columnBegin; x <= columnEnd; ++x, to += tile.run) addTo(to, *weight++, shares);
      }
    }
  }
}

// ---- fill

template <layout::uint kFalloff, int kNodes>
HWY_INLINE void fillBatch(GridTile& tile, std::size_t first, const int (&window)[kGridBatch], Batch& batch) {
  weigh<kFalloff, kNodes>(tile.particles, first, batch);
  for (std::size_t lane = 0; lane < kGridBatch; ++lane)
    if (window[lane] == kNodes) putDown<kNodes>(tile, batch, first, lane);
}

template <layout::uint kFalloff>
HWY_NOINLINE void fillAll(GridTile& tile) {
  Batch batch;
  GridParticles& p = tile.particles;
  for (std::size_t first = 0; first < p.points.count; first += kGridBatch) {
    const std::size_t count = std::min(kGridBatch, p.points.count - first);
    int window[kGridBatch] = {};
    bool any[kAlone + 1] = {};
    for (std::size_t lane = 0; lane < count; ++lane) any[window[lane] = windowOf(p, first + lane)] = true;
    if (any[2]) fillBatch<kFalloff, 2>(tile, first, window, batch);
    if (any[3]) fillBatch<kFalloff, 3>(tile, first, window, batch);
    if (any[4]) fillBatch<kFalloff, 4>(tile, first, window, batch);
    if (any[5]) fillBatch<kFalloff, 5>(tile, first, window, batch);
    if (any[6]) fillBatch<kFalloff, 6>(tile, first, window, batch);
    if (any[7]) fillBatch<kFalloff, 7>(tile, first, window, batch);
    if (any[8]) fillBatch<kFalloff, 8>(tile, first, window, batch);
    if (any[0] || any[kAlone])
      for (std::size_t lane = 0; lane < count; ++lane) {
        if (window[lane] == 0) p.own[first + lane] = 0;
        if (window[lane] == kAlone) putDownAlone<kFalloff>(tile, first + lane);
      }
  }
}

/// The sums up to each bin of a group, and `carry` before it; returns the last.
#if HWY_TARGET == HWY_SCALAR
HWY_INLINE float sumGroup(float* at, float carry) {
  const float first = at[1] + at[0], second = at[2] + at[1], third = at[3] + at[2];
  at[3] = (third + first) + carry, at[2] = (second + at[0]) + carry, at[1] = first + carry, at[0] += carry;
  return at[3];
}
#else
HWY_INLINE hn::Vec<GroupTag> sumGroup(float* at, hn::Vec<GroupTag> carry) {
  auto sum = hn::LoadU(kGroupTag, at);
  sum = hn::Add(sum, hn::ShiftLeftLanes<1>(kGroupTag, sum));
  sum = hn::Add(hn::Add(sum, hn::ShiftLeftLanes<2>(kGroupTag, sum)), carry);
  hn::StoreU(sum, kGroupTag, at);
  return hn::Broadcast<kGroupBins - 1>(sum);
}
#endif

/// Every node's run becomes the sums up to each bin's end.
HWY_NOINLINE void sumRuns(GridTile& tile) {
  const int size = tile.shape->tileCells;
  for (std::size_t channel = 0; channel < tile.channels; ++channel)
    for (int row = 0; row <= size; ++row)
      for (int column = 0; column <= size; ++column) {
        float* at = tile.nodes[channel].data() + tile.node(column, row);
#if HWY_TARGET == HWY_SCALAR
        float carry = 0;
#else
        auto carry = hn::Zero(kGroupTag);
#endif
        for (int bin = 0; bin < tile.run; bin += kGroupBins) carry = sumGroup(at + bin, carry);
      }
}

void fill(GridTile& tile) {
  switch (tile.falloff) {
    case layout::kFalloffLinear: fillAll<layout::kFalloffLinear>(tile); break;
    case layout::kFalloffSphere: fillAll<layout::kFalloffSphere>(tile); break;
    default: fillAll<layout::kFalloffSmooth>(tile); break;
  }
  sumRuns(tile);
}

// ---- read

void read(const GridTile& tile, float* depths) {
  const GridPoints& points = tile.receiverPoints();
  const std::size_t count = tile.receivers;
  const auto lastCell = static_cast<float>(tile.shape->tileCells - 1);
  const IntVec run = hn::Set(kIntTag, tile.run), stride = hn::Set(kIntTag, tile.stride),
               margin = hn::Set(kIntTag, kNodeMargin);
  const int row = tile.run * tile.stride;
  for (std::size_t k = 0; k < count; k += kLanes) {
    const IntVec bin = hn::LoadU(kIntTag, &points.bin[k]);
    alignas(64) std::int32_t place[kLanes] = {};
    const std::size_t own = std::min(kLanes, count - k);
    for (std::size_t lane = 0; lane < own; ++lane) place[lane] = tile.placeOfGroup(points.bin[k + lane] >> 2);
    const IntVec inRun = hn::Add(hn::LoadU(kIntTag, place), hn::And(bin, hn::Set(kIntTag, kGroupBins - 1)));
    const Vec x = load(&points.x[k]), y = load(&points.y[k]);
    const Vec fx = hn::Min(hn::Max(hn::Floor(x), hn::Zero(kTag)), set(lastCell)),
              fy = hn::Min(hn::Max(hn::Floor(y), hn::Zero(kTag)), set(lastCell));
    const Vec wx = hn::Sub(x, fx), wy = hn::Sub(y, fy), wd = hn::Sub(load(&points.depth[k]), hn::ConvertTo(kTag, bin));
    const IntVec node = hn::Add(hn::Mul(hn::Add(hn::ConvertTo(kIntTag, fy), margin), stride),
                                hn::Add(hn::ConvertTo(kIntTag, fx), margin));
    IntVec at = hn::Add(hn::Mul(node, run), inRun);
    if (own < kLanes) at = hn::IfThenElse(hn::FirstN(kIntTag, own), at, hn::Set(kIntTag, 1));
    for (std::size_t channel = 0; channel < tile.channels; ++channel) {
      const float* nodes = tile.nodes[channel].data();
      const auto across = [&](const float* from) {
        const auto gather = [&](int offset) { return hn::GatherIndex(kTag, from + offset, at); };
        return between(between(gather(0), gather(tile.run), wx), between(gather(row), gather(row + tile.run), wx), wy);
      };
      const Vec before = across(nodes - 1), after = across(nodes);
      const Vec depth = between(before, after, wd);
      alignas(64) float out[kLanes];
      hn::Store(depth, kTag, out);
      std::copy_n(out, own, depths + channel * count + k);
    }
  }
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(fill);
HWY_EXPORT(read);
HWY_EXPORT(weighOne);
HWY_EXPORT(weighBatches);

LoneKernel weighAlone(const GridTile& tile, std::size_t particle) {
  return HWY_DYNAMIC_DISPATCH(weighOne)(tile, particle);
}
void weighTile(GridTile& tile, std::vector<float>& scale) {
  if (scale.size() < tile.particles.own.size()) scale.resize(tile.particles.own.size());
  HWY_DYNAMIC_DISPATCH(weighBatches)(tile, scale.data());
}
void fillTile(GridTile& tile) { HWY_DYNAMIC_DISPATCH(fill)(tile); }
void readTile(const GridTile& tile, std::vector<float>& depths) {
  depths.resize(tile.channels * tile.receivers);
  HWY_DYNAMIC_DISPATCH(read)(tile, depths.data());
}

}  // namespace mote
#endif
