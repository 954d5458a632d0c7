// Compiled once for each instruction set by Highway: foreach_target.h includes this file again.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/splat/tile_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
//
#include <hwy/highway.h>

#include <algorithm>

#include "host/splat/splat.h"
#include "host/splat/tile_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, kTileLanes>;
using Vec = hn::Vec<Lanes>;
constexpr Lanes kLanes;

HWY_INLINE Vec constant(float value) { return hn::Set(kLanes, value); }
/// a + b·c in two roundings, as the scalar twin and the shader.
HWY_INLINE Vec sum(Vec a, Vec b, Vec c) { return hn::Add(a, hn::Mul(b, c)); }

/// Twin of oneMinusExp() in footprint.h.
HWY_INLINE Vec oneMinusExpLanes(Vec opticalDepth) {
  const Vec one = constant(1);
  const Vec x = hn::Min(opticalDepth, constant(40));
  const Vec n = hn::Floor(sum(constant(0.5f), x, constant(1.44269504f)));
  const Vec y = sum(hn::Sub(hn::Mul(n, constant(0.693359375f)), x), n, constant(-2.12194440e-4f));
  Vec p = sum(constant(1.0f / 720), y, constant(1.0f / 5040));
  p = sum(constant(1.0f / 120), y, p);
  p = sum(constant(1.0f / 24), y, p);
  p = sum(constant(1.0f / 6), y, p);
  p = sum(constant(0.5f), y, p);
  p = sum(y, hn::Mul(y, y), p);
  const hn::RebindToSigned<Lanes> integers;
  const auto exponent = hn::Sub(hn::Set(integers, 127), hn::ConvertTo(integers, n));
  const Vec power = hn::BitCast(kLanes, hn::ShiftLeft<23>(exponent));
  return hn::Sub(hn::Sub(one, power), hn::Mul(power, p));
}

template <layout::uint kFalloff>
HWY_INLINE Vec falloffLanes(Vec q) {
  const Vec one = constant(1);
  if constexpr (kFalloff == layout::kFalloffLinear) return hn::Sub(one, hn::Sqrt(q));
  const Vec rest = hn::Sub(one, q);
  if constexpr (kFalloff == layout::kFalloffSphere) return hn::Sqrt(rest);
  return hn::Mul(rest, rest);
}

/// over: value·(1 − α) + α·source.
HWY_INLINE void blend(float* pixels, Vec alpha, Vec transmittance, float source) {
  hn::StoreU(sum(hn::Mul(hn::LoadU(kLanes, pixels), transmittance), alpha, constant(source)), kLanes, pixels);
}

/// Pixels [x, xEnd) of one row; dy and v as in footprintDistance(), what depends on them alone is taken out.
template <layout::uint kFalloff, bool kWithDepth>
HWY_INLINE void drawRow(const Splat& s, float dyValue, float pixelSize, int x, int xEnd, Tile& tile, std::size_t row) {
  const float vValue = s.image.y + dyValue;
  const float cxValue = s.centre.z * dyValue;
  const Vec cx2 = constant(cxValue * cxValue), czRow = constant(s.centre.x * dyValue);
  const Vec v2 = constant(vValue * vValue + 1.0f), facingRow = constant(s.centre.y * vValue + s.centre.z);
  for (; x < xEnd; x += static_cast<int>(hn::Lanes(kLanes))) {
    // Exact: pixel centres are half-integers below 2¹⁴.
    const Vec at = hn::Iota(kLanes, static_cast<float>(x) + 0.5f);
    const Vec dx = hn::Mul(hn::Sub(at, constant(s.pixel.x)), constant(pixelSize));
    const Vec u = hn::Add(constant(s.image.x), dx);
    const Vec facing = sum(facingRow, constant(s.centre.x), u);
    const Vec cy = hn::Mul(constant(s.centre.z), dx);
    const Vec cz = hn::Sub(czRow, hn::Mul(constant(s.centre.y), dx));
    const Vec across = hn::Add(hn::Add(hn::Mul(cy, cy), hn::Mul(cz, cz)), cx2);
    const Vec q = hn::Div(across, hn::Add(hn::Mul(u, u), v2));
    const auto covered = hn::And(hn::Lt(q, constant(1)), hn::Gt(facing, hn::Zero(kLanes)));
    if (hn::AllFalse(kLanes, covered)) continue;
    const Vec depth = hn::Mul(constant(s.peak), falloffLanes<kFalloff>(q));
    const Vec alpha = hn::IfThenElseZero(covered, hn::Mul(constant(s.opacity), oneMinusExpLanes(depth)));
    const Vec rest = hn::Sub(constant(1), alpha);
    const std::size_t i = row + static_cast<std::size_t>(x - tile.left);
    blend(tile.r + i, alpha, rest, s.radiance.x);
    blend(tile.g + i, alpha, rest, s.radiance.y);
    blend(tile.b + i, alpha, rest, s.radiance.z);
    hn::StoreU(hn::Add(hn::Mul(hn::LoadU(kLanes, tile.a + i), rest), alpha), kLanes, tile.a + i);
    if constexpr (kWithDepth) {
      const Vec old = hn::LoadU(kLanes, tile.depth + i);
      const Vec nearer = hn::Min(old, constant(s.depth));
      hn::StoreU(hn::IfThenElse(hn::Ge(alpha, constant(kDepthAlpha)), nearer, old), kLanes, tile.depth + i);
    }
  }
}

template <layout::uint kFalloff, bool kWithDepth>
void drawAll(const Splat* splats, const std::uint32_t* items, std::size_t count, float pixelSize, Tile& tile) {
  for (std::size_t k = 0; k < count; ++k) {
    const Splat& s = splats[items[k]];
    const int left = std::max<int>(s.left, tile.left), right = std::min<int>(s.right, tile.left + kTileWidth);
    const int top = std::max<int>(s.top, tile.top), bottom = std::min<int>(s.bottom, tile.top + kTileHeight);
    for (int y = top; y < bottom; ++y) {
      const float dy = (s.pixel.y - (static_cast<float>(y) + 0.5f)) * pixelSize;
      drawRow<kFalloff, kWithDepth>(s, dy, pixelSize, left, right, tile,
                                    static_cast<std::size_t>(y - tile.top) * kTileStride);
    }
  }
}

template <layout::uint kFalloff>
void drawFalloff(const Splat* splats, const std::uint32_t* items, std::size_t count, float pixelSize, Tile& tile) {
  if (tile.withDepth)
    drawAll<kFalloff, true>(splats, items, count, pixelSize, tile);
  else
    drawAll<kFalloff, false>(splats, items, count, pixelSize, tile);
}

void drawSplatsHere(const Splat* splats, const std::uint32_t* items, std::size_t count, float pixelSize,
                    layout::uint falloff, Tile& tile) {
  switch (falloff) {
    case layout::kFalloffLinear: return drawFalloff<layout::kFalloffLinear>(splats, items, count, pixelSize, tile);
    case layout::kFalloffSphere: return drawFalloff<layout::kFalloffSphere>(splats, items, count, pixelSize, tile);
    default: return drawFalloff<layout::kFalloffSmooth>(splats, items, count, pixelSize, tile);
  }
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {
HWY_EXPORT(drawSplatsHere);

void drawSplats(const Splat* splats, const std::uint32_t* items, std::size_t count, float pixelSize,
                layout::uint falloff, Tile& tile) {
  HWY_DYNAMIC_DISPATCH(drawSplatsHere)(splats, items, count, pixelSize, falloff, tile);
}
}  // namespace mote
#endif
