// What a light gives to a point, shadows aside (DESIGN §2).
#pragma once
#include <cmath>

#include "host/core/vec.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

/// Direction in which the light travels at `point`; unit, or any unit vector where the light stands there itself.
inline vec3 travelDirection(const layout::Light& light, const vec3& point) {
  if (light.type == layout::kLightDirectional) return light.direction;
  const vec3 offset = point - light.position;
  const float length = glm::length(offset);
  return length > 0 ? offset / length : light.direction;
}

/// Strength of a spot light in a direction of travel, 0–1: 1 inside the inner half angle, 0 outside the outer, between
/// them a cubic step of the cosine (the same shape as in Pharr et al., "Physically Based Rendering", spot lights).
inline float coneStrength(const layout::Light& light, const vec3& travel) {
  if (light.type != layout::kLightSpot) return 1;
  const float cosine = glm::dot(travel, light.direction);
  if (cosine >= light.cosInner) return 1;
  if (cosine <= light.cosOuter) return 0;
  const float x = (cosine - light.cosOuter) / (light.cosInner - light.cosOuter);
  return x * x * (3 - 2 * x);
}

/// E [W/m²] of a surface at `point` that faces the light: power · cone / dⁿ for point and spot lights, with d at least
/// `leastDistance` (a particle is no point, and a light inside it would be infinitely bright); power for directional
/// ones.
inline vec3 irradiance(const layout::Light& light, const vec3& point, float leastDistance) {
  if (light.type == layout::kLightDirectional) return light.power;
  float strength = coneStrength(light, travelDirection(light, point));
  if (light.decay > 0 && strength > 0) {
    const float distance = std::max(glm::length(light.position - point), leastDistance);
    strength *= light.decay == 2 ? 1 / (distance * distance) : std::pow(distance, -light.decay);
  }
  return strength * light.power;
}

/// False where the light gives nothing, shadows or not: outside a spot's cone, or no power at all.
inline bool reaches(const layout::Light& light, const vec3& point) {
  return light.power != vec3(0) && coneStrength(light, travelDirection(light, point)) > 0;
}

}  // namespace mote
