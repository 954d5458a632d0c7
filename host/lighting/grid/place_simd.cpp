// Where particles and receivers stand in a light grid, compiled once for each instruction set (Google Highway). In
// double: a cell may be a millionth of the distance to the light.
#include <algorithm>
#include <cmath>
#include <utility>

#include "host/lighting/grid/tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/grid/place_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, 8>;
using Narrow = hn::Rebind<float, Tag>;
using NarrowInt = hn::Rebind<std::int32_t, Tag>;
using Vec = hn::Vec<Tag>;
using NarrowVec = hn::Vec<Narrow>;
using Mask = hn::Mask<Tag>;
constexpr Tag kTag;
constexpr Narrow kNarrow;
constexpr NarrowInt kNarrowInt;

HWY_INLINE std::size_t lanes() { return hn::Lanes(kTag); }
HWY_INLINE Vec set(double value) { return hn::Set(kTag, value); }
HWY_INLINE Vec widen(const float* from) { return hn::PromoteTo(kTag, hn::LoadU(kNarrow, from)); }
HWY_INLINE void store(Vec value, float* to) { hn::StoreU(hn::DemoteTo(kNarrow, value), kNarrow, to); }
HWY_INLINE Vec along(Vec x, Vec y, Vec z, const dvec3& axis) {
  return hn::Add(hn::Add(hn::Mul(x, set(axis.x)), hn::Mul(y, set(axis.y))), hn::Mul(z, set(axis.z)));
}
HWY_INLINE Vec square(Vec x) { return hn::Mul(x, x); }
/// KernelWeights::supported, in single precision: roots and quotients take an eighth of the time.
HWY_INLINE NarrowVec supported(const KernelWeights& weights, NarrowVec narrowed) {
  const auto set = [](double value) { return hn::Set(kNarrow, static_cast<float>(value)); };
  const NarrowVec whole = hn::Sub(narrowed, hn::Mul(set(weights.margin), hn::Sqrt(narrowed)));
  return hn::Max(hn::Mul(set(weights.leastSupport), narrowed), whole);
}

/// The square by which an ellipse is wider, on the side where it is, than the circle seen from straight ahead.
HWY_INLINE NarrowVec widening(Vec u, Vec v) {
  return hn::DemoteTo(kNarrow, hn::Add(set(1), hn::Max(square(u), square(v))));
}

// ---- locate

struct OnFace {
  Vec u, v, inverseZ, face;
  Vec distanceSquare;
  Mask nowhere;
};

HWY_INLINE OnFace onCube(Vec px, Vec py, Vec pz) {
  const Vec ax = hn::Abs(px), ay = hn::Abs(py), az = hn::Abs(pz);
  const Mask isX = hn::And(hn::Ge(ax, ay), hn::Ge(ax, az)), isY = hn::Ge(ay, az);
  const auto choose = [&](Vec x, Vec y, Vec z) { return hn::IfThenElse(isX, x, hn::IfThenElse(isY, y, z)); };
  const Vec main = choose(px, py, pz), z = hn::Abs(main), zero = hn::Zero(kTag);
  const Vec face = hn::Add(choose(zero, set(2), set(4)), hn::IfThenElse(hn::Lt(main, zero), set(1), zero));
  const Vec inverse = hn::Div(set(1), z);
  return {hn::Mul(choose(py, pz, px), inverse),
          hn::Mul(choose(pz, px, py), inverse),
          inverse,
          face,
          hn::Add(hn::Add(square(px), square(py)), square(pz)),
          hn::Eq(z, zero)};
}

void locateAll(const LocatePoints& points, const GridShape& shape, double* keys, std::uint8_t* flags) {
  const LightFrame& first = shape.faces.front();
  const bool perspective = shape.perspective();
  const double cell = shape.resolution.cell, size = shape.tileCells;
  const Vec perCell = set(1 / cell), perTile = set(1 / size), zero = hn::Zero(kTag), one = set(1);
  const Vec half = set(1 << 23), most = set((1 << 24) - 1);
  const Vec tentBelow = set(shape.weights.tentBelow), narrowing = set(shape.weights.narrowing);
  constexpr double kSlack = 1e-3;  // nodes: rounding may go either way
  const auto part = [&](std::size_t i, std::size_t count) {
    float padded[4][8] = {};
    const float* from[4] = {points.x, points.y, points.z, points.radius};
    for (int k = 0; k < 4; ++k) {
      if (from[k]) from[k] += i;
      if (count >= lanes()) continue;
      if (from[k]) std::copy_n(from[k], count, padded[k]);
      from[k] = padded[k];
    }
    const Vec px = hn::Sub(widen(from[0]), set(first.origin.x)), py = hn::Sub(widen(from[1]), set(first.origin.y)),
              pz = hn::Sub(widen(from[2]), set(first.origin.z)), r = from[3] ? widen(from[3]) : zero;
    const OnFace at = perspective ? onCube(px, py, pz)
                                  : OnFace{along(px, py, pz, first.u), along(px, py, pz, first.v), one, zero, zero,
                                           hn::Lt(one, zero)};
    const Vec x = hn::Mul(at.u, perCell), y = hn::Mul(at.v, perCell);
    const Vec column = hn::Floor(hn::Mul(x, perTile)), row = hn::Floor(hn::Mul(y, perTile));
    const auto number = [&](Vec tile) { return hn::Min(hn::Max(hn::Add(tile, half), zero), most); };
    const Vec key =
        hn::Add(hn::Mul(hn::Add(hn::Mul(at.face, set(1 << 24)), number(row)), set(1 << 24)), number(column));
    const Vec final = hn::IfThenElse(at.nowhere, set(kNoTile), key);
    // How far a kernel's nodes reach, on the face of the centre.
    const Vec cells2 = square(hn::Mul(hn::Mul(r, perCell), at.inverseZ));
    const Vec narrowed = hn::Sub(hn::Max(cells2, tentBelow), narrowing);
    NarrowVec wide2 = supported(shape.weights, hn::DemoteTo(kNarrow, narrowed));
    if (perspective) wide2 = hn::Mul(wide2, widening(at.u, at.v));
    const Vec reach = hn::IfThenElse(hn::Gt(cells2, tentBelow), hn::PromoteTo(kTag, hn::Sqrt(wide2)), one);
    const Vec inX = hn::Sub(x, hn::Mul(column, set(size))), inY = hn::Sub(y, hn::Mul(row, set(size)));
    const auto before = [&](Vec in) { return hn::Le(hn::Sub(in, reach), set(kSlack)); };
    const auto behind = [&](Vec in) { return hn::Ge(hn::Add(in, reach), set(size - kSlack)); };
    Mask anywhere = hn::Gt(reach, set(size - 1)), near = hn::Lt(one, zero);
    if (perspective) {
      // Neighbouring faces: a tile there may have nodes a cell beyond its face.
      const Vec edge = hn::Add(hn::Max(hn::Abs(at.u), hn::Abs(at.v)), hn::Mul(hn::Add(reach, set(2)), set(cell)));
      anywhere = hn::Or(anywhere, hn::Ge(edge, one));
      anywhere = hn::Or(anywhere, hn::Lt(at.distanceSquare, square(hn::Mul(set(kCurvedRadii), r))));
      near = hn::Lt(at.distanceSquare, square(hn::Mul(set(kNearLightRadii / 2), r)));
    }
    const std::pair<Mask, LocateFlags> all[] = {{before(inX), kLeft},     {behind(inX), kRight}, {before(inY), kBelow},
                                                {behind(inY), kAbove},    {anywhere, kAnywhere}, {near, kNearLight},
                                                {hn::Le(r, zero), kPoint}};
    Vec sum = zero;
    for (const auto& [mask, flag] : all) sum = hn::Add(sum, hn::IfThenElseZero(mask, set(flag)));
    double key8[8];
    std::int32_t flags8[8];
    hn::StoreU(final, kTag, key8);
    hn::StoreU(hn::DemoteTo(kNarrowInt, sum), kNarrowInt, flags8);
    std::copy_n(key8, count, keys + i);
    std::copy_n(flags8, count, flags + i);
  };
  for (std::size_t i = 0; i < points.count; i += lanes()) part(i, std::min(lanes(), points.count - i));
}

void findBounds(const LocatePoints& points, PointBounds& bounds) {
  const hn::CappedTag<float, 16> tag;
  const std::size_t lanes = hn::Lanes(tag);
  const auto range = [&](const float* from) {
    auto lo = hn::Set(tag, from[0]), hi = lo;
    std::size_t i = 0;
    for (; i + lanes <= points.count; i += lanes) {
      const auto value = hn::LoadU(tag, from + i);
      lo = hn::Min(lo, value), hi = hn::Max(hi, value);
    }
    std::pair<float, float> all{hn::GetLane(hn::MinOfLanes(tag, lo)), hn::GetLane(hn::MaxOfLanes(tag, hi))};
    for (; i < points.count; ++i) all = {std::min(all.first, from[i]), std::max(all.second, from[i])};
    return all;
  };
  const auto x = range(points.x), y = range(points.y), z = range(points.z);
  const auto r = points.radius ? range(points.radius) : std::pair<float, float>{};
  bounds = {{x.first, y.first, z.first}, {x.second, y.second, z.second}, r.first, r.second};
}

// ---- place

/// The whole number below, held within what an int has.
HWY_INLINE void storeBin(Vec depth, std::int32_t* to) {
  const Vec held = hn::Min(hn::Max(hn::Floor(depth), set(-1e9)), set(1e9));
  hn::StoreU(hn::DemoteTo(kNarrowInt, held), kNarrowInt, to);
}

struct InFrame {
  Vec x, y, z, depth;  // depth [scene units]
  Vec inverseZ;        // of a point light
};
HWY_INLINE InFrame placeInFrame(const GridTile& tile, GridPoints& points, std::size_t i) {
  const LightFrame& frame = tile.frame;
  const Vec px = hn::Sub(widen(points.sourceX.at(i)), set(frame.origin.x)),
            py = hn::Sub(widen(points.sourceY.at(i)), set(frame.origin.y)),
            pz = hn::Sub(widen(points.sourceZ.at(i)), set(frame.origin.z));
  InFrame at{along(px, py, pz, frame.u), along(px, py, pz, frame.v), along(px, py, pz, frame.axis), {}, {}};
  at.depth = at.z;
  Vec perCell = set(1 / tile.shape->resolution.cell);
  if (frame.perspective) {
    at.depth = hn::Sqrt(hn::Add(hn::Add(square(at.x), square(at.y)), square(at.z)));
    at.inverseZ = hn::Div(set(1), at.z);
    perCell = hn::Mul(perCell, at.inverseZ);
  }
  store(hn::Sub(hn::Mul(at.x, perCell), set(tile.firstColumn)), &points.x[i]);
  store(hn::Sub(hn::Mul(at.y, perCell), set(tile.firstRow)), &points.y[i]);
  const Vec depth = hn::Sub(hn::Mul(at.depth, set(1 / tile.bin)), set(tile.depthBase));
  store(depth, &points.depth[i]);
  // Of the depth as it is stored, so that what lies behind the bin's beginning is never less than 0.
  storeBin(widen(&points.depth[i]), &points.bin[i]);
  return at;
}

void placeAll(const GridTile& tile, GridPoints& points) {
  for (std::size_t i = 0; i < points.count; i += lanes()) placeInFrame(tile, points, i);
}

void placeKernels(GridTile& tile) {
  GridParticles& to = tile.particles;
  const bool perspective = tile.frame.perspective;
  const KernelMoments& moments = tile.shape->moments;
  const KernelWeights& weights = tile.shape->weights;
  const Vec perCell = set(1 / tile.shape->resolution.cell), perBin = set(1 / tile.bin), base = set(tile.depthBase);
  const Vec zero = hn::Zero(kTag), one = set(1), mass = set(kPi * moments.mass);
  const Vec tentBelow = set(weights.tentBelow), narrowing = set(weights.narrowing);
  for (std::size_t i = 0; i < to.points.count; i += lanes()) {
    const InFrame at = placeInFrame(tile, to.points, i);
    const Vec r = widen(to.radius.at(i));
    Vec cells = hn::Mul(r, perCell), sag = zero, stretch = one, formA = one, formB = zero, formC = one;
    NarrowVec wider = hn::Set(kNarrow, 1.0f);
    Mask shown = hn::Gt(r, zero);
    if (perspective) {
      const Vec inverseDepth = hn::Div(one, at.depth);
      cells = hn::Mul(cells, at.inverseZ);
      sag = hn::Mul(hn::Mul(set(moments.variance), square(r)), inverseDepth);  // ⟨b²⟩ / 2ρ
      // b² = z² · (Δu² + Δv² + (Δu·v − Δv·u)²) / n, n = 1 + u² + v² = (ρ/z)² (column.h): an ellipse of the area
      // π (r/z)² √n.
      const Vec u = hn::Mul(at.x, at.inverseZ), v = hn::Mul(at.y, at.inverseZ);
      const Vec inverseN = square(hn::Mul(at.z, inverseDepth));
      formA = hn::Mul(hn::Add(one, square(v)), inverseN), formC = hn::Mul(hn::Add(one, square(u)), inverseN);
      formB = hn::Mul(hn::Mul(set(-2), hn::Mul(u, v)), inverseN);
      stretch = hn::Mul(at.depth, at.inverseZ);
      wider = widening(u, v);
      shown = hn::And(shown, hn::And(hn::Ge(at.depth, hn::Mul(set(kNearLightRadii / 2), r)),
                                     hn::Gt(at.z, hn::Mul(set(kLeastCosine / 2), at.depth))));
    }
    const Vec narrowed = hn::Sub(hn::Max(square(cells), tentBelow), narrowing);
    const NarrowVec single = hn::DemoteTo(kNarrow, narrowed), support = supported(weights, single);
    const Vec wide = hn::PromoteTo(kTag, hn::Sqrt(hn::Mul(support, wider)));
    Vec half = hn::IfThenElse(hn::Gt(square(cells), tentBelow), wide, one);
    Vec total = hn::Mul(hn::Mul(mass, square(cells)), stretch), curved = zero;
    if (perspective) {
      const Mask bent = hn::And(shown, hn::Lt(at.depth, hn::Mul(set(kCurvedRadii), r)));
      if (!hn::AllFalse(kTag, bent)) {
        curved = hn::IfThenElseZero(bent, hn::Div(hn::Mul(hn::Div(square(at.z), square(r)), square(cells)), narrowed));
        // Over the solid angle: ∫ F dΩ = π · mass · s² · (1 + variance · s²) with s = r/ρ, to the second order.
        const Vec s2 = square(hn::Div(r, at.depth));
        const Vec angle = hn::Mul(hn::Mul(mass, s2), hn::Add(one, hn::Mul(set(moments.variance), s2)));
        total = hn::IfThenElse(bent, hn::Mul(angle, square(perCell)), total);
      }
    }
    half = hn::IfThenElseZero(shown, half);
    const Vec depth = hn::Sub(hn::Mul(hn::Sub(at.depth, sag), perBin), base), radius = hn::Mul(r, perBin);
    store(half, &to.half[i]), store(hn::IfThenElseZero(shown, curved), &to.curved[i]);
    const Vec perNarrowed = hn::Div(one, narrowed);
    store(hn::Mul(formA, perNarrowed), &to.a[i]), store(hn::Mul(formB, perNarrowed), &to.b[i]);
    store(hn::Mul(formC, perNarrowed), &to.c[i]), store(total, &to.mass[i]);
    hn::StoreU(hn::Div(single, support), kNarrow, &to.slope[i]);
    store(depth, &to.depth[i]), store(radius, &to.depthRadius[i]);
    storeBin(hn::Sub(depth, radius), &to.firstBin[i]), storeBin(hn::Add(depth, radius), &to.lastBin[i]);
  }
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(locateAll);
HWY_EXPORT(findBounds);
HWY_EXPORT(placeAll);
HWY_EXPORT(placeKernels);

void locate(const LocatePoints& points, const GridShape& shape, double* keys, std::uint8_t* flags) {
  HWY_DYNAMIC_DISPATCH(locateAll)(points, shape, keys, flags);
}
PointBounds boundsOf(const LocatePoints& points) {
  PointBounds bounds;
  HWY_DYNAMIC_DISPATCH(findBounds)(points, bounds);
  return bounds;
}
void placePoints(const GridTile& tile, GridPoints& points) { HWY_DYNAMIC_DISPATCH(placeAll)(tile, points); }
void placeParticles(GridTile& tile) { HWY_DYNAMIC_DISPATCH(placeKernels)(tile); }

}  // namespace mote
#endif
