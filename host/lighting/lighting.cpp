#include "host/lighting/lighting.h"

#include <cmath>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/lighting/kernel.h"
#include "host/lighting/ray_order.h"

namespace mote {
namespace {

/// Rays a task: long enough to hide the scheduling, short enough to balance the ends of a frame.
constexpr std::size_t kTaskRays = 64 * kPacketRays;

using Walk = void (*)(const Octree&, const WalkOptions&, Packet&);

bool shadowless(const layout::Light& light) { return light.castsShadows == 0 || light.shadowDensity == 0; }

WalkOptions walkOptions(const layout::Light& light, const LightingOptions& options) {
  return {options.falloff, options.endpoint, opticalDepthLimit(light, options.cutoff)};
}

void storePacket(const Packet& packet, int count, std::vector<float>& depths) {
  for (int lane = 0; lane < count; ++lane)
    depths[packet.self[lane]] = packet.exactLength[lane] > 0 ? packet.opticalDepth[lane] : 0.0f;
}

std::vector<float> walkAll(const Octree& tree, const layout::Light& light, const LightingOptions& options,
                           const RaysDone& done, Walk walk) {
  std::vector<float> depths(tree.particleCount(), 0.0f);
  if (shadowless(light)) return depths;
  const WalkOptions rules = walkOptions(light, options);
  const PacketRules shape = packetRules(tree);
  const std::vector<std::uint32_t> order = rayOrder(tree, light);
  parallelBlocks(tree.particleCount(), kTaskRays, [&](std::size_t begin, std::size_t end) {
    for (std::size_t first = begin; first < end; first += kPacketRays) {
      const int count = static_cast<int>(std::min<std::size_t>(kPacketRays, end - first));
      Packet packet = makePacket(tree, light, &order[first], count, shape);
      walk(tree, rules, packet);
      storePacket(packet, count, depths);
    }
    if (done) done(end - begin);
  });
  return depths;
}

}  // namespace

float opticalDepthLimit(const layout::Light& light, float cutoff) {
  if (cutoff <= 0 || light.shadowDensity <= 0) return std::numeric_limits<float>::infinity();
  return -std::log(cutoff) / light.shadowDensity;
}

std::vector<float> opticalDepths(const Octree& tree, const layout::Light& light, const LightingOptions& options,
                                 const RaysDone& done) {
  return walkAll(tree, light, options, done, walkSimd);
}

std::vector<float> opticalDepthsScalar(const Octree& tree, const layout::Light& light, const LightingOptions& options) {
  return walkAll(tree, light, options, {}, walkScalar);
}

std::vector<float> transmittances(const std::vector<float>& opticalDepths, const layout::Light& light) {
  std::vector<float> result(opticalDepths.size());
  parallelBlocks(result.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result[i] = std::exp(-light.shadowDensity * opticalDepths[i]);
  });
  return result;
}

std::vector<float> lineOpticalDepths(const Octree& tree, std::span<const vec3> points, std::span<const vec3> directions,
                                     layout::uint falloff) {
  MOTE_CHECK(points.size(), ==, directions.size());
  std::vector<float> depths(points.size(), 0.0f);
  const Bounds bounds = tree.bounds();
  if (bounds.empty()) return depths;
  const PacketRules shape = packetRules(tree);
  const float away = 2 * glm::length(bounds.size());
  parallelBlocks(points.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      // From a start outside everything, the ray is the whole line.
      Packet packet = makeLinePacket(points[i] - away * directions[i], directions[i], shape);
      walkSimd(tree, {falloff, layout::kEndpointSoft, std::numeric_limits<float>::infinity()}, packet);
      depths[i] = packet.opticalDepth[0];
    }
  });
  return depths;
}

void addInScattering(const Octree& tree, const layout::Light& light, const std::vector<float>& transmittance,
                     std::vector<vec3>& radiance) {
  constexpr float kIsotropic = static_cast<float>(1 / (4 * kPi));
  const vec3 scattered = kIsotropic * light.power;
  parallelBlocks(tree.particleCount(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      float strength = transmittance[slot];
      if (light.type == layout::kLightPoint && light.decay > 0) {
        const float distance = std::max(glm::length(light.position - tree.position(slot)), tree.radius[slot]);
        strength *= light.decay == 2 ? 1 / (distance * distance) : std::pow(distance, -light.decay);
      }
      radiance[slot] += strength * scattered;
    }
  });
}

}  // namespace mote
