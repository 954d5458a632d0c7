// Sixteen rays that start in neighbouring slots, and the shaft that holds them all.
//
// The shaft surrounds one axis: no ray strays farther from it than where it starts, which `slabLow` and `slabHigh` hold
// for box tests and `tube` for particle tests. What the shaft misses, no ray of the packet can hit, so one test of the
// axis stands for sixteen: a node or particle is tested once, and only what passes meets all the rays.
#pragma once
#include <cstdint>

#include "host/lighting/receivers.h"
#include "host/octree/octree.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

/// Rays a packet. Fixed, whatever the width of the vectors: decisions taken for a packet must not depend on the
/// machine.
constexpr int kPacketRays = 16;

/// The rays as the kernels take them: relative to a base, near which they are exact. A particle at `p` is tested at
/// p − base; the point of ray k nearest to the base is `origin`, and the ray's ends lie `before` and `after` from it.
struct Rays {
  alignas(64) float originX[kPacketRays], originY[kPacketRays], originZ[kPacketRays];
  alignas(64) float before[kPacketRays];  ///< distance from the ray's start to `origin`
  alignas(64) float after[kPacketRays];   ///< distance from `origin` to the light; +∞ for directional
  vec3 base;
};

struct Packet {
  Rays rays;  ///< base 0: origins are the particles, before 0, after the length
  alignas(64) float directionX[kPacketRays], directionY[kPacketRays],
      directionZ[kPacketRays];                     ///< unit, toward the light
  alignas(64) std::uint32_t self[kPacketRays];     ///< slot that the ray leaves out, or kNoSlot
  alignas(64) float opticalDepth[3][kPacketRays];  ///< the sums so far, as many as the tree has channels; start at 0
  /// Directions and lengths before rounding, for rebase().
  alignas(64) double exactX[kPacketRays], exactY[kPacketRays], exactZ[kPacketRays], exactLength[kPacketRays];

  vec3 axisOrigin;
  vec3 axisDirection;  ///< unit
  float axisLength;    ///< +∞ for directional
  vec3 inverseStep;    ///< 1 / (axis vector), the vector to the light or, for directional, the unit direction
  float firstStep;     ///< start of the segment in that parameter, ≤ 0: the hindmost origin
  float lastStep;      ///< … and its end: 1 (the light), farther where a ray starts beyond the light, or +∞
  vec3 slabLow;        ///< axisOrigin + spread: a slab's lower side, moved out by what the rays stray from the axis …
  vec3 slabHigh;       ///< … axisOrigin − spread: its upper side
  float tube;          ///< … and this near to the axis line
  float ahead;         ///< how far along the axis the foremost origin lies before axisOrigin, ≥ 0
  float behind;        ///< … and the hindmost behind it, ≥ 0
  float farDistance;   ///< leaves farther than this from axisOrigin need rebase()
};

/// What a tree's geometry asks of its packets.
struct PacketRules {
  float slack;        ///< for boxes and tubes: rounding of coordinates and directions, relative to the scene's extent
  float farDistance;  ///< 256 times the least radius: there the error of τ reaches 1e-4
};
/// `origins` bounds the rays' starts.
PacketRules packetRules(const Octree& tree, const Bounds& origins);

/// Rays from the receivers indices[0 … count) toward the light, 1 ≤ count ≤ 16. Lanes beyond count repeat the last ray.
/// A ray whose receiver sits exactly at the light has length 0 and some direction: its sum means nothing, and the
/// caller takes 0 instead.
Packet makePacket(const Receivers& receivers, const layout::Light& light, const std::uint32_t* indices, int count,
                  const PacketRules& rules);

/// One infinite ray, in all lanes, that leaves no particle out.
Packet makeLinePacket(const vec3& origin, const vec3& direction, const PacketRules& rules);

/// In single precision a ray is 1e-7 of the distance off where it passes a particle, which matters to b²/r² once the
/// distance is hundreds of radii. Beyond that, the rays are moved (in double) to a base in the leaf and are exact
/// again.
inline void rebase(const Packet& packet, const vec3& base, Rays& rays) {
  rays.base = base;
  for (int lane = 0; lane < kPacketRays; ++lane) {
    const double ox = double(packet.rays.originX[lane]) - double(base.x),
                 oy = double(packet.rays.originY[lane]) - double(base.y),
                 oz = double(packet.rays.originZ[lane]) - double(base.z);
    const double before = -(ox * packet.exactX[lane] + oy * packet.exactY[lane] + oz * packet.exactZ[lane]);
    rays.originX[lane] = static_cast<float>(ox + before * packet.exactX[lane]);
    rays.originY[lane] = static_cast<float>(oy + before * packet.exactY[lane]);
    rays.originZ[lane] = static_cast<float>(oz + before * packet.exactZ[lane]);
    rays.before[lane] = static_cast<float>(before);
    rays.after[lane] = static_cast<float>(packet.exactLength[lane] - before);
  }
}

/// Whether a leaf needs rebase(): the same choice in every kernel.
inline bool isFar(const Packet& packet, const vec3& leafCentre) {
  const vec3 offset = leafCentre - packet.axisOrigin;
  return offset.x * offset.x + offset.y * offset.y + offset.z * offset.z > packet.farDistance * packet.farDistance;
}
inline vec3 centreOf(const layout::Node& node) { return 0.5f * node.lo + 0.5f * node.hi; }

/// True if the box can be touched by a ray of the packet (Williams et al. 2005's slabs on the axis, widened). Always
/// inlined: a call from vector code would save and clear every register for some thirty instructions.
[[gnu::always_inline]] inline bool touches(const Packet& packet, const layout::Node& node) {
  float enter = packet.firstStep, leave = packet.lastStep;
  for (int axis = 0; axis < 3; ++axis) {
    const float a = (node.lo[axis] - packet.slabLow[axis]) * packet.inverseStep[axis];
    const float b = (node.hi[axis] - packet.slabHigh[axis]) * packet.inverseStep[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  // The slack in the slabs covers rounding across the slabs; this covers it in the parameter itself.
  return enter <= leave + 1e-6f * std::abs(leave);
}

/// How one particle stands to a packet; the same arithmetic as the SIMD kernels' vector version.
struct Standing {
  bool candidate;  ///< some ray may pass through its support
  bool between;    ///< … and wherever one does, the whole support lies between the ray's ends
};

inline Standing standing(const Packet& packet, float x, float y, float z, float radius) {
  const float wx = x - packet.axisOrigin.x, wy = y - packet.axisOrigin.y, wz = z - packet.axisOrigin.z;
  const float t = wx * packet.axisDirection.x + wy * packet.axisDirection.y + wz * packet.axisDirection.z;
  const float ex = wx - t * packet.axisDirection.x, ey = wy - t * packet.axisDirection.y,
              ez = wz - t * packet.axisDirection.z;
  const float limit = radius + packet.tube;
  // √2·r from an end, measured along the axis, keeps the whole half chord of every ray that hits on one side of it.
  const float clear = 1.4143f * radius + packet.ahead;
  return {ex * ex + ey * ey + ez * ez < limit * limit && t > -(radius + packet.behind),
          t >= clear && packet.axisLength - t >= clear};
}

}  // namespace mote
