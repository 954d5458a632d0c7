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

glm::dmat3 rotationAbout(const dvec3& degrees) {
  dmat4 rotation(1);
  for (const int axis : {2, 1, 0}) {
    if (degrees[axis] == 0) continue;  // exact, not merely close
    dvec3 about(0);
    about[axis] = 1;
    rotation = glm::rotate(rotation, glm::radians(degrees[axis]), about);
  }
  return glm::dmat3(rotation);
}

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

Placement placementOf(const ParticleSource& source, DensityMode mode, const LoadedSource& loaded) {
  const FileUnits& units = loaded.units;
  Placement place;
  place.scale = source.scale * units.length;
  place.area = mode == DensityMode::Peak ? 1 : place.scale * place.scale;
  place.linear = (rotationAbout(dvec3(source.rotate)) * place.scale) * units.axes;
  place.shift = place.linear * loaded.centre + source.translate;
  place.stays = source.scale == 1 && source.rotate == vec3(0) && units.none();
  place.velocity = units.velocity;
  return place;
}

SceneBox sceneBox(const LoadedSource& loaded, const Placement& place) {
  const std::vector<vec3>& position = loaded.set.position;
  std::vector<SceneBox> boxes((position.size() + kGrain - 1) / kGrain);
  parallelBlocks(position.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    SceneBox& box = boxes[begin / kGrain];
    for (std::size_t i = begin; i < end; ++i) {
      const dvec3 at = place.linear * dvec3(position[i]) + place.shift;
      box.lo = glm::min(box.lo, at), box.hi = glm::max(box.hi, at);
    }
  });
  SceneBox all;
  for (const SceneBox& box : boxes) all.add(box);
  return all;
}

void moveIntoScene(const Placement& place, const dvec3& origin, LoadedSource& loaded) {
  ParticleSet& set = loaded.set;
  const glm::dmat3 velocity = place.linear * place.velocity;
  const dvec3 shift = place.shift - origin;
  loaded.centre = origin;
  if (place.stays && place.velocity != 1)
    for (vec3& v : set.velocity) v = vec3(dvec3(v) * place.velocity);
  if (place.stays && shift == dvec3(0)) return;  // exact, not merely close
  parallelBlocks(set.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      set.position[i] = vec3(place.linear * dvec3(set.position[i]) + shift);
      if (place.stays) continue;
      set.radius[i] = static_cast<float>(set.radius[i] * place.scale);
      set.density[i] = static_cast<float>(set.density[i] * place.area);
      if (!set.velocity.empty()) set.velocity[i] = vec3(velocity * dvec3(set.velocity[i]));
    }
  });
}

}  // namespace mote
