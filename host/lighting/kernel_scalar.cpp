// The walk in plain words. Everything here is single precision in a fixed order; kernel_simd.cpp does the same
// operations on vectors, and a test compares the bits.
#include <cmath>

#include "host/lighting/kernel.h"
#include "host/lighting/rules.h"

namespace mote {
namespace {

/// How one ray passes a point that is given relative to the rays' base.
struct Passage {
  float along;    ///< t: place of the closest point on the line, from the ray's origin
  float squared;  ///< b²
};

float squaredAt(const Packet& packet, const Rays& rays, int lane, const vec3& point, float along) {
  const float ex = point.x - rays.originX[lane] - along * packet.directionX[lane],
              ey = point.y - rays.originY[lane] - along * packet.directionY[lane],
              ez = point.z - rays.originZ[lane] - along * packet.directionZ[lane];
  return ex * ex + ey * ey + ez * ez;
}

Passage passage(const Packet& packet, const Rays& rays, int lane, const vec3& point) {
  const float dx = point.x - rays.originX[lane], dy = point.y - rays.originY[lane], dz = point.z - rays.originZ[lane];
  const float along = dx * packet.directionX[lane] + dy * packet.directionY[lane] + dz * packet.directionZ[lane];
  return {along, squaredAt(packet, rays, lane, point, along)};
}

/// Optical depth through a particle's centre in each channel.
template <int kChannels>
struct Peaks {
  float of[kChannels];
};

template <int kChannels>
Peaks<kChannels> peaksOf(const Octree& tree, std::uint32_t slot) {
  if constexpr (kChannels == 1)
    return {{tree.peak[slot]}};
  else
    return {{tree.peak[slot], tree.peakGreen[slot], tree.peakBlue[slot]}};
}

template <int kChannels>
void addShare(Packet& packet, int lane, const Peaks<kChannels>& peaks, float share) {
  for (int channel = 0; channel < kChannels; ++channel) packet.opticalDepth[channel][lane] += peaks.of[channel] * share;
}

/// A particle that lies wholly between the ends of every ray it can meet.
template <int kChannels, layout::uint kFalloff>
void addBetween(Packet& packet, const Rays& rays, const vec3& point, float inverseSquare,
                const Peaks<kChannels>& peaks) {
  for (int lane = 0; lane < kPacketRays; ++lane)
    addShare(packet, lane, peaks, falloff<kFalloff>(passage(packet, rays, lane, point).squared * inverseSquare));
}

/// A particle that may straddle an end, or be the ray's own.
template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint>
void addNearEnd(Packet& packet, const Rays& rays, const vec3& point, float radius, float inverseSquare,
                const Peaks<kChannels>& peaks, std::uint32_t slot) {
  for (int lane = 0; lane < kPacketRays; ++lane) {
    const Passage p = passage(packet, rays, lane, point);
    float share;
    if constexpr (kEndpoint == layout::kEndpointSoft) {
      const float q = p.squared * inverseSquare;
      const float halfChord = radius * std::sqrt(std::max(1.0f - q, 0.0f));
      share = falloff<kFalloff>(q) * cap(rays.before[lane] + p.along, halfChord) *
              cap(rays.after[lane] - p.along, halfChord);
    } else {
      // What lies behind an end counts from that end: the distance to the segment instead of the line.
      const float along = std::min(std::max(p.along, -rays.before[lane]), rays.after[lane]);
      share = falloff<kFalloff>(squaredAt(packet, rays, lane, point, along) * inverseSquare);
    }
    if (packet.self[lane] != slot) addShare(packet, lane, peaks, share);
  }
}

template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint>
void addLeaf(const Octree& tree, const layout::Node& leaf, std::uint32_t end, Packet& packet) {
  Rays moved;
  const bool far = isFar(packet, centreOf(leaf));
  if (far) rebase(packet, centreOf(leaf), moved);
  const Rays& rays = far ? moved : packet.rays;
  for (std::uint32_t slot = leaf.first; slot < end; ++slot) {
    const float radius = tree.radius[slot];
    const vec3 centre = tree.position(slot);
    const Standing stands = standing(packet, centre.x, centre.y, centre.z, radius);
    if (!stands.candidate || !(radius > 0)) continue;
    const float inverseSquare = 1.0f / (radius * radius);
    if (stands.between)
      addBetween<kChannels, kFalloff>(packet, rays, centre - rays.base, inverseSquare, peaksOf<kChannels>(tree, slot));
    else
      addNearEnd<kChannels, kFalloff, kEndpoint>(packet, rays, centre - rays.base, radius, inverseSquare,
                                                 peaksOf<kChannels>(tree, slot), slot);
  }
}

template <int kChannels>
bool allBeyond(const Packet& packet, float limit) {
  for (int channel = 0; channel < kChannels; ++channel)
    for (int lane = 0; lane < kPacketRays; ++lane)
      if (!(packet.opticalDepth[channel][lane] > limit)) return false;
  return true;
}

template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint>
void walk(const Octree& tree, float limit, Packet& packet) {
  const auto count = static_cast<std::uint32_t>(tree.nodeCount());
  for (std::uint32_t index = 0; index < count;) {
    const layout::Node& node = tree.nodes[index];
    if (!touches(packet, node)) {
      index = node.skip;
      continue;
    }
    if (node.skip == ++index) {  // a leaf
      addLeaf<kChannels, kFalloff, kEndpoint>(tree, node, tree.nodes[node.skip].first, packet);
      if (allBeyond<kChannels>(packet, limit)) return;
    }
  }
}

}  // namespace

void walkScalar(const Octree& tree, const WalkOptions& options, Packet& packet) {
  withRule(options.falloff, options.endpoint, [&]<layout::uint kFalloff, layout::uint kEndpoint>() {
    if (tree.channels() == 1)
      walk<1, kFalloff, kEndpoint>(tree, options.opticalDepthLimit, packet);
    else
      walk<3, kFalloff, kEndpoint>(tree, options.opticalDepthLimit, packet);
  });
}

}  // namespace mote
