// What the files of a light grid's tile share that are compiled once for each instruction set (Google Highway).
//
// What is computed for a particle alone goes a vector of particles at a time; what it adds to its nodes, a group of
// bins at a time, four wide on every machine. No multiply-add is fused, so every instruction set gives the same bits.
#if defined(MOTE_LIGHTING_GRID_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MOTE_LIGHTING_GRID_VECTORS_INL_H
#undef MOTE_LIGHTING_GRID_VECTORS_INL_H
#else
#define MOTE_LIGHTING_GRID_VECTORS_INL_H
#endif

#include "host/lighting/falloff-inl.h"
#include "host/lighting/grid/tile.h"

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

HWY_INLINE Vec between(Vec from, Vec to, Vec at) { return hn::Add(from, hn::Mul(at, hn::Sub(to, from))); }

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
template <class D>
HWY_INLINE void addTo(D tag, float* to, float weight, hn::Vec<D> shares) {
  hn::StoreU(hn::Add(hn::LoadU(tag, to), hn::Mul(hn::Set(tag, weight), shares)), tag, to);
}
HWY_INLINE void addTo(float* to, float weight, const Group& shares) {
  for (std::size_t k = 0; k < kGroupBins / kGroupLanes; ++k)
    addTo(kGroupTag, to + k * kGroupLanes, weight, shares.part[k]);
}

/// Weights of a quadratic form, which rounding may have taken below 0 (KernelWeights). `slope`: GridParticles::slope.
template <layout::uint kFalloff>
HWY_INLINE Vec weightOfForm(Vec q, Vec slope) {
  if constexpr (kFalloff == layout::kFalloffSmooth) {
    const Vec u = hn::Sub(set(1), q), line = hn::Sub(set(1), hn::Mul(slope, q));
    return hn::Max(hn::Min(hn::Mul(u, u), line), hn::Zero(kTag));
  }
  if constexpr (kFalloff == layout::kFalloffLinear) q = hn::Max(q, hn::Zero(kTag));
  return falloffOf<kFalloff>(kTag, q);
}

/// depthShare, lane by lane.
template <class D, class V>
HWY_INLINE V depthShares(D d, V x) {
  const V a = hn::Min(hn::Abs(x), hn::Set(d, 1.0f)), a2 = hn::Mul(a, a);
  const V half = hn::Add(hn::Sub(hn::Mul(hn::Set(d, 0.9f), a), hn::Mul(hn::Set(d, 0.5f), hn::Mul(a2, a))),
                         hn::Mul(hn::Set(d, 0.1f), hn::Mul(hn::Mul(a2, a2), a2)));
  return hn::Add(hn::Set(d, 0.5f), hn::CopySignToAbs(half, x));
}

/// The share of each that its own place sees along the depth: between the edges of the bin, as a receiver reads.
HWY_INLINE Vec ownDepthShare(const GridParticles& p, std::size_t i, Vec depth, Vec inverse) {
  const Vec bin = hn::ConvertTo(kTag, hn::LoadU(kIntTag, &p.points.bin[i])),
            into = hn::Sub(load(&p.points.depth[i]), bin);
  const Vec before = depthShares(kTag, hn::Mul(hn::Sub(bin, depth), inverse));
  const Vec after = depthShares(kTag, hn::Mul(hn::Sub(hn::Add(bin, set(1)), depth), inverse));
  return hn::Add(before, hn::Mul(into, hn::Sub(after, before)));
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
