#include "engine/surface_light.h"

#include <algorithm>

#include "host/core/parallel.h"
#include "host/lighting/irradiance.h"

namespace mote {
namespace {

constexpr std::size_t kBlock = 1 << 14;

/// Points as receivers own them.
struct Points {
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> self;

  void add(const vec3& p) { x.push_back(p.x), y.push_back(p.y), z.push_back(p.z); }
  Receivers receivers() {
    self.assign(x.size(), kNoSlot);
    return {x, y, z, self};
  }
};

/// Share of the light that solids let pass to each surface.
std::vector<float> solidShares(const Frame& frame, const Surfaces& surfaces, const layout::Light& light,
                               const ShadowSources& sources) {
  std::vector<float> shares(surfaces.all.size(), 1);
  if (frame.solidTree.empty() || frame.solidLight == 1 || light.castsShadows == 0) return shares;
  Points points;
  for (const Surface& surface : surfaces.all)
    for (std::size_t k = 0; k < surface.shadowPoints; ++k) points.add(surface.points[k]);
  const std::vector<std::uint8_t> blocked = sources.occluded(points.receivers(), {}, light);
  std::size_t next = 0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const std::size_t count = surfaces.all[i].shadowPoints;
    float sum = 0;
    for (std::size_t k = 0; k < count; ++k) sum += blocked[next++] ? frame.solidLight : 1;
    shares[i] = sum / static_cast<float>(count);
  }
  return shares;
}

}  // namespace

SurfaceLight lightSurfaces(const Frame& frame, const Scene& scene, const Surfaces& surfaces, const layout::Light& light,
                           const ShadowSources& sources) {
  const std::size_t count = surfaces.all.size();
  SurfaceLight result;
  result.radiance.assign(count, vec3(0));
  result.shadow.assign(count, 1);
  const std::vector<float> shares = solidShares(frame, surfaces, light, sources);
  Points points;
  std::vector<std::uint8_t> wanted(count);
  for (std::size_t i = 0; i < count; ++i) {
    points.add(surfaces.all[i].points[0]);
    wanted[i] = shares[i] > 0 && reaches(light, surfaces.all[i].points[0]) ? 1 : 0;
  }
  const std::vector<float> depths = sources.opticalDepths(points.receivers(), light, wanted, {});
  const std::vector<float> through = transmittances(depths, count, light, frame.rules.extinction);
  const bool grey = through.size() == count;
  parallelBlocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Surface& surface = surfaces.all[i];
      const Solid& solid = scene.solids[surface.solid];
      const vec3 point = surface.points[0];
      const vec3 t = grey ? vec3(through[i]) : vec3(through[i], through[count + i], through[2 * count + i]);
      const vec3 passes = solid.receivesShadows ? t * shares[i] : vec3(1);
      result.shadow[i] = grey ? passes.x : (passes.x + passes.y + passes.z) / 3;
      if (solid.mode != SolidMode::Shaded) continue;
      const float cosine = std::max(-glm::dot(travelDirection(light, point), surface.normal), 0.0f);
      result.radiance[i] = solid.albedo * (cosine / static_cast<float>(kPi)) * irradiance(light, point, 1e-6f) * passes;
    }
  });
  return result;
}

}  // namespace mote
