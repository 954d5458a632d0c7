// Kernels of a light grid that are too wide, or too near to a point light, to go through batches: one by one, a vector
// of nodes at a time.
#include <algorithm>
#include <cmath>

#include "host/lighting/grid/tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/grid/alone_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include "host/lighting/grid/vectors-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {

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
  // Half widths of the ellipse a·x² + b·x·y + c·y² = 1 / slope.
  const float slope = p.slope[i], determinant = (a * c - 0.25f * (b * b)) * slope;
  const float halfX = std::sqrt(c / determinant), halfY = std::sqrt(a / determinant);
  f.resize(x - halfX, y - halfY, x + halfX, y + halfY);
  eachVector(f, [&](int row, Vec column, float* values, std::size_t) {
    const float dy = static_cast<float>(row) - y;
    const Vec dx = hn::Sub(column, set(x));
    const Vec q = hn::Add(hn::Mul(hn::Add(hn::Mul(set(a), dx), set(b * dy)), dx), set(c * (dy * dy)));
    hn::StoreU(weightOfForm<kFalloff>(q, set(slope)), kTag, values);  // the next row overwrites what is beyond
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
  const NodeRange nodes = curvedNodeRange(centre, z / std::sqrt(k * p.slope[i]), tile.frame, cell);
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
    const Vec value = weightOfForm<kFalloff>(hn::Div(hn::Mul(b2, set(k)), n), set(p.slope[i]));
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
HWY_INLINE LoneKernel drawWith(const GridTile& tile, std::size_t i, Footprint& f) {
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

LoneKernel draw(const GridTile& tile, std::size_t i, Footprint& f) {
  switch (tile.falloff) {
    case layout::kFalloffLinear: return drawWith<layout::kFalloffLinear>(tile, i, f);
    case layout::kFalloffSphere: return drawWith<layout::kFalloffSphere>(tile, i, f);
    default: return drawWith<layout::kFalloffSmooth>(tile, i, f);
  }
}

LoneKernel weighOne(const GridTile& tile, std::size_t i) {
  static thread_local Footprint f;
  return draw(tile, i, f);
}

void putDownOne(GridTile& tile, std::size_t i) {
  static thread_local Footprint f;
  GridParticles& p = tile.particles;
  const LoneKernel kernel = draw(tile, i, f);
  p.own[i] = kernel.own;
  if (!(kernel.scale > 0)) return;
  const float scale = kernel.scale, inverse = 1.0f / p.depthRadius[i];
  const int rowBegin = std::max(f.y0, 0), rowEnd = std::min(f.y0 + f.rows - 1, tile.rows);
  const int columnBegin = std::max(f.x0, 0), columnEnd = std::min(f.x0 + f.columns - 1, tile.columns);
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
        for (int x = columnBegin; x <= columnEnd; ++x, ++weight)
          if (const std::int32_t node = tile.node(x, y); node != GridTile::kNoNode)
            addTo(tile.values[channel] + (node + place), *weight, shares);
      }
    }
  }
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(weighOne);
HWY_EXPORT(putDownOne);

LoneKernel weighAlone(const GridTile& tile, std::size_t particle) {
  return HWY_DYNAMIC_DISPATCH(weighOne)(tile, particle);
}
void putDownAlone(GridTile& tile, std::size_t particle) { HWY_DYNAMIC_DISPATCH(putDownOne)(tile, particle); }

}  // namespace mote
#endif
