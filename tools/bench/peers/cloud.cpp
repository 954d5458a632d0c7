#include "tools/bench/peers/cloud.h"

#include "host/particles/generate.h"
#include "host/particles/particle_loader.h"
#include "tools/bench/bench_cloud.h"

namespace mote {

Octree makeCloud(const std::string& kind, std::uint64_t count) {
  ParticleSource source;
  source.pointer = "--cloud";
  source.generate = generatorNamed(kind == "noise" ? "cloud" : kind);
  source.count = count;
  if (source.generate == Generator::None) source.file = kind;
  return calibrated(loadParticles({source}, 1), layout::kFalloffSmooth).tree();
}

layout::Light makeLight(const Octree& tree, bool directional) {
  const Bounds bounds = tree.bounds();
  const vec3 size = bounds.size();
  const float half = std::max({size.x, size.y, size.z}) / 2;
  layout::Light light = benchLight();
  light.position = bounds.centre() + half * light.position;
  if (directional) light.type = layout::kLightDirectional, light.direction = -glm::normalize(benchLight().position);
  return light;
}

}  // namespace mote
