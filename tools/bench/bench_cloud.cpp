#include "tools/bench/bench_cloud.h"

#include <cmath>
#include <utility>

#include "host/core/random.h"
#include "host/lighting/medium.h"
#include "host/particles/generate.h"
#include "host/particles/spacing.h"

namespace mote {

constexpr std::uint64_t kSeed = 0;
constexpr double kOpticalDepth = 4;

BenchCloud benchCloud(std::uint64_t count, layout::uint falloff, const BenchCloudRadii& radii) {
  ParticleSet set = generateParticles(Generator::Cloud, count, kSeed, 1);
  const double radius = radii.radius > 0
                            ? double(radii.radius)
                            : kAutoRadiusFactor * meanNeighbourDistance(set.position) / std::cbrt(radii.finer);
  set.radius.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    set.radius[i] = static_cast<float>(radius * std::pow(radii.range, uniformDouble(hashBits(kSeed, i, 1)) - 0.5));
  return calibrated(std::move(set), falloff);
}

BenchCloud calibrated(ParticleSet particles, layout::uint falloff) {
  BenchCloud cloud;
  cloud.peak = peakOpticalDepths(particles.density, particles.radius, falloff, true, 1);
  cloud.position = std::move(particles.position), cloud.radius = std::move(particles.radius);
  const auto scale = static_cast<float>(kOpticalDepth / meanLineOpticalDepth(cloud.tree(), falloff));
  for (float& peak : cloud.peak) peak *= scale;
  return cloud;
}

layout::Light benchLight() {
  return {.position = vec3(2, 3, 1),
          .type = layout::kLightPoint,
          .direction = vec3(0),
          .decay = 2,
          .power = vec3(60),
          .shadowDensity = 1,
          .castsShadows = 1,
          .cosInner = 1,
          .cosOuter = -1};
}

}  // namespace mote
