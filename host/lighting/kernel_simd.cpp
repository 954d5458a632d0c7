// The walk of kernel_scalar.cpp on vectors, compiled once for each instruction set (Google Highway).
//
// Two stages a leaf: sixteen particles at a time are held against the packet's shaft; each that passes is broadcast to
// the packet's sixteen rays. No multiply-add is fused, so that every instruction set and the scalar path round alike.
#include "host/core/error.h"
#include "host/lighting/kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/kernel_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
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

/// A packet's rays in registers (or, where vectors are narrower than sixteen, in the first cache).
struct RayVectors {
  Vec originX[kVectors], originY[kVectors], originZ[kVectors];
  Vec directionX[kVectors], directionY[kVectors], directionZ[kVectors];
};

HWY_INLINE RayVectors loadRays(const Packet& packet, const Rays& rays) {
  RayVectors vectors;
  for (int v = 0; v < kVectors; ++v) {
    vectors.originX[v] = hn::Load(kTag, rays.originX + v * kLanes);
    vectors.originY[v] = hn::Load(kTag, rays.originY + v * kLanes);
    vectors.originZ[v] = hn::Load(kTag, rays.originZ + v * kLanes);
    vectors.directionX[v] = hn::Load(kTag, packet.directionX + v * kLanes);
    vectors.directionY[v] = hn::Load(kTag, packet.directionY + v * kLanes);
    vectors.directionZ[v] = hn::Load(kTag, packet.directionZ + v * kLanes);
  }
  return vectors;
}

template <layout::uint kFalloff>
HWY_INLINE Vec falloffOf(Vec q) {
  const Vec one = hn::Set(kTag, 1.0f), zero = hn::Zero(kTag);
  if constexpr (kFalloff == layout::kFalloffLinear) {
    return hn::Max(hn::Sub(one, hn::Sqrt(q)), zero);
  } else {
    const Vec u = hn::Max(hn::Sub(one, q), zero);
    if constexpr (kFalloff == layout::kFalloffSphere)
      return hn::Sqrt(u);
    else
      return hn::Mul(u, u);
  }
}

HWY_INLINE Vec capOf(Vec t, Vec halfChord) {
  const Vec x = hn::Min(hn::Max(hn::Div(t, hn::Max(halfChord, hn::Set(kTag, 1e-30f))), hn::Set(kTag, -1.0f)),
                        hn::Set(kTag, 1.0f));
  const Vec inner = hn::Sub(hn::Set(kTag, 0.75f), hn::Mul(hn::Set(kTag, 0.25f), hn::Mul(x, x)));
  return hn::Add(hn::Set(kTag, 0.5f), hn::Mul(x, inner));
}

/// The sums so far. Passed by value to what is not inlined, so that the hot loop keeps them in registers.
template <int kChannels>
struct Depths {
  Vec of[kChannels][kVectors];
};

/// One particle in all lanes, relative to the rays' base.
template <int kChannels>
struct Particle {
  Vec x, y, z, inverseSquare, peak[kChannels];
};

template <int kChannels, layout::uint kFalloff>
HWY_INLINE void addBetween(const RayVectors& rays, const Particle<kChannels>& p, Depths<kChannels>& depths) {
  for (int v = 0; v < kVectors; ++v) {
    const Vec dx = hn::Sub(p.x, rays.originX[v]), dy = hn::Sub(p.y, rays.originY[v]),
              dz = hn::Sub(p.z, rays.originZ[v]);
    const Vec t = dot3(dx, dy, dz, rays.directionX[v], rays.directionY[v], rays.directionZ[v]);
    const Vec ex = hn::Sub(dx, hn::Mul(t, rays.directionX[v])), ey = hn::Sub(dy, hn::Mul(t, rays.directionY[v])),
              ez = hn::Sub(dz, hn::Mul(t, rays.directionZ[v]));
    const Vec q = hn::Mul(dot3(ex, ey, ez, ex, ey, ez), p.inverseSquare);
    const Vec share = falloffOf<kFalloff>(q);
    for (int c = 0; c < kChannels; ++c) depths.of[c][v] = hn::Add(depths.of[c][v], hn::Mul(p.peak[c], share));
  }
}

template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint>
HWY_INLINE void addNearEnd(const Packet& packet, const Rays& rays, const RayVectors& r, const Particle<kChannels>& p,
                           float radius, std::uint32_t slot, Depths<kChannels>& depths) {
  const hn::RebindToUnsigned<Tag> slotTag;
  for (int v = 0; v < kVectors; ++v) {
    const Vec dx = hn::Sub(p.x, r.originX[v]), dy = hn::Sub(p.y, r.originY[v]), dz = hn::Sub(p.z, r.originZ[v]);
    const Vec vx = r.directionX[v], vy = r.directionY[v], vz = r.directionZ[v];
    const Vec t = dot3(dx, dy, dz, vx, vy, vz);
    const Vec before = hn::Load(kTag, rays.before + v * kLanes), after = hn::Load(kTag, rays.after + v * kLanes);
    Vec share;
    if constexpr (kEndpoint == layout::kEndpointSoft) {
      const Vec ex = hn::Sub(dx, hn::Mul(t, vx)), ey = hn::Sub(dy, hn::Mul(t, vy)), ez = hn::Sub(dz, hn::Mul(t, vz));
      const Vec q = hn::Mul(dot3(ex, ey, ez, ex, ey, ez), p.inverseSquare);
      const Vec halfChord =
          hn::Mul(hn::Set(kTag, radius), hn::Sqrt(hn::Max(hn::Sub(hn::Set(kTag, 1.0f), q), hn::Zero(kTag))));
      share = hn::Mul(hn::Mul(falloffOf<kFalloff>(q), capOf(hn::Add(before, t), halfChord)),
                      capOf(hn::Sub(after, t), halfChord));
    } else {
      const Vec c = hn::Min(hn::Max(t, hn::Neg(before)), after);
      const Vec ex = hn::Sub(dx, hn::Mul(c, vx)), ey = hn::Sub(dy, hn::Mul(c, vy)), ez = hn::Sub(dz, hn::Mul(c, vz));
      share = falloffOf<kFalloff>(hn::Mul(dot3(ex, ey, ez, ex, ey, ez), p.inverseSquare));
    }
    const auto isSelf =
        hn::RebindMask(kTag, hn::Eq(hn::Load(slotTag, packet.self + v * kLanes), hn::Set(slotTag, slot)));
    for (int c = 0; c < kChannels; ++c)
      depths.of[c][v] = hn::Add(depths.of[c][v], hn::IfThenZeroElse(isSelf, hn::Mul(p.peak[c], share)));
  }
}

/// Bits of the lanes of kPacketRays particles from `slot` on: see Standing.
struct StandingBits {
  std::uint32_t candidate, between;
};

HWY_INLINE std::uint32_t bitsOf(hn::Mask<Tag> mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(kTag, mask, bytes);
  return static_cast<std::uint32_t>(bytes[0] | bytes[1] << 8);
}

HWY_INLINE StandingBits standingBits(const Octree& tree, const Packet& packet, std::uint32_t slot) {
  const Vec ax = hn::Set(kTag, packet.axisDirection.x), ay = hn::Set(kTag, packet.axisDirection.y),
            az = hn::Set(kTag, packet.axisDirection.z);
  StandingBits bits{0, 0};
  for (int v = 0; v < kVectors; ++v) {
    const std::size_t at = slot + static_cast<std::size_t>(v) * kLanes;
    const Vec wx = hn::Sub(hn::LoadU(kTag, tree.x.data() + at), hn::Set(kTag, packet.axisOrigin.x));
    const Vec wy = hn::Sub(hn::LoadU(kTag, tree.y.data() + at), hn::Set(kTag, packet.axisOrigin.y));
    const Vec wz = hn::Sub(hn::LoadU(kTag, tree.z.data() + at), hn::Set(kTag, packet.axisOrigin.z));
    const Vec radius = hn::LoadU(kTag, tree.radius.data() + at);
    const Vec t = dot3(wx, wy, wz, ax, ay, az);
    const Vec ex = hn::Sub(wx, hn::Mul(t, ax)), ey = hn::Sub(wy, hn::Mul(t, ay)), ez = hn::Sub(wz, hn::Mul(t, az));
    const Vec limit = hn::Add(radius, hn::Set(kTag, packet.tube));
    const Vec clear = hn::Add(hn::Mul(hn::Set(kTag, 1.4143f), radius), hn::Set(kTag, packet.ahead));
    const auto near = hn::Lt(dot3(ex, ey, ez, ex, ey, ez), hn::Mul(limit, limit));
    const auto ahead = hn::Gt(t, hn::Neg(hn::Add(radius, hn::Set(kTag, packet.behind))));
    const auto candidate = hn::And(hn::And(near, ahead), hn::Gt(radius, hn::Zero(kTag)));
    const auto between = hn::And(hn::Ge(t, clear), hn::Ge(hn::Sub(hn::Set(kTag, packet.axisLength), t), clear));
    bits.candidate |= bitsOf(candidate) << (v * kLanes);
    bits.between |= bitsOf(between) << (v * kLanes);
  }
  return bits;
}

template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint>
HWY_INLINE void addLeaf(const Octree& tree, std::uint32_t begin, std::uint32_t end, const Packet& packet,
                        const Rays& rays, const RayVectors& vectors, Depths<kChannels>& depths) {
  for (std::uint32_t group = begin; group < end; group += kPacketRays) {
    const StandingBits bits = standingBits(tree, packet, group);
    const std::uint32_t inLeaf = end - group >= kPacketRays ? 0xffffu : (1u << (end - group)) - 1;
    for (std::uint32_t left = bits.candidate & inLeaf; left != 0; left &= left - 1) {
      const auto bit = static_cast<std::uint32_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(left));
      const std::uint32_t slot = group + bit;
      const float radius = tree.radius[slot];
      Particle<kChannels> particle;
      particle.x = hn::Set(kTag, tree.x[slot] - rays.base.x);
      particle.y = hn::Set(kTag, tree.y[slot] - rays.base.y);
      particle.z = hn::Set(kTag, tree.z[slot] - rays.base.z);
      particle.inverseSquare = hn::Set(kTag, 1.0f / (radius * radius));
      particle.peak[0] = hn::Set(kTag, tree.peak[slot]);
      if constexpr (kChannels == 3) {
        particle.peak[1] = hn::Set(kTag, tree.peakGreen[slot]);
        particle.peak[2] = hn::Set(kTag, tree.peakBlue[slot]);
      }
      if (bits.between >> bit & 1)
        addBetween<kChannels, kFalloff>(vectors, particle, depths);
      else
        addNearEnd<kChannels, kFalloff, kEndpoint>(packet, rays, vectors, particle, radius, slot, depths);
    }
  }
}

template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint>
HWY_NOINLINE Depths<kChannels> addFarLeaf(const Octree& tree, const layout::Node& leaf, std::uint32_t end,
                                          const Packet& packet, Depths<kChannels> depths) {
  Rays moved;
  rebase(packet, centreOf(leaf), moved);
  addLeaf<kChannels, kFalloff, kEndpoint>(tree, leaf.first, end, packet, moved, loadRays(packet, moved), depths);
  return depths;
}

template <int kChannels>
HWY_INLINE bool allBeyond(const Depths<kChannels>& depths, float limit) {
  for (int c = 0; c < kChannels; ++c)
    for (int v = 0; v < kVectors; ++v)
      if (!hn::AllTrue(kTag, hn::Gt(depths.of[c][v], hn::Set(kTag, limit)))) return false;
  return true;
}

template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint>
HWY_NOINLINE void walk(const Octree& tree, float limit, Packet& packet) {
  const RayVectors vectors = loadRays(packet, packet.rays);
  Depths<kChannels> depths;
  for (int c = 0; c < kChannels; ++c)
    for (int v = 0; v < kVectors; ++v) depths.of[c][v] = hn::Load(kTag, packet.opticalDepth[c] + v * kLanes);
  const layout::Node* nodes = tree.nodes.data();
  const auto count = static_cast<std::uint32_t>(tree.nodeCount());
  for (std::uint32_t index = 0; index < count;) {
    const layout::Node& node = nodes[index];
    if (!touches(packet, node)) {
      index = node.skip;
      continue;
    }
    if (node.skip == ++index) {  // a leaf
      const std::uint32_t end = nodes[index].first;
      if (isFar(packet, centreOf(node)))
        depths = addFarLeaf<kChannels, kFalloff, kEndpoint>(tree, node, end, packet, depths);
      else
        addLeaf<kChannels, kFalloff, kEndpoint>(tree, node.first, end, packet, packet.rays, vectors, depths);
      if (allBeyond(depths, limit)) break;
    }
  }
  for (int c = 0; c < kChannels; ++c)
    for (int v = 0; v < kVectors; ++v) hn::Store(depths.of[c][v], kTag, packet.opticalDepth[c] + v * kLanes);
}

template <int kChannels, layout::uint kFalloff>
void walkEnds(const Octree& tree, const WalkOptions& options, Packet& packet) {
  if (options.endpoint == layout::kEndpointClamp)
    walk<kChannels, kFalloff, layout::kEndpointClamp>(tree, options.opticalDepthLimit, packet);
  else
    walk<kChannels, kFalloff, layout::kEndpointSoft>(tree, options.opticalDepthLimit, packet);
}

template <int kChannels>
void walkFalloff(const Octree& tree, const WalkOptions& options, Packet& packet) {
  switch (options.falloff) {
    case layout::kFalloffLinear: return walkEnds<kChannels, layout::kFalloffLinear>(tree, options, packet);
    case layout::kFalloffSphere: return walkEnds<kChannels, layout::kFalloffSphere>(tree, options, packet);
    default: return walkEnds<kChannels, layout::kFalloffSmooth>(tree, options, packet);
  }
}

void walkRule(const Octree& tree, const WalkOptions& options, Packet& packet) {
  return tree.channels() == 1 ? walkFalloff<1>(tree, options, packet) : walkFalloff<3>(tree, options, packet);
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(walkRule);

void walkSimd(const Octree& tree, const WalkOptions& options, Packet& packet) {
  HWY_DYNAMIC_DISPATCH(walkRule)(tree, options, packet);
}

std::vector<std::string> simdTargets() {
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) names.emplace_back(hwy::TargetName(target));
  return names;
}

void useSimdTarget(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);  // all of the machine's
  if (name.empty()) return;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets())
    if (name == hwy::TargetName(target)) return hwy::SetSupportedTargetsForTest(target);
  throw InputError("SIMD target", "", "one of this machine's instruction sets", name);
}

}  // namespace mote
#endif
