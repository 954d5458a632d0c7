#include "host/lighting/packet.h"

#include <cmath>

namespace mote {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// 1/x that stays finite, so that 0 · ∞ never appears in a slab test.
float safeInverse(float x) {
  constexpr float kLeast = 1e-18f;
  return 1.0f / (std::abs(x) < kLeast ? std::copysign(kLeast, x) : x);
}

void setRay(Packet& packet, int lane, const vec3& origin, const dvec3& direction, double length, std::uint32_t self) {
  packet.rays.originX[lane] = origin.x, packet.rays.originY[lane] = origin.y, packet.rays.originZ[lane] = origin.z;
  packet.rays.before[lane] = 0, packet.rays.after[lane] = static_cast<float>(length);
  packet.exactX[lane] = direction.x, packet.exactY[lane] = direction.y, packet.exactZ[lane] = direction.z;
  packet.exactLength[lane] = length;
  packet.directionX[lane] = static_cast<float>(direction.x);
  packet.directionY[lane] = static_cast<float>(direction.y);
  packet.directionZ[lane] = static_cast<float>(direction.z);
  packet.self[lane] = self;
  for (auto& channel : packet.opticalDepth) channel[lane] = 0;
}

void setAxis(Packet& packet, const vec3& origin, const vec3& toLight, bool infinite) {
  packet.axisOrigin = origin;
  const double length = glm::length(dvec3(toLight));
  packet.axisDirection = length > 0 ? vec3(dvec3(toLight) / length) : vec3(1, 0, 0);
  packet.axisLength = infinite ? kInfinity : static_cast<float>(length);
  for (int axis = 0; axis < 3; ++axis) packet.inverseStep[axis] = safeInverse(toLight[axis]);
}

/// Widths of the shaft, from how far the origins scatter around the axis: rays converge on the light or run parallel,
/// so nowhere are they farther from the axis than where they start.
void setShaft(Packet& packet, const PacketRules& rules) {
  const float slack = rules.slack;
  packet.rays.base = vec3(0);
  packet.farDistance = rules.farDistance;
  vec3 spread(slack);
  packet.tube = packet.ahead = packet.behind = slack;
  for (int lane = 0; lane < kPacketRays; ++lane) {
    const vec3 offset =
        vec3(packet.rays.originX[lane], packet.rays.originY[lane], packet.rays.originZ[lane]) - packet.axisOrigin;
    const float along = glm::dot(offset, packet.axisDirection);
    const vec3 across = offset - along * packet.axisDirection;
    spread = glm::max(spread, glm::abs(across) + slack);
    packet.tube = std::max(packet.tube, glm::length(across) + slack);
    packet.ahead = std::max(packet.ahead, along + slack);
    packet.behind = std::max(packet.behind, slack - along);
  }
  packet.slabLow = packet.axisOrigin + spread;
  packet.slabHigh = packet.axisOrigin - spread;
  packet.firstStep = std::isinf(packet.axisLength) ? -packet.behind
                     : packet.axisLength > 0       ? -packet.behind / packet.axisLength
                                                   : -kInfinity;
  // Rays may also start beyond a light that stands among the receivers.
  packet.lastStep = std::isinf(packet.axisLength) ? kInfinity
                    : packet.axisLength > 0       ? std::max(1.0f, packet.ahead / packet.axisLength)
                                                  : kInfinity;
}

}  // namespace

Packet makePacket(const Receivers& receivers, const layout::Light& light, const std::uint32_t* indices, int count,
                  const PacketRules& rules) {
  Packet packet;
  Bounds origins;
  for (int lane = 0; lane < kPacketRays; ++lane) {
    const std::uint32_t index = indices[std::min(lane, count - 1)], self = receivers.selfOf(index);
    const vec3 origin = receivers.position(index);
    origins.add(origin);
    if (light.type == layout::kLightDirectional) {
      setRay(packet, lane, origin, -glm::normalize(dvec3(light.direction)), kInfinity, self);
    } else {
      const dvec3 toLight = dvec3(light.position) - dvec3(origin);
      const double length = glm::length(toLight);
      setRay(packet, lane, origin, length > 0 ? toLight / length : dvec3(1, 0, 0), length, self);
    }
  }
  const bool infinite = light.type == layout::kLightDirectional;
  const vec3 centre = origins.centre();
  setAxis(packet, centre, infinite ? -light.direction : light.position - centre, infinite);
  setShaft(packet, rules);
  return packet;
}

Packet makeLinePacket(const vec3& origin, const vec3& direction, const PacketRules& rules) {
  Packet packet;
  for (int lane = 0; lane < kPacketRays; ++lane)
    setRay(packet, lane, origin, glm::normalize(dvec3(direction)), kInfinity, kNoSlot);
  setAxis(packet, origin, direction, true);
  setShaft(packet, rules);
  return packet;
}

PacketRules packetRules(const Octree& tree, const Bounds& origins) {
  Bounds bounds = tree.bounds();
  if (bounds.empty()) return {0, 0};
  if (!origins.empty()) bounds.add(origins);
  const float extent =
      std::max(glm::length(bounds.size()), glm::length(glm::max(glm::abs(bounds.lo), glm::abs(bounds.hi))));
  // Coordinates, differences and directions each round to 6e-8 of the extent; 2e-6 leaves a factor of ten.
  return {2e-6f * extent, 256.0f * tree.leastRadius};
}

}  // namespace mote
