// The steps of beam_scalar.cpp on vectors, compiled once for each instruction set (Google Highway). No multiply-add is
// fused, so that every instruction set and the scalar path round alike.
#include <cmath>

#include "host/core/error.h"
#include "host/lighting/exact/beam_kernel.h"
#include "host/lighting/exact/rules.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/exact/beam_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/cache_control.h>
#include <hwy/highway.h>
#include "host/lighting/exact/cap-inl.h"
#include "host/lighting/falloff-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, kPacketRays>;
using Vec = hn::Vec<Tag>;
constexpr Tag kTag;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));
constexpr int kVectors = kPacketRays / kLanes;

HWY_INLINE Vec dot3(Vec ax, Vec ay, Vec az, Vec bx, Vec by, Vec bz) {
  return hn::Add(hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by)), hn::Mul(az, bz));
}

// ---- gather

using PlaneTag = hn::CappedTag<float, 8>;
constexpr PlaneTag kPlaneTag;

HWY_INLINE bool outside(const ColumnPlanes& planes, const layout::Node& node) {
  const vec3 half = 0.5f * (node.hi - node.lo), centre = 0.5f * (node.lo + node.hi) - planes.origin;
  const auto set = [](float x) { return hn::Set(kPlaneTag, x); };
  const auto cx = set(centre.x), cy = set(centre.y), cz = set(centre.z);
  const auto hx = set(half.x), hy = set(half.y), hz = set(half.z);
  for (int k = 0; k < 8; k += static_cast<int>(hn::Lanes(kPlaneTag))) {
    const auto load = [k](const float* from) { return hn::Load(kPlaneTag, from + k); };
    const auto distance =
        hn::Add(hn::Add(hn::Mul(cx, load(planes.x)), hn::Mul(cy, load(planes.y))), hn::Mul(cz, load(planes.z)));
    const auto reach = hn::Add(hn::Add(hn::Mul(hx, load(planes.absX)), hn::Mul(hy, load(planes.absY))),
                               hn::Mul(hz, load(planes.absZ)));
    if (!hn::AllFalse(kPlaneTag, hn::Gt(hn::Sub(distance, load(planes.offset)), reach))) return true;
  }
  return false;
}

/// Appends `values` where the mask is set.
HWY_INLINE void append(Vec values, hn::Mask<Tag> mask, float* to) { hn::StoreU(hn::Compress(values, mask), kTag, to); }

template <int kChannels>
HWY_INLINE void gatherLeaf(const Octree& tree, std::uint32_t begin, std::uint32_t end, const ColumnPlanes& planes,
                           GatheredParticles& found) {
  const hn::RebindToUnsigned<Tag> slotTag;
  const Vec ox = hn::Set(kTag, planes.origin.x), oy = hn::Set(kTag, planes.origin.y),
            oz = hn::Set(kTag, planes.origin.z);
  std::size_t count = found.count;
  for (std::uint32_t slot = begin; slot < end; slot += kLanes) {
    const Vec radius = hn::LoadU(kTag, tree.radius.data() + slot);
    const Vec px = hn::LoadU(kTag, tree.x.data() + slot), py = hn::LoadU(kTag, tree.y.data() + slot),
              pz = hn::LoadU(kTag, tree.z.data() + slot);
    const Vec x = hn::Sub(px, ox), y = hn::Sub(py, oy), z = hn::Sub(pz, oz);
    auto mask = hn::And(hn::FirstN(kTag, end - slot), hn::Gt(radius, hn::Zero(kTag)));
    for (int k = 0; k < kColumnPlanes; ++k) {
      const Vec distance =
          dot3(x, y, z, hn::Set(kTag, planes.x[k]), hn::Set(kTag, planes.y[k]), hn::Set(kTag, planes.z[k]));
      mask = hn::And(mask, hn::Le(hn::Sub(distance, hn::Set(kTag, planes.offset[k])), radius));
    }
    if (hn::AllFalse(kTag, mask)) continue;
    append(px, mask, &found.x[count]), append(py, mask, &found.y[count]), append(pz, mask, &found.z[count]);
    append(radius, mask, &found.radius[count]);
    append(hn::LoadU(kTag, tree.peak.data() + slot), mask, &found.peak[0][count]);
    if constexpr (kChannels == 3) {
      append(hn::LoadU(kTag, tree.peakGreen.data() + slot), mask, &found.peak[1][count]);
      append(hn::LoadU(kTag, tree.peakBlue.data() + slot), mask, &found.peak[2][count]);
    }
    const auto slots = hn::Iota(slotTag, slot);
    hn::StoreU(hn::Compress(slots, hn::RebindMask(slotTag, mask)), slotTag, &found.slot[count]);
    count += hn::CountTrue(kTag, mask);
  }
  found.count = count;
}

/// Asks for what gatherLeaf will load.
template <int kChannels>
HWY_INLINE void fetchLeaf(const Octree& tree, std::uint32_t begin, std::uint32_t end) {
  constexpr std::uint32_t kLine = 64 / sizeof(float);
  const float* arrays[] = {tree.radius.data(), tree.x.data(),         tree.y.data(),       tree.z.data(),
                           tree.peak.data(),   tree.peakGreen.data(), tree.peakBlue.data()};
  for (int k = 0; k < kChannels + 4; ++k)
    for (std::uint32_t slot = begin; slot < end; slot += kLine) hwy::Prefetch(arrays[k] + slot);
}

template <int kChannels>
HWY_NOINLINE void gatherTree(const Octree& tree, Column& column) {
  // A few leaves behind the walk, so that they have come from memory when they are looked at.
  constexpr std::uint32_t kAhead = 4;
  struct Leaf {
    std::uint32_t begin, end;
  } leaves[kAhead];
  std::uint32_t met = 0;
  GatheredParticles& found = column.gathered;
  found.count = 0;
  const auto gather = [&](const Leaf& leaf) {
    found.reserve(leaf.end - leaf.begin, kChannels);
    gatherLeaf<kChannels>(tree, leaf.begin, leaf.end, column.planes, found);
  };
  const layout::Node* nodes = tree.nodes.data();
  const auto count = static_cast<std::uint32_t>(tree.nodeCount());
  for (std::uint32_t index = 0; index < count;) {
    const layout::Node& node = nodes[index];
    if (outside(column.planes, node)) {
      index = node.skip;
      continue;
    }
    if (node.skip != ++index) continue;  // not a leaf
    Leaf& leaf = leaves[met++ % kAhead];
    if (met > kAhead) gather(leaf);
    leaf = {node.first, nodes[index].first};
    fetchLeaf<kChannels>(tree, leaf.begin, leaf.end);
  }
  for (std::uint32_t k = met > kAhead ? met - kAhead : 0; k < met; ++k) gather(leaves[k % kAhead]);
}

void gather(const Octree& tree, Column& column) {
  return tree.channels() == 1 ? gatherTree<1>(tree, column) : gatherTree<3>(tree, column);
}

// ---- place

using Wide = hn::CappedTag<double, 8>;
using Narrow = hn::Rebind<float, Wide>;
using WideVec = hn::Vec<Wide>;
constexpr Wide kWide;
constexpr Narrow kNarrow;

HWY_INLINE WideVec widen(const float* from) { return hn::PromoteTo(kWide, hn::LoadU(kNarrow, from)); }
HWY_INLINE void store(WideVec value, float* to) { hn::StoreU(hn::DemoteTo(kNarrow, value), kNarrow, to); }
HWY_INLINE void storeBoth(WideVec value, float* to, float* low) {
  const auto rounded = hn::DemoteTo(kNarrow, value);
  hn::StoreU(rounded, kNarrow, to);
  store(hn::Sub(value, hn::PromoteTo(kWide, rounded)), low);
}
HWY_INLINE WideVec along(WideVec x, WideVec y, WideVec z, const dvec3& axis) {
  return hn::Add(hn::Add(hn::Mul(x, hn::Set(kWide, axis.x)), hn::Mul(y, hn::Set(kWide, axis.y))),
                 hn::Mul(z, hn::Set(kWide, axis.z)));
}

template <bool kPerspective>
HWY_NOINLINE void placeAll(Column& column) {
  const LightFrame& frame = column.frame;
  const GatheredParticles& found = column.gathered;
  PlacedParticles& placed = column.placed;
  placed.resize(found.count);
  const WideVec one = hn::Set(kWide, 1.0), base = hn::Set(kWide, column.depthBase);
  for (std::size_t i = 0; i < found.count; i += hn::Lanes(kWide)) {
    const WideVec r = widen(&found.radius[i]);
    const WideVec px = hn::Sub(widen(&found.x[i]), hn::Set(kWide, frame.origin.x)),
                  py = hn::Sub(widen(&found.y[i]), hn::Set(kWide, frame.origin.y)),
                  pz = hn::Sub(widen(&found.z[i]), hn::Set(kWide, frame.origin.z));
    const WideVec x = along(px, py, pz, frame.u), y = along(px, py, pz, frame.v), z = along(px, py, pz, frame.axis);
    WideVec u = x, v = y, depth = z, extent = r, perRadius = hn::Div(one, r);
    if constexpr (kPerspective) {
      depth = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
      u = hn::Div(x, z), v = hn::Div(y, z), extent = hn::Div(r, z), perRadius = hn::Div(z, r);
      store(hn::Div(hn::Set(kWide, 0.5), depth), &placed.sagFirst[i]);
      store(hn::Div(one, hn::Mul(depth, depth)), &placed.sagRatio[i]);
      store(x, &placed.nearX[i]), store(y, &placed.nearY[i]), store(z, &placed.nearZ[i]);
      std::uint8_t nearBits[8] = {}, aheadBits[8] = {};
      hn::StoreMaskBits(kWide, hn::Lt(depth, hn::Mul(hn::Set(kWide, kNearLightRadii), r)), nearBits);
      hn::StoreMaskBits(kWide, hn::Gt(z, hn::Mul(hn::Set(kWide, kLeastCosine), depth)), aheadBits);
      for (std::size_t lane = 0; lane < hn::Lanes(kWide); ++lane)
        placed.place[i + lane] = nearBits[0] >> lane & 1    ? Place::NearLight
                                 : aheadBits[0] >> lane & 1 ? Place::Sorted
                                                            : Place::Behind;
    } else {
      const auto zero = hn::Zero(kNarrow);
      hn::StoreU(zero, kNarrow, &placed.sagFirst[i]), hn::StoreU(zero, kNarrow, &placed.sagRatio[i]);
      for (std::size_t lane = 0; lane < hn::Lanes(kWide); ++lane) placed.place[i + lane] = Place::Sorted;
    }
    storeBoth(u, &placed.u[i], &placed.uLow[i]), storeBoth(v, &placed.v[i], &placed.vLow[i]);
    store(extent, &placed.extent[i]);
    store(hn::Min(hn::Mul(perRadius, perRadius), hn::Set(kWide, kGreatestInverseArea)), &placed.inverseArea[i]);
    store(hn::Sub(hn::Add(depth, r), base), &placed.reach[i]);
    store(hn::Sub(hn::Sub(depth, hn::Mul(hn::Set(kWide, kBehindRadii), r)), base), &placed.behind[i]);
    storeBoth(hn::Sub(depth, base), &placed.depth[i], &placed.depthLow[i]);
  }
}

void place(Column& column) { return column.frame.perspective ? placeAll<true>(column) : placeAll<false>(column); }

// ---- choose

HWY_INLINE Vec turned(Vec u, Vec v, const float (&row)[3]) {
  return hn::Add(hn::Add(hn::Mul(u, hn::Set(kTag, row[0])), hn::Mul(v, hn::Set(kTag, row[1]))), hn::Set(kTag, row[2]));
}

template <int kChannels>
HWY_NOINLINE void chooseAll(const Column& column, Beam& beam) {
  const hn::RebindToUnsigned<Tag> indexTag;
  const SortedParticles& from = column.sorted;
  BeamParticles& to = beam.particles;
  to.resize(from.count, kChannels);
  std::size_t count = 0;
  const Vec lowU = hn::Set(kTag, beam.lowU), highU = hn::Set(kTag, beam.highU), lowV = hn::Set(kTag, beam.lowV),
            highV = hn::Set(kTag, beam.highV), extentScale = hn::Set(kTag, beam.extentScale);
  for (std::size_t k = 0; k < from.count; k += kLanes) {
    const Vec u = hn::LoadU(kTag, &from.u[k]), v = hn::LoadU(kTag, &from.v[k]);
    const Vec extent = hn::Mul(hn::LoadU(kTag, &from.extent[k]), extentScale);
    const auto inU = hn::And(hn::Le(hn::Sub(u, extent), highU), hn::Ge(hn::Add(u, extent), lowU));
    const auto inV = hn::And(hn::Le(hn::Sub(v, extent), highV), hn::Ge(hn::Add(v, extent), lowV));
    const auto mask = hn::And(hn::And(inU, inV), hn::FirstN(kTag, from.count - k));
    if (hn::AllFalse(kTag, mask)) continue;
    const Vec w = turned(u, v, beam.turn[2]);
    append(hn::Div(turned(u, v, beam.turn[0]), w), mask, &to.u[count]);
    append(hn::Div(turned(u, v, beam.turn[1]), w), mask, &to.v[count]);
    append(hn::Mul(hn::LoadU(kTag, &from.inverseArea[k]), hn::Mul(w, w)), mask, &to.inverseArea[count]);
    for (int c = 0; c < kChannels; ++c) append(hn::LoadU(kTag, &from.peak[c][k]), mask, &to.peak[c][count]);
    append(hn::LoadU(kTag, &from.reach[k]), mask, &to.reach[count]);
    const auto index = hn::LoadU(indexTag, &from.index[k]);
    hn::StoreU(hn::Compress(index, hn::RebindMask(indexTag, mask)), indexTag, &to.index[count]);
    count += hn::CountTrue(kTag, mask);
  }
  to.count = count;
}

void choose(const Column& column, std::size_t channels, Beam& beam) {
  return channels == 1 ? chooseAll<1>(column, beam) : chooseAll<3>(column, beam);
}

// ---- sum

template <layout::uint kFalloff>
HWY_INLINE Vec softShare(Vec q, Vec t, float radius, float inverseRadius) {
  const Vec s = hn::Sqrt(hn::Max(hn::Sub(hn::Set(kTag, 1.0f), q), hn::Zero(kTag)));
  if constexpr (kFalloff != layout::kFalloffSmooth) {
    return hn::Mul(falloffOf<kFalloff>(kTag, q), capOf(kTag, t, hn::Mul(hn::Set(kTag, radius), s)));
  } else {
    const Vec x = hn::Min(hn::Max(hn::Mul(t, hn::Set(kTag, inverseRadius)), hn::Sub(hn::Zero(kTag), s)), s);
    const Vec sum = hn::Add(s, x);
    return hn::Mul(hn::Mul(hn::Mul(hn::Set(kTag, 0.25f), s), hn::Mul(sum, sum)), hn::Sub(hn::Add(s, s), x));
  }
}

/// The sum of one packet, with everything that is decided at compile time. Sums and places of the rays stay in
/// registers (or, where vectors are narrower than sixteen, in the first cache).
template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint, bool kCareful>
class PacketSum {
 public:
  HWY_INLINE PacketSum(const Column& column, const Beam& beam, std::size_t packet)
      : column_(column), beam_(beam), packet_(packet), first_(packet * kPacketRays) {
    for (int v = 0; v < kVectors; ++v) {
      u_[v] = load(beam.rays.u, v), v_[v] = load(beam.rays.v, v);
      for (int c = 0; c < kChannels; ++c) sums_[c][v] = hn::Zero(kTag);
    }
  }

  HWY_INLINE void run(float limit) {
    const PacketRange range = packetRange(column_, beam_, packet_);
    const float* behind = column_.placed.behind.data();
    const std::uint32_t* index = beam_.particles.index.data();
    for (std::size_t k = range.end; k-- > range.between;)
      if (behind[index[k]] < range.deepest) addNearStart(k, index[k]);
    for (std::size_t end = range.between; end > 0;) {
      if (allBeyond(limit)) return;
      const std::size_t begin = end > kStride ? end - kStride : 0;
      for (std::size_t k = end; k-- > begin;) addBetween(k);
      end = begin;
    }
    for (const std::uint32_t near : column_.nearLight) addNearLight(near);
  }

  HWY_INLINE void store(PacketSums& sums) const {
    for (int c = 0; c < kChannels; ++c)
      for (int v = 0; v < kVectors; ++v) hn::Store(sums_[c][v], kTag, sums.of[c] + v * kLanes);
  }

 private:
  HWY_INLINE Vec load(const std::vector<float>& array, int v) const {
    return hn::LoadU(kTag, array.data() + first_ + static_cast<std::size_t>(v) * kLanes);
  }

  HWY_INLINE Vec separation(int v, std::size_t k) const {
    const BeamParticles& p = beam_.particles;
    Vec du = hn::Sub(hn::Set(kTag, p.u[k]), u_[v]), dv = hn::Sub(hn::Set(kTag, p.v[k]), v_[v]);
    if constexpr (!kCareful) {
      return hn::Mul(hn::Add(hn::Mul(du, du), hn::Mul(dv, dv)), hn::Set(kTag, p.inverseArea[k]));
    } else {
      const std::uint32_t index = p.index[k];
      const BeamRays& rays = beam_.rays;
      du = hn::Add(du, hn::Sub(hn::Set(kTag, column_.placed.uLow[index]), load(rays.uLow, v)));
      dv = hn::Add(dv, hn::Sub(hn::Set(kTag, column_.placed.vLow[index]), load(rays.vLow, v)));
      const Vec cross = hn::Sub(hn::Mul(du, load(rays.slopeV, v)), hn::Mul(dv, load(rays.slopeU, v)));
      return hn::Mul(dot3(du, dv, cross, du, dv, cross),
                     hn::Mul(hn::Set(kTag, p.inverseArea[k]), load(rays.inverseNorm, v)));
    }
  }

  HWY_INLINE void addShare(int v, const std::vector<float> (&peaks)[3], std::size_t k, Vec share) {
    for (int c = 0; c < kChannels; ++c) sums_[c][v] = hn::Add(sums_[c][v], hn::Mul(hn::Set(kTag, peaks[c][k]), share));
  }

  HWY_INLINE Vec notSelf(int v, std::uint32_t slot, Vec share) const {
    const hn::RebindToUnsigned<Tag> slotTag;
    const auto selves = hn::LoadU(slotTag, beam_.rays.self.data() + first_ + static_cast<std::size_t>(v) * kLanes);
    return hn::IfThenZeroElse(hn::RebindMask(kTag, hn::Eq(selves, hn::Set(slotTag, slot))), share);
  }

  HWY_INLINE void addBetween(std::size_t k) {
    for (int v = 0; v < kVectors; ++v)
      addShare(v, beam_.particles.peak, k, falloffOf<kFalloff>(kTag, separation(v, k)));
  }

  HWY_INLINE void addNearStart(std::size_t k, std::uint32_t index) {
    const PlacedParticles& placed = column_.placed;
    const float radius = column_.gathered.radius[index], inverseRadius = 1.0f / radius;
    const Vec square = hn::Set(kTag, radius * radius), one = hn::Set(kTag, 1.0f);
    const std::uint32_t slot = column_.gathered.slot[index];
    for (int v = 0; v < kVectors; ++v) {
      const Vec q = separation(v, k);
      const Vec b2 = hn::Mul(q, square);
      const Vec inner = hn::Mul(hn::Set(kTag, 0.25f), hn::Mul(b2, hn::Set(kTag, placed.sagRatio[index])));
      const Vec sag = hn::Mul(hn::Mul(b2, hn::Set(kTag, placed.sagFirst[index])), hn::Add(one, inner));
      const Vec high = hn::Sub(load(beam_.rays.depth, v), hn::Set(kTag, placed.depth[index]));
      const Vec low = hn::Sub(load(beam_.rays.depthLow, v), hn::Set(kTag, placed.depthLow[index]));
      const Vec t = hn::Add(high, hn::Add(low, sag));
      Vec share;
      if constexpr (kEndpoint == layout::kEndpointSoft) {
        share = softShare<kFalloff>(q, t, radius, inverseRadius);
      } else {
        const Vec back = hn::Min(t, hn::Zero(kTag));
        share =
            falloffOf<kFalloff>(kTag, hn::Add(q, hn::Mul(hn::Mul(back, back), hn::Set(kTag, inverseSquareOf(radius)))));
      }
      addShare(v, beam_.particles.peak, k, notSelf(v, slot, share));
    }
  }

  HWY_INLINE void addNearLight(std::uint32_t index) {
    const PlacedParticles& placed = column_.placed;
    const Vec x = hn::Set(kTag, placed.nearX[index]), y = hn::Set(kTag, placed.nearY[index]),
              z = hn::Set(kTag, placed.nearZ[index]);
    const float radius = column_.gathered.radius[index];
    const std::uint32_t slot = column_.gathered.slot[index];
    for (int v = 0; v < kVectors; ++v) {
      const Vec dx = load(beam_.rays.x, v), dy = load(beam_.rays.y, v), dz = load(beam_.rays.z, v);
      const Vec length = load(beam_.rays.length, v);
      const Vec fromLight = dot3(x, y, z, dx, dy, dz);
      Vec s = fromLight;
      if constexpr (kEndpoint == layout::kEndpointClamp) s = hn::Min(hn::Max(s, hn::Zero(kTag)), length);
      const Vec ex = hn::Sub(x, hn::Mul(s, dx)), ey = hn::Sub(y, hn::Mul(s, dy)), ez = hn::Sub(z, hn::Mul(s, dz));
      const Vec q = hn::Mul(dot3(ex, ey, ez, ex, ey, ez), hn::Set(kTag, inverseSquareOf(radius)));
      Vec share = falloffOf<kFalloff>(kTag, q);
      if constexpr (kEndpoint == layout::kEndpointSoft) {
        const Vec halfChord =
            hn::Mul(hn::Set(kTag, radius), hn::Sqrt(hn::Max(hn::Sub(hn::Set(kTag, 1.0f), q), hn::Zero(kTag))));
        share = hn::Mul(hn::Mul(share, capOf(kTag, hn::Sub(length, fromLight), halfChord)),
                        capOf(kTag, fromLight, halfChord));
      }
      addShare(v, column_.gathered.peak, index, notSelf(v, slot, share));
    }
  }

  HWY_INLINE bool allBeyond(float limit) const {
    for (int c = 0; c < kChannels; ++c)
      for (int v = 0; v < kVectors; ++v)
        if (!hn::AllTrue(kTag, hn::Gt(sums_[c][v], hn::Set(kTag, limit)))) return false;
    return true;
  }

  const Column& column_;
  const Beam& beam_;
  std::size_t packet_, first_;
  Vec u_[kVectors], v_[kVectors], sums_[kChannels][kVectors];
};

template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint, bool kCareful>
HWY_NOINLINE void sumPacket(const Column& column, const Beam& beam, std::size_t packet, float limit, PacketSums& sums) {
  PacketSum<kChannels, kFalloff, kEndpoint, kCareful> sum(column, beam, packet);
  sum.run(limit);
  sum.store(sums);
}

void sum(const Column& column, const Beam& beam, std::size_t packet, std::size_t channels, const SumOptions& options,
         PacketSums& sums) {
  withRule(options.falloff, options.endpoint, [&]<layout::uint kFalloff, layout::uint kEndpoint>() {
    const float limit = options.opticalDepthLimit;
    if (channels == 1 && !beam.careful)
      sumPacket<1, kFalloff, kEndpoint, false>(column, beam, packet, limit, sums);
    else if (channels == 1)
      sumPacket<1, kFalloff, kEndpoint, true>(column, beam, packet, limit, sums);
    else if (!beam.careful)
      sumPacket<3, kFalloff, kEndpoint, false>(column, beam, packet, limit, sums);
    else
      sumPacket<3, kFalloff, kEndpoint, true>(column, beam, packet, limit, sums);
  });
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(gather);
HWY_EXPORT(place);
HWY_EXPORT(choose);
HWY_EXPORT(sum);

const BeamKernel& simdBeamKernel() {
  static const BeamKernel kernel{[](const Octree& tree, Column& column) {
                                   HWY_DYNAMIC_DISPATCH(gather)
                                   (tree, column);
                                 },
                                 [](Column& column) {
                                   HWY_DYNAMIC_DISPATCH(place)
                                   (column);
                                 },
                                 [](const Column& column, std::size_t channels, Beam& beam) {
                                   HWY_DYNAMIC_DISPATCH(choose)(column, channels, beam);
                                 },
                                 [](const Column& column, const Beam& beam, std::size_t packet, std::size_t channels,
                                    const SumOptions& options, PacketSums& sums) {
                                   HWY_DYNAMIC_DISPATCH(sum)(column, beam, packet, channels, options, sums);
                                 }};
  return kernel;
}

}  // namespace mote
#endif
