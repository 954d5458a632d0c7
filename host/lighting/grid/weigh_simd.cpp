// Weights of a tile's kernels, for who puts them down elsewhere: a device.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "host/lighting/grid/tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/grid/weigh_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include "host/lighting/grid/vectors-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {

/// Which kernels lie in no more groups of bins than go by batches.
HWY_INLINE auto areShallow(const GridParticles& p, std::size_t i) {
  const auto firstGroup = hn::ShiftRight<2>(hn::LoadU(kIntTag, &p.firstBin[i]));
  const auto lastGroup = hn::ShiftRight<2>(hn::LoadU(kIntTag, &p.lastBin[i]));
  return hn::Lt(hn::Sub(lastGroup, firstGroup), hn::Set(kIntTag, kMostGroups));
}

/// Of a whole batch, as windowOf says; false as well where some of it are beyond the end.
HWY_INLINE bool areTents(const GridParticles& p, std::size_t first) {
  bool all = first + kGridBatch <= p.points.count;
  for (std::size_t i = first; all && i < first + kGridBatch; i += kLanes) {
    const Vec half = load(&p.half[i]), zero = hn::Zero(kTag);
    const auto tents = hn::AndNot(hn::Gt(load(&p.curved[i]), zero), hn::And(hn::Gt(half, zero), hn::Le(half, set(1))));
    all = hn::AllTrue(kTag, tents) && hn::AllTrue(kIntTag, areShallow(p, i));
  }
  return all;
}

/// Nodes across that have all of a batch's kernels, an even number, and which of them are tents.
struct BatchWindow {
  int nodes = 2;
  alignas(64) float tent[kGridBatch] = {};

  BatchWindow(const GridParticles& p, std::size_t first) {
    if (areTents(p, first)) {
      std::fill_n(tent, kGridBatch, 1.0f);
      return;
    }
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

/// The twin of CoveredBlocks of windowOf and reachOf, in one word.
HWY_INLINE auto coveredBlocks(const GridParticles& p, std::size_t i) {
  const IntTag ints;
  const Vec half = load(&p.half[i]), zero = hn::Zero(kTag);
  const Vec reach = hn::Add(hn::Max(half, set(1)), set(CoveredNodes::kSlack));
  const auto first = [&](Vec at) {
    const Vec low = hn::Min(hn::Max(hn::Sub(at, reach), zero), set(kTileCells + 1));
    return hn::ConvertTo(ints, hn::Ceil(low));
  };
  const auto last = [&](Vec at) {
    const Vec high = hn::Min(hn::Max(hn::Add(at, reach), set(-1)), set(kTileCells));
    return hn::ConvertTo(ints, hn::Floor(high));
  };
  const Vec x = load(&p.points.x[i]), y = load(&p.points.y[i]);
  const auto column = first(x), row = first(y), lastColumn = last(x), lastRow = last(y);
  static_assert(layout::kBlockEdge == 4 && layout::kTileBlocks == 9);
  const auto block = [](auto node) { return hn::ShiftRight<2>(node); };
  const auto count = [&](auto from, auto to) { return hn::Add(hn::Sub(block(to), block(from)), hn::Set(ints, 1)); };
  const auto at = hn::Add(hn::Add(hn::ShiftLeft<3>(block(row)), block(row)), block(column));
  const auto all =
      hn::Or(hn::ShiftLeft<16>(at), hn::Or(hn::ShiftLeft<8>(count(row, lastRow)), count(column, lastColumn)));
  const auto none = hn::Or(hn::Gt(column, lastColumn), hn::Gt(row, lastRow));
  const auto word = hn::IfThenZeroElse(none, all);
  const auto narrow = hn::And(hn::Gt(half, zero), hn::Le(half, set(0.5f * kMostWindow)));
  const auto flat = hn::Not(hn::Gt(load(&p.curved[i]), zero));
  const auto batched = hn::And(hn::RebindMask(ints, hn::And(narrow, flat)), areShallow(p, i));
  return hn::IfThenElse(batched, word, hn::Set(ints, -1));
}

/// Sums of F over windows of any width, and F between the nodes where the particles stand.
template <layout::uint kFalloff>
HWY_NOINLINE void weighAll(GridTile& tile, layout::GridKernel* kernels, std::uint32_t* blocks) {
  GridParticles& p = tile.particles;
  const bool colours = tile.channels > 1;
  const Vec cell = set(tile.frame.perspective ? static_cast<float>(tile.shape->resolution.cell) : 0.0f);
  const Vec firstRow = set(static_cast<float>(tile.firstRow));
  for (std::size_t first = 0; first < p.points.count; first += kGridBatch) {
    const BatchWindow window(p, first);
    for (std::size_t lane = 0; lane < kGridBatch; lane += kLanes) {
      const std::size_t i = first + lane;
      const Vec x = load(&p.points.x[i]), y = load(&p.points.y[i]), one = set(1), zero = hn::Zero(kTag);
      const Vec a = load(&p.a[i]), b = load(&p.b[i]), c = load(&p.c[i]), slope = load(&p.slope[i]);
      const auto tent = hn::Gt(load(window.tent + lane), zero);
      const auto weight = [&](Vec dx, Vec dy) {
        const Vec q = hn::Add(hn::Mul(hn::Add(hn::Mul(a, dx), hn::Mul(b, dy)), dx), hn::Mul(c, hn::Mul(dy, dy)));
        return weightOfForm<kFalloff>(q, slope);
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
      const Vec depth = load(&p.depth[i]);
      const Vec v = hn::Mul(hn::Add(y, firstRow), cell), round = hn::Div(a, hn::Add(one, hn::Mul(v, v)));
      alignas(64) float place[4 * kLanes], form[4 * kLanes];
      hn::StoreInterleaved4(x, y, depth, colours ? scale : hn::Mul(scale, load(p.peak[0].at(i))), kTag, place);
      hn::StoreInterleaved4(hn::IfThenElse(tent, zero, round), slope, zero, inverse, kTag, form);
      for (std::size_t k = 0; k < kLanes; ++k) {
        std::memcpy(&kernels[i + k].x, place + 4 * k, 4 * sizeof(float));
        std::memcpy(&kernels[i + k].form, form + 4 * k, 4 * sizeof(float));
      }
      const hn::RebindToUnsigned<decltype(kTag)> words;
      hn::StoreU(hn::BitCast(words, coveredBlocks(p, i)), words, blocks + i);
      const Vec across = hn::Mul(scale, between(lower, upper, intoY));
      hn::StoreU(hn::Mul(across, ownDepthShare(p, i, depth, inverse)), kTag, &p.own[i]);
    }
  }
}

void weighBatches(GridTile& tile, layout::GridKernel* kernels, std::uint32_t* blocks) {
  switch (tile.falloff) {
    case layout::kFalloffLinear: return weighAll<layout::kFalloffLinear>(tile, kernels, blocks);
    case layout::kFalloffSphere: return weighAll<layout::kFalloffSphere>(tile, kernels, blocks);
    default: return weighAll<layout::kFalloffSmooth>(tile, kernels, blocks);
  }
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(weighBatches);

void weighTile(GridTile& tile, layout::GridKernel* kernels, std::uint32_t* blocks) {
  HWY_DYNAMIC_DISPATCH(weighBatches)(tile, kernels, blocks);
}

}  // namespace mote
#endif
