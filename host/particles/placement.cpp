#include "host/particles/placement.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/particles/spacing.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 15;

}  // namespace

void applyRadiusRule(const ParticleSource& source, LoadedSource& loaded) {
  ParticleSet& set = loaded.set;
  switch (source.radius.kind) {
    case RadiusRule::Kind::Number: set.radius.assign(set.size(), source.radius.value); return;
    case RadiusRule::Kind::Channel:
      for (float& r : set.radius) r *= source.radius.scale;
      return;
    case RadiusRule::Kind::Auto: break;
  }
  if (!set.radius.empty() || set.size() == 0) return;
  const double spacing = meanNeighbourDistance(set.position);
  const auto radius = static_cast<float>(kAutoRadiusFactor * spacing);
  if (!(radius > 0) || !std::isfinite(radius))
    throw InputError(loaded.place, "", "particles with distances that a radius can be taken from",
                     set.size() == 1 ? "a single particle"
                                     : fmt::format("{} particles with a mean spacing of {}", set.size(), spacing),
                     fmt::format("give {} a \"radius\": a number", scenePlace(source)));
  set.radius.assign(set.size(), radius);
}

void moveIntoScene(const ParticleSource& source, DensityMode mode, LoadedSource& loaded) {
  ParticleSet& set = loaded.set;
  const FileUnits& units = loaded.units;
  if (units.velocity != 1)
    for (vec3& v : set.velocity) v = vec3(dvec3(v) * units.velocity);
  const bool stays = source.scale == 1 && source.rotate == vec3(0) && source.translate == vec3(0);
  if (stays && units.none()) return;  // exact, not merely close
  dmat4 rotation(1);
  for (const int axis : {2, 1, 0}) {  // Rz · Ry · Rx: x is applied first
    dvec3 about(0);
    about[axis] = 1;
    rotation = glm::rotate(rotation, glm::radians(static_cast<double>(source.rotate[axis])), about);
  }
  const double scale = source.scale * units.length;
  const glm::dmat3 linear = (glm::dmat3(rotation) * scale) * units.axes;
  const dvec3 translate(source.translate);
  const double area = mode == DensityMode::Peak ? 1 : scale * scale;
  parallelBlocks(set.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      set.position[i] = vec3(linear * dvec3(set.position[i]) + translate);
      set.radius[i] = static_cast<float>(set.radius[i] * scale);
      set.density[i] = static_cast<float>(set.density[i] * area);
      if (!set.velocity.empty()) set.velocity[i] = vec3(linear * dvec3(set.velocity[i]));
    }
  });
}

}  // namespace mote
