#include "tools/bench/plain_packets.h"

#include <cmath>

#include "host/core/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/bench/plain_packets.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kRays = 16;
using Tag = hn::CappedTag<float, kRays>;
using Vec = hn::Vec<Tag>;
constexpr Tag kTag;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));
constexpr int kVectors = kRays / kLanes;

HWY_INLINE Vec dot3(Vec ax, Vec ay, Vec az, Vec bx, Vec by, Vec bz) {
  return hn::MulAdd(ax, bx, hn::MulAdd(ay, by, hn::Mul(az, bz)));
}

/// (1 + x)² (2 − x) / 4 is ½ + ¾x − ¼x³.
HWY_INLINE Vec capOf(Vec t, Vec inverseChord) {
  const Vec one = hn::Set(kTag, 1.0f);
  const Vec x = hn::Min(hn::Max(hn::Mul(t, inverseChord), hn::Neg(one)), one);
  const Vec sum = hn::Add(one, x);
  return hn::Mul(hn::Mul(hn::Set(kTag, 0.25f), hn::Mul(sum, sum)), hn::Sub(hn::Set(kTag, 2.0f), x));
}

struct RayPacket {
  Vec originX[kVectors], originY[kVectors], originZ[kVectors];
  Vec directionX[kVectors], directionY[kVectors], directionZ[kVectors];
  Vec inverseX[kVectors], inverseY[kVectors], inverseZ[kVectors];
  Vec length[kVectors], depth[kVectors];
};

HWY_INLINE bool touches(const RayPacket& rays, const layout::Node& node) {
  for (int v = 0; v < kVectors; ++v) {
    const Vec ax = hn::Mul(hn::Sub(hn::Set(kTag, node.lo.x), rays.originX[v]), rays.inverseX[v]),
              bx = hn::Mul(hn::Sub(hn::Set(kTag, node.hi.x), rays.originX[v]), rays.inverseX[v]),
              ay = hn::Mul(hn::Sub(hn::Set(kTag, node.lo.y), rays.originY[v]), rays.inverseY[v]),
              by = hn::Mul(hn::Sub(hn::Set(kTag, node.hi.y), rays.originY[v]), rays.inverseY[v]),
              az = hn::Mul(hn::Sub(hn::Set(kTag, node.lo.z), rays.originZ[v]), rays.inverseZ[v]),
              bz = hn::Mul(hn::Sub(hn::Set(kTag, node.hi.z), rays.originZ[v]), rays.inverseZ[v]);
    const Vec enter = hn::Max(hn::Max(hn::Min(ax, bx), hn::Min(ay, by)), hn::Max(hn::Min(az, bz), hn::Zero(kTag)));
    const Vec leave = hn::Min(hn::Min(hn::Max(ax, bx), hn::Max(ay, by)), hn::Min(hn::Max(az, bz), rays.length[v]));
    if (!hn::AllFalse(kTag, hn::Le(enter, leave))) return true;
  }
  return false;
}

/// True if the box is farther than a diameter of its greatest support from both ends of every ray.
HWY_INLINE bool between(const RayPacket& rays, const layout::Node& node, float greatestRadius) {
  for (int v = 0; v < kVectors; ++v) {
    // Least and greatest place of the box along each ray.
    const auto span = [](Vec origin, Vec direction, float lo, float hi, Vec& least, Vec& most) {
      const Vec a = hn::Mul(hn::Sub(hn::Set(kTag, lo), origin), direction),
                b = hn::Mul(hn::Sub(hn::Set(kTag, hi), origin), direction);
      least = hn::Add(least, hn::Min(a, b)), most = hn::Add(most, hn::Max(a, b));
    };
    Vec least = hn::Zero(kTag), most = hn::Zero(kTag);
    span(rays.originX[v], rays.directionX[v], node.lo.x, node.hi.x, least, most);
    span(rays.originY[v], rays.directionY[v], node.lo.y, node.hi.y, least, most);
    span(rays.originZ[v], rays.directionZ[v], node.lo.z, node.hi.z, least, most);
    const Vec away = hn::Set(kTag, greatestRadius);
    if (!hn::AllTrue(kTag, hn::And(hn::Gt(least, away), hn::Gt(hn::Sub(rays.length[v], most), away)))) return false;
  }
  return true;
}

template <bool kEnds>
HWY_INLINE void addLeaf(const Octree& tree, std::uint32_t begin, std::uint32_t end, std::uint32_t firstSlot,
                        RayPacket& rays) {
  const hn::RebindToUnsigned<Tag> slotTag;
  const Vec one = hn::Set(kTag, 1.0f), zero = hn::Zero(kTag);
  for (std::uint32_t slot = begin; slot < end; ++slot) {
    const float radius = tree.radius[slot];
    const Vec px = hn::Set(kTag, tree.x[slot]), py = hn::Set(kTag, tree.y[slot]), pz = hn::Set(kTag, tree.z[slot]);
    const Vec inverseSquare = hn::Set(kTag, 1 / (radius * radius)), peak = hn::Set(kTag, tree.peak[slot]);
    for (int v = 0; v < kVectors; ++v) {
      const Vec dx = hn::Sub(px, rays.originX[v]), dy = hn::Sub(py, rays.originY[v]), dz = hn::Sub(pz, rays.originZ[v]);
      const Vec t = dot3(dx, dy, dz, rays.directionX[v], rays.directionY[v], rays.directionZ[v]);
      const Vec ex = hn::NegMulAdd(t, rays.directionX[v], dx), ey = hn::NegMulAdd(t, rays.directionY[v], dy),
                ez = hn::NegMulAdd(t, rays.directionZ[v], dz);
      const Vec u = hn::Max(hn::NegMulAdd(dot3(ex, ey, ez, ex, ey, ez), inverseSquare, one), zero);
      Vec share = hn::Mul(u, u);
      if constexpr (kEnds) {
        const Vec chord = hn::Max(hn::Mul(hn::Set(kTag, radius), hn::Sqrt(u)), hn::Set(kTag, 1e-30f));
        const Vec inverseChord = hn::Div(one, chord);
        share = hn::Mul(share, hn::Mul(capOf(t, inverseChord), capOf(hn::Sub(rays.length[v], t), inverseChord)));
        const auto own =
            hn::Eq(hn::Iota(slotTag, firstSlot + static_cast<std::uint32_t>(v) * kLanes), hn::Set(slotTag, slot));
        share = hn::IfThenZeroElse(hn::RebindMask(kTag, own), share);
      }
      rays.depth[v] = hn::MulAdd(peak, share, rays.depth[v]);
    }
  }
}

/// Rays of the slots from `first` on; lanes past the end repeat the last slot.
RayPacket makeRays(const Octree& tree, const layout::Light& light, std::size_t first, std::size_t count) {
  alignas(64) float x[kRays], y[kRays], z[kRays], dx[kRays], dy[kRays], dz[kRays], length[kRays];
  for (std::size_t lane = 0; lane < kRays; ++lane) {
    const vec3 origin = tree.position(std::min(first + lane, count - 1));
    const bool directional = light.type == layout::kLightDirectional;
    const vec3 toLight = directional ? -light.direction : light.position - origin;
    const float distance = glm::length(toLight);
    const vec3 d = distance > 0 ? toLight / distance : vec3(1, 0, 0);
    x[lane] = origin.x, y[lane] = origin.y, z[lane] = origin.z;
    dx[lane] = d.x, dy[lane] = d.y, dz[lane] = d.z;
    length[lane] = directional ? 1e30f : distance;
  }
  const auto inverse = [](Vec d) {
    const Vec least = hn::Set(kTag, 1e-18f);
    return hn::Div(hn::Set(kTag, 1.0f), hn::IfThenElse(hn::Lt(hn::Abs(d), least), least, d));
  };
  RayPacket rays;
  for (int v = 0; v < kVectors; ++v) {
    rays.originX[v] = hn::Load(kTag, x + v * kLanes), rays.originY[v] = hn::Load(kTag, y + v * kLanes);
    rays.originZ[v] = hn::Load(kTag, z + v * kLanes);
    rays.directionX[v] = hn::Load(kTag, dx + v * kLanes), rays.directionY[v] = hn::Load(kTag, dy + v * kLanes);
    rays.directionZ[v] = hn::Load(kTag, dz + v * kLanes);
    rays.inverseX[v] = inverse(rays.directionX[v]), rays.inverseY[v] = inverse(rays.directionY[v]);
    rays.inverseZ[v] = inverse(rays.directionZ[v]);
    rays.length[v] = hn::Load(kTag, length + v * kLanes);
    rays.depth[v] = hn::Zero(kTag);
  }
  return rays;
}

void plainPacket(const Octree& tree, const layout::Light& light, std::size_t first, float limit, float greatestRadius,
                 float* depths) {
  const std::size_t count = tree.particleCount();
  RayPacket rays = makeRays(tree, light, first, count);
  const auto nodes = static_cast<std::uint32_t>(tree.nodeCount());
  for (std::uint32_t index = 0; index < nodes;) {
    const layout::Node& node = tree.nodes[index];
    if (!touches(rays, node)) {
      index = node.skip;
      continue;
    }
    if (node.skip != ++index) continue;
    const std::uint32_t end = tree.nodes[index].first;
    if (between(rays, node, greatestRadius))
      addLeaf<false>(tree, node.first, end, static_cast<std::uint32_t>(first), rays);
    else
      addLeaf<true>(tree, node.first, end, static_cast<std::uint32_t>(first), rays);
    bool dark = true;
    for (int v = 0; v < kVectors; ++v) dark = dark && hn::AllTrue(kTag, hn::Gt(rays.depth[v], hn::Set(kTag, limit)));
    if (dark) break;
  }
  alignas(64) float sums[kRays];
  for (int v = 0; v < kVectors; ++v) hn::Store(rays.depth[v], kTag, sums + v * kLanes);
  for (std::size_t lane = 0; lane < kRays && first + lane < count; ++lane) depths[first + lane] = sums[lane];
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(plainPacket);

std::vector<float> plainPacketDepths(const Octree& tree, const layout::Light& light, const LightingOptions& options) {
  constexpr std::size_t kTaskRays = 1024;
  std::vector<float> depths(tree.particleCount());
  const float greatest = *std::max_element(tree.radius.begin(), tree.radius.end());
  const float limit = opticalDepthLimit(light, options);
  parallelBlocks(depths.size(), kTaskRays, [&](std::size_t begin, std::size_t end) {
    for (std::size_t first = begin; first < end; first += 16)
      HWY_DYNAMIC_DISPATCH(plainPacket)(tree, light, first, limit, greatest, depths.data());
  });
  return depths;
}

}  // namespace mote
#endif
