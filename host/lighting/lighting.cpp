#include "host/lighting/lighting.h"

#include <cmath>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/lighting/irradiance.h"
#include "host/lighting/kernel.h"
#include "host/lighting/ray_order.h"

namespace mote {
namespace {

/// Rays a task: long enough to hide the scheduling, short enough to balance the ends of a frame.
constexpr std::size_t kTaskRays = 64 * kPacketRays;

using Walk = void (*)(const Octree&, const WalkOptions&, Packet&);

WalkOptions walkOptions(const layout::Light& light, const LightingOptions& options) {
  return {options.falloff, options.endpoint, opticalDepthLimit(light, options)};
}

void storePacket(const Packet& packet, const std::uint32_t* indices, int count, std::size_t channels,
                 std::size_t receivers, float* depths) {
  for (std::size_t channel = 0; channel < channels; ++channel)
    for (int lane = 0; lane < count; ++lane)
      depths[channel * receivers + indices[lane]] =
          packet.exactLength[lane] > 0 ? packet.opticalDepth[channel][lane] : 0.0f;
}

std::vector<float> walkAll(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                           const LightingOptions& options, std::span<const std::uint8_t> reached, const RaysDone& done,
                           Walk walk) {
  if (!reached.empty()) MOTE_CHECK(reached.size(), ==, receivers.size());
  std::vector<float> depths(tree.channels() * receivers.size(), 0.0f);
  if (shadowless(light) || tree.particleCount() == 0) return depths;
  const WalkOptions rules = walkOptions(light, options);
  const PacketRules shape = packetRules(tree, receivers.bounds());
  const std::vector<std::uint32_t> order = rayOrder(receivers, light, reached);
  parallelBlocks(order.size(), kTaskRays, [&](std::size_t begin, std::size_t end) {
    for (std::size_t first = begin; first < end; first += kPacketRays) {
      const int count = static_cast<int>(std::min<std::size_t>(kPacketRays, end - first));
      Packet packet = makePacket(receivers, light, &order[first], count, shape);
      walk(tree, rules, packet);
      storePacket(packet, &order[first], count, tree.channels(), receivers.size(), depths.data());
    }
    if (done) done(end - begin);
  });
  return depths;
}

}  // namespace

Bounds Receivers::bounds() const {
  constexpr std::size_t kGrain = 1 << 14;
  std::vector<Bounds> parts((size() + kGrain - 1) / kGrain);
  parallelBlocks(size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) parts[begin / kGrain].add(position(k));
  });
  Bounds bounds;
  for (const Bounds& part : parts) bounds.add(part);
  return bounds;
}

bool shadowless(const layout::Light& light) { return light.castsShadows == 0 || light.shadowDensity == 0; }

float opticalDepthLimit(const layout::Light& light, const LightingOptions& options) {
  const vec3& e = options.extinction;
  const float least = light.shadowDensity * std::min({e.x, e.y, e.z});
  if (options.cutoff <= 0 || least <= 0) return std::numeric_limits<float>::infinity();
  return -std::log(options.cutoff) / least;
}

std::vector<float> opticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                 const LightingOptions& options, std::span<const std::uint8_t> reached,
                                 const RaysDone& done) {
  return walkAll(tree, receivers, light, options, reached, done, walkSimd);
}

std::vector<float> opticalDepths(const Octree& tree, const layout::Light& light, const LightingOptions& options,
                                 const RaysDone& done) {
  return walkAll(tree, slotsOf(tree), light, options, {}, done, walkSimd);
}

std::vector<float> opticalDepthsScalar(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                       const LightingOptions& options, std::span<const std::uint8_t> reached) {
  return walkAll(tree, receivers, light, options, reached, {}, walkScalar);
}

std::vector<float> opticalDepthsScalar(const Octree& tree, const layout::Light& light, const LightingOptions& options) {
  return opticalDepthsScalar(tree, slotsOf(tree), light, options);
}

std::vector<float> transmittances(const std::vector<float>& opticalDepths, std::size_t receivers,
                                  const layout::Light& light, const vec3& extinction) {
  const bool grey = opticalDepths.size() == receivers;
  if (!grey) MOTE_CHECK(opticalDepths.size(), ==, 3 * receivers);
  const bool oneChannel = grey && extinction.x == extinction.y && extinction.y == extinction.z;
  // Without shadows T is 1 even where the optical depth is not known.
  const float density = light.castsShadows != 0 ? light.shadowDensity : 0;
  std::vector<float> result((oneChannel ? 1 : 3) * receivers);
  parallelBlocks(result.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float factor = -density * extinction[static_cast<int>(i / receivers)];
      result[i] = std::exp(factor * opticalDepths[grey ? i % receivers : i]);
    }
  });
  return result;
}

std::vector<float> transmittances(const std::vector<float>& opticalDepths, const layout::Light& light) {
  return transmittances(opticalDepths, opticalDepths.size(), light, vec3(1));
}

std::vector<float> lineOpticalDepths(const Octree& tree, std::span<const vec3> points, std::span<const vec3> directions,
                                     layout::uint falloff) {
  MOTE_CHECK(points.size(), ==, directions.size());
  std::vector<float> depths(points.size(), 0.0f);
  const Bounds bounds = tree.bounds();
  if (bounds.empty()) return depths;
  const PacketRules shape = packetRules(tree, {});
  const float away = 2 * glm::length(bounds.size());
  parallelBlocks(points.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      // From a start outside everything, the ray is the whole line.
      Packet packet = makeLinePacket(points[i] - away * directions[i], directions[i], shape);
      walkSimd(tree, {falloff, layout::kEndpointSoft, std::numeric_limits<float>::infinity()}, packet);
      const auto& sums = packet.opticalDepth;
      depths[i] = tree.channels() == 1 ? sums[0][0] : (sums[0][0] + sums[1][0] + sums[2][0]) / 3;
    }
  });
  return depths;
}

void addInScattering(const Receivers& receivers, std::span<const float> radius, const layout::Light& light,
                     std::span<const float> transmittance, const Scattering& scattering, std::vector<vec3>& radiance) {
  const std::size_t count = receivers.size();
  MOTE_CHECK(radius.size(), ==, count);
  MOTE_CHECK(radiance.size(), ==, count);
  const bool grey = transmittance.size() == count;
  if (!grey) MOTE_CHECK(transmittance.size(), ==, 3 * count);
  parallelBlocks(count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const vec3 point = receivers.position(k);
      const float cosine = scattering.phase.kind == PhaseKind::Isotropic
                               ? 0.0f
                               : glm::dot(travelDirection(light, point), scattering.viewer.directionFrom(point));
      const vec3 passes = grey ? vec3(transmittance[k])
                               : vec3(transmittance[k], transmittance[count + k], transmittance[2 * count + k]);
      radiance[k] += scattering.phase(cosine) * passes * irradiance(light, point, radius[k]);
    }
  });
}

}  // namespace mote
