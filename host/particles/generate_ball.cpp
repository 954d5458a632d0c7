#include <cmath>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/particles/generate.h"
#include "host/particles/spacing.h"

namespace mote {

ParticleSet generateParticles(Generator kind, std::uint64_t count, std::uint64_t seed, int frame) {
  if (count == 0) throw InputError("generate", "count", "at least 1 particle", "0");
  switch (kind) {
    case Generator::Ball: return generateBall(count, seed);
    case Generator::Cloud: return generateCloud(count, seed);
    case Generator::Plume: return generatePlume(count, seed, frame);
    case Generator::None: break;
  }
  throw InputError("generate", "", "ball, cloud or plume", "none of them");
}

Generator generatorNamed(std::string_view name) {
  if (name == "ball") return Generator::Ball;
  if (name == "cloud") return Generator::Cloud;
  return name == "plume" ? Generator::Plume : Generator::None;
}

ParticleSet generateBall(std::uint64_t count, std::uint64_t seed) {
  ParticleSet set;
  set.position.resize(count);
  set.id.resize(count);
  parallelBlocks(count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Random random(seed, i);
      const double distance = std::cbrt(random.uniform());  // shells of equal volume are equally likely
      set.position[i] = vec3(distance * random.direction());
      set.id[i] = i;
    }
  });
  const double numberDensity = static_cast<double>(count) / (4.0 / 3 * kPi);
  set.radius.assign(count, static_cast<float>(kAutoRadiusFactor * poissonNeighbourDistance(numberDensity)));
  // Mean optical depth along a diameter of length 2: n · c · 2 = 4.
  set.density.assign(count, static_cast<float>(2 / numberDensity));
  return set;
}

}  // namespace mote
