// Packets of single rays, compiled once for each instruction set (Google Highway). No multiply-add is fused, and sums
// are kept in sixteen lanes whatever a vector has, so that every instruction set gives the same bits.
#include "host/lighting/exact/ray.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "host/lighting/exact/rules.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/exact/ray_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
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

using Wide = hn::CappedTag<double, 8>;
using Narrow = hn::Rebind<float, Wide>;
using WideVec = hn::Vec<Wide>;
constexpr Wide kWide;
constexpr Narrow kNarrow;
constexpr int kWideLanes = static_cast<int>(hn::MaxLanes(Wide()));

HWY_INLINE Vec set(float x) { return hn::Set(kTag, x); }

/// Which boxes the rays cross between their ends.
class Crossing {
 public:
  Crossing(std::span<const Ray> rays, float slack) : all_((1u << rays.size()) - 1), slack_(slack) {
    for (std::size_t lane = 0; lane < kPacketRays; ++lane) {
      const Ray& ray = rays[std::min(lane, rays.size() - 1)];
      length_[lane] = static_cast<float>(ray.length) + slack;
      for (int k = 0; k < 3; ++k) {
        const double d = ray.direction[k];  // 0 · ∞ must not be
        origin_[k][lane] = static_cast<float>(ray.origin[k]);
        inverse_[k][lane] = static_cast<float>(1 / (d < 0 ? std::min(d, -1e-20) : std::max(d, 1e-20)));
      }
    }
  }

  /// A bit for each ray.
  HWY_INLINE unsigned operator()(const layout::Node& node) const {
    unsigned bits = 0;
    for (int v = 0; v < kVectors; ++v) {
      const auto load = [v](const float* from) { return hn::Load(kTag, from + v * kLanes); };
      Vec begin = set(-slack_), end = load(length_);
      for (int k = 0; k < 3; ++k) {
        const Vec origin = load(origin_[k]), inverse = load(inverse_[k]);
        const Vec low = hn::Mul(hn::Sub(set(node.lo[k] - slack_), origin), inverse);
        const Vec high = hn::Mul(hn::Sub(set(node.hi[k] + slack_), origin), inverse);
        begin = hn::Max(begin, hn::Min(low, high)), end = hn::Min(end, hn::Max(low, high));
      }
      std::uint8_t bytes[8] = {};
      hn::StoreMaskBits(kTag, hn::Le(begin, end), bytes);
      bits |= (bytes[0] | static_cast<unsigned>(bytes[1]) << 8) << (v * kLanes);
    }
    return bits & all_;
  }

 private:
  alignas(64) float origin_[3][kPacketRays];
  alignas(64) float inverse_[3][kPacketRays];
  alignas(64) float length_[kPacketRays];
  unsigned all_;
  float slack_;
};

/// A leaf's middle across the rays and along them, from either end, and how far the leaf goes along them.
struct LeafPlaces {
  alignas(64) float x[kPacketRays], y[kPacketRays], t[kPacketRays], rest[kPacketRays], reach[kPacketRays];
};

/// The packet's rays in double.
class Frames {
 public:
  explicit Frames(std::span<const Ray> rays) {
    for (std::size_t lane = 0; lane < kPacketRays; ++lane) {
      const Ray& ray = rays[std::min(lane, rays.size() - 1)];
      length_[lane] = ray.length;
      for (int k = 0; k < 3; ++k) {
        origin_[k][lane] = ray.origin[k];
        u_[k][lane] = ray.u[k], v_[k][lane] = ray.v[k], direction_[k][lane] = ray.direction[k];
      }
    }
  }

  HWY_INLINE void place(const vec3& middle, const vec3& half, LeafPlaces& places) const {
    for (int first = 0; first < kPacketRays; first += kWideLanes) {
      const auto load = [first](const double* from) { return hn::Load(kWide, from + first); };
      const auto store = [first](WideVec value, float* to) {
        hn::StoreU(hn::DemoteTo(kNarrow, value), kNarrow, to + first);
      };
      const auto offset = [&](int k) { return hn::Sub(hn::Set(kWide, double(middle[k])), load(origin_[k])); };
      const WideVec dx = offset(0), dy = offset(1), dz = offset(2);
      const auto along = [&](const double(&axis)[3][kPacketRays]) {
        return hn::Add(hn::Add(hn::Mul(dx, load(axis[0])), hn::Mul(dy, load(axis[1]))), hn::Mul(dz, load(axis[2])));
      };
      const WideVec t = along(direction_);
      store(along(u_), places.x), store(along(v_), places.y), store(t, places.t);
      store(hn::Sub(load(length_), t), places.rest);
      WideVec reach = hn::Zero(kWide);
      for (int k = 0; k < 3; ++k)
        reach = hn::Add(reach, hn::Mul(hn::Set(kWide, 1.001 * double(half[k])), hn::Abs(load(direction_[k]))));
      store(reach, places.reach);
    }
  }

 private:
  alignas(64) double origin_[3][kPacketRays];
  alignas(64) double u_[3][kPacketRays];
  alignas(64) double v_[3][kPacketRays];
  alignas(64) double direction_[3][kPacketRays];
  alignas(64) double length_[kPacketRays];
};

template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint>
class PacketOfRays {
 public:
  PacketOfRays(const Octree& tree, std::span<const Ray> rays)
      : tree_(tree), rays_(rays), peaks_{tree.peak.data(), tree.peakGreen.data(), tree.peakBlue.data()} {}

  HWY_INLINE void addLeaf(const LeafPlaces& places, const vec3& middle, std::size_t ray, std::uint32_t begin,
                          std::uint32_t end) {
    const bool self = rays_[ray].self >= begin && rays_[ray].self < end;
    if (places.t[ray] > places.reach[ray] && places.rest[ray] > places.reach[ray] && !self)
      addSlots<false>(places, middle, ray, begin, end);
    else
      addSlots<true>(places, middle, ray, begin, end);
  }

  void store(float (&sums)[3][kPacketRays]) const {
    for (int c = 0; c < kChannels; ++c)
      for (std::size_t ray = 0; ray < rays_.size(); ++ray) {
        sums[c][ray] = 0;
        for (const float lane : sums_[c][ray]) sums[c][ray] += lane;
      }
  }

 private:
  struct Axis {
    Vec x, y, z;
    HWY_INLINE explicit Axis(const dvec3& axis)
        : x(set(static_cast<float>(axis.x))), y(set(static_cast<float>(axis.y))), z(set(static_cast<float>(axis.z))) {}
    HWY_INLINE Vec along(Vec px, Vec py, Vec pz) const {
      return hn::Add(hn::Add(hn::Mul(px, x), hn::Mul(py, y)), hn::Mul(pz, z));
    }
  };

  /// `kEnds`: some may lie beyond an end, or be left out.
  template <bool kEnds>
  HWY_INLINE void addSlots(const LeafPlaces& places, const vec3& middle, std::size_t ray, std::uint32_t begin,
                           std::uint32_t end) {
    const Ray& r = rays_[ray];
    const Axis u(r.u), v(r.v), direction(r.direction);
    const Vec leafX = set(places.x[ray]), leafY = set(places.y[ray]), one = set(1.0f), zero = hn::Zero(kTag);
    const Vec mx = set(middle.x), my = set(middle.y), mz = set(middle.z);
    for (std::uint32_t slot = begin; slot < end; slot += kLanes) {
      const auto load = [slot](const std::vector<float>& from) { return hn::LoadU(kTag, from.data() + slot); };
      const Vec px = hn::Sub(load(tree_.x), mx), py = hn::Sub(load(tree_.y), my), pz = hn::Sub(load(tree_.z), mz);
      const Vec x = hn::Add(leafX, u.along(px, py, pz)), y = hn::Add(leafY, v.along(px, py, pz));
      const Vec radius = load(tree_.radius), r2 = hn::Mul(radius, radius);
      const Vec b2 = hn::Add(hn::Mul(x, x), hn::Mul(y, y));
      auto met = hn::Lt(b2, r2);
      if (slot + kLanes > end) met = hn::And(met, hn::FirstN(kTag, end - slot));
      if (hn::AllFalse(kTag, met)) continue;
      const Vec perSquare = hn::Min(hn::Div(one, r2), set(static_cast<float>(kGreatestInverseArea)));
      Vec q = hn::Mul(b2, perSquare), share;
      if constexpr (kEnds) {
        const Vec fromMiddle = direction.along(px, py, pz);
        const Vec t = hn::Add(set(places.t[ray]), fromMiddle), rest = hn::Sub(set(places.rest[ray]), fromMiddle);
        const hn::RebindToUnsigned<Tag> slotTag;
        met = hn::And(met, hn::RebindMask(kTag, hn::Ne(hn::Iota(slotTag, slot), hn::Set(slotTag, r.self))));
        if constexpr (kEndpoint == layout::kEndpointClamp) {
          const Vec beyond = hn::Min(hn::Min(t, rest), zero);
          share = falloffOf<kFalloff>(kTag, hn::Add(q, hn::Mul(hn::Mul(beyond, beyond), perSquare)));
        } else {
          const Vec halfChord = hn::Mul(radius, hn::Sqrt(hn::Max(hn::Sub(one, q), zero)));
          share =
              hn::Mul(falloffOf<kFalloff>(kTag, q), hn::Mul(capOf(kTag, t, halfChord), capOf(kTag, rest, halfChord)));
        }
      } else {
        share = falloffOf<kFalloff>(kTag, q);
      }
      for (int c = 0; c < kChannels; ++c) {
        float* sums = sums_[c][ray] + (slot - begin) % kPacketRays;
        const Vec depths = hn::Mul(hn::LoadU(kTag, peaks_[c] + slot), share);
        hn::Store(hn::Add(hn::Load(kTag, sums), hn::IfThenElseZero(met, depths)), kTag, sums);
      }
    }
  }

  const Octree& tree_;
  std::span<const Ray> rays_;
  const float* peaks_[3];
  alignas(64) float sums_[kChannels][kPacketRays][kPacketRays] = {};  ///< … of each ray in sixteen lanes
};

template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint>
HWY_NOINLINE void walk(const Octree& tree, std::span<const Ray> rays, float slack, float (&sums)[3][kPacketRays]) {
  const Crossing crosses(rays, slack);
  const Frames frames(rays);
  PacketOfRays<kChannels, kFalloff, kEndpoint> packet(tree, rays);
  LeafPlaces places;
  const layout::Node* nodes = tree.nodes.data();
  const auto count = static_cast<std::uint32_t>(tree.nodeCount());
  for (std::uint32_t index = 0; index < count;) {
    const layout::Node& node = nodes[index];
    unsigned bits = crosses(node);
    if (bits == 0) {
      index = node.skip;
      continue;
    }
    if (node.skip != ++index) continue;  // not a leaf
    const vec3 middle = 0.5f * (node.lo + node.hi);
    frames.place(middle, 0.5f * (node.hi - node.lo), places);
    for (; bits != 0; bits &= bits - 1)
      packet.addLeaf(places, middle, static_cast<std::size_t>(std::countr_zero(bits)), node.first, nodes[index].first);
  }
  packet.store(sums);
}

void sumPacketOfRays(const Octree& tree, std::span<const Ray> rays, layout::uint falloff, layout::uint endpoint,
                     float slack, float (&sums)[3][kPacketRays]) {
  withRule(falloff, endpoint, [&]<layout::uint kFalloff, layout::uint kEndpoint>() {
    if (tree.channels() == 1)
      walk<1, kFalloff, kEndpoint>(tree, rays, slack, sums);
    else
      walk<3, kFalloff, kEndpoint>(tree, rays, slack, sums);
  });
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(sumPacketOfRays);

Ray rayToLight(const Receivers& receivers, std::size_t receiver, const layout::Light& light) {
  Ray ray;
  ray.origin = dvec3(receivers.position(receiver));
  ray.self = receivers.selfOf(receiver);
  if (light.type == layout::kLightDirectional) {
    ray.direction = -glm::normalize(dvec3(light.direction));
  } else {
    const dvec3 way = dvec3(light.position) - ray.origin;
    ray.length = glm::length(way);
    ray.direction = way / ray.length;
  }
  const LightFrame frame = frameAbout(ray.origin, ray.direction, false);
  ray.u = frame.u, ray.v = frame.v;
  return ray;
}

void sumRays(const Octree& tree, std::span<const Ray> rays, layout::uint falloff, layout::uint endpoint, float slack,
             float (&sums)[3][kPacketRays]) {
  MOTE_CHECK(rays.size(), >, 0u);
  MOTE_CHECK(rays.size(), <=, std::size_t{kPacketRays});
  HWY_DYNAMIC_DISPATCH(sumPacketOfRays)(tree, rays, falloff, endpoint, slack, sums);
}

}  // namespace mote
#endif
