#include "tools/bench/peers/cloud.h"

#include "host/lighting/medium.h"
#include "host/particles/generate.h"
#include "host/particles/particle_loader.h"

namespace mote {

constexpr double kOpticalDepth = 4;  // as the default of a scene

Octree makeCloud(const std::string& kind, std::uint64_t count) {
  ParticleSource source;
  source.pointer = "--cloud";
  source.generate = generatorNamed(kind == "noise" ? "cloud" : kind);
  source.count = count;
  if (source.generate == Generator::None) source.file = kind;
  const ParticleSet set = loadParticles({source}, 1);
  std::vector<float> peak = peakOpticalDepths(set.density, set.radius, layout::kFalloffSmooth, true, 1);
  const Octree tree = buildOctree(set.position, set.radius, peak);
  const auto scale = static_cast<float>(kOpticalDepth / meanLineOpticalDepth(tree, layout::kFalloffSmooth));
  for (float& depth : peak) depth *= scale;
  return buildOctree(set.position, set.radius, peak);
}

layout::Light makeLight(const Octree& tree, bool directional) {
  const Bounds bounds = tree.bounds();
  const vec3 size = bounds.size(), away(2, 3, 1);
  const float half = std::max({size.x, size.y, size.z}) / 2;
  return {.position = bounds.centre() + half * away,
          .type = directional ? layout::kLightDirectional : layout::kLightPoint,
          .direction = -glm::normalize(away),
          .decay = 2,
          .power = vec3(1),
          .shadowDensity = 1,
          .castsShadows = 1,
          .cosInner = 1,
          .cosOuter = -1};
}

}  // namespace mote
