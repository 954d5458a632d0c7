// Kernels put down in a tile of a light grid, and sums along the depth.
#include <algorithm>
#include <cmath>

#include "host/lighting/grid/tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/grid/fill_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include "host/lighting/grid/vectors-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {

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

template <layout::uint kFalloff, int kNodes>
HWY_INLINE void weigh(const GridParticles& p, std::size_t first, Batch& batch) {
  constexpr int kBelow = (kNodes - 1) / 2;  // the node below the centre, or the middle one
  for (std::size_t lane = 0; lane < kGridBatch; lane += kLanes) {
    const std::size_t i = first + lane;
    const Window<kNodes> x(load(&p.points.x[i])), y(load(&p.points.y[i]));
    hn::StoreU(hn::ConvertTo(kIntTag, x.begin), kIntTag, batch.column + lane);
    hn::StoreU(hn::ConvertTo(kIntTag, y.begin), kIntTag, batch.row + lane);
    const Vec a = load(&p.a[i]), b = load(&p.b[i]), c = load(&p.c[i]), slope = load(&p.slope[i]), one = set(1);
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
          values[column] = weightOfForm<kFalloff>(hn::Add(hn::Mul(hn::Add(hn::Mul(a, dx), bdy), dx), cdy2), slope);
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

/// Calls add(values, weight) for the nodes of a window.
template <int kNodes, bool kOwn, class Add>
HWY_INLINE void eachNode(const GridTile& tile, const Batch& batch, std::size_t lane, float* values, const Add& add) {
  const std::int32_t* row =
      tile.nodeAt + static_cast<std::ptrdiff_t>(batch.row[lane]) * tile.pitch + batch.column[lane];
  const std::int32_t corner = *row;
  const std::ptrdiff_t step = tile.run, rowStep = step * tile.pitch;
  for (int r = 0; r < kNodes; ++r, row += tile.pitch)
    for (int c = 0; c < kNodes; ++c)
      add(values + (kOwn ? corner + r * rowStep + c * step : row[c]), batch.weight[r * kNodes + c][lane]);
}

/// Adds one particle of a batch that was weighed for this window. `kOwn`: the tile's nodes are its own, in even steps.
template <int kNodes, bool kOwn>
HWY_INLINE void putDown(GridTile& tile, const Batch& batch, std::size_t first, std::size_t lane) {
  GridParticles& p = tile.particles;
  const std::size_t i = first + lane;
  p.own[i] = batch.own[lane];
  const int group = p.firstBin[i] >> 2, place = tile.placeOfGroup(group), next = tile.placeOfGroup(group + 1);
  const bool both = p.lastBin[i] >> 2 > group && next >= 0;
  if (place < 0) return;
  for (std::size_t channel = 0; channel < tile.channels; ++channel) {
    const float scale = batch.scale[lane] * p.peak[channel][i];
    const Group share = scaled(batch.share[0] + kGroupBins * lane, scale),
                further = scaled(batch.share[1] + kGroupBins * lane, scale);
    float* values = tile.values[channel] + place;
    const auto shallow = [&](float* to, float weight) { addTo(to, weight, share); };
    const auto deep = [&](float* to, float weight) {
#if HWY_TARGET <= HWY_AVX2
      // Both groups at once: the same sums, with half of the loads and stores.
      const hn::FixedTag<float, 2 * kGroupBins> tag;
      addTo(tag, to, weight, hn::Combine(tag, further.part[0], share.part[0]));
#else
      addTo(to, weight, share);
      addTo(to + kGroupBins, weight, further);
#endif
    };
    if (both)
      eachNode<kNodes, kOwn>(tile, batch, lane, values, deep);
    else
      eachNode<kNodes, kOwn>(tile, batch, lane, values, shallow);
  }
}

/// Those of a batch that were weighed for this window.
template <int kNodes, bool kOwn>
HWY_NOINLINE void putDownBatch(GridTile& tile, const Batch& batch, std::size_t first, const int (&window)[kGridBatch]) {
  for (std::size_t lane = 0; lane < kGridBatch; ++lane)
    if (window[lane] == kNodes) putDown<kNodes, kOwn>(tile, batch, first, lane);
}

template <layout::uint kFalloff, int kNodes>
HWY_INLINE void fillBatch(GridTile& tile, std::size_t first, const int (&window)[kGridBatch], Batch& batch) {
  weigh<kFalloff, kNodes>(tile.particles, first, batch);
  if (tile.hasOwnNodes())
    putDownBatch<kNodes, true>(tile, batch, first, window);
  else
    putDownBatch<kNodes, false>(tile, batch, first, window);
}

template <layout::uint kFalloff>
HWY_NOINLINE void fillAll(GridTile& tile) {
  Batch batch;
  GridParticles& p = tile.particles;
  p.alone.clear();
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
    if (any[9]) fillBatch<kFalloff, 9>(tile, first, window, batch);
    if (any[10]) fillBatch<kFalloff, 10>(tile, first, window, batch);
    if (any[0] || any[kAlone])
      for (std::size_t lane = 0; lane < count; ++lane) {
        if (window[lane] == 0) p.own[first + lane] = 0;
        if (window[lane] == kAlone) p.alone.push_back(static_cast<std::uint32_t>(first + lane));
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

void sumAll(float* nodes, std::size_t count, int run) {
  for (float* end = nodes + count; nodes < end; nodes += run) {
#if HWY_TARGET == HWY_SCALAR
    float carry = 0;
#else
    auto carry = hn::Zero(kGroupTag);
#endif
    for (int bin = 0; bin < run; bin += kGroupBins) carry = sumGroup(nodes + bin, carry);
  }
}

void fill(GridTile& tile) {
  switch (tile.falloff) {
    case layout::kFalloffLinear: fillAll<layout::kFalloffLinear>(tile); break;
    case layout::kFalloffSphere: fillAll<layout::kFalloffSphere>(tile); break;
    default: fillAll<layout::kFalloffSmooth>(tile); break;
  }
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(fill);
HWY_EXPORT(sumAll);

void putDownBatches(GridTile& tile) { HWY_DYNAMIC_DISPATCH(fill)(tile); }
void sumRuns(std::span<float> nodes, int run) { HWY_DYNAMIC_DISPATCH(sumAll)(nodes.data(), nodes.size(), run); }

}  // namespace mote
#endif
