// Weights of a tile's kernels, for who puts them down elsewhere: a device.
#include <algorithm>
#include <cmath>

#include "host/lighting/grid/tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/grid/weigh_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include "host/lighting/grid/vectors-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {

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

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(weighBatches);

void weighTile(GridTile& tile, std::vector<float>& scale) {
  if (scale.size() < tile.particles.own.size()) scale.resize(tile.particles.own.size());
  HWY_DYNAMIC_DISPATCH(weighBatches)(tile, scale.data());
}

}  // namespace mote
#endif
