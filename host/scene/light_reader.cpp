// "lights": points, spots and directions that light comes from.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/scene/scene_parts.h"

namespace mote {
namespace {

constexpr Range kInnerAngle{.min = 0, .max = 180, .maxOpen = true, .unit = "degrees"};
constexpr Range kOuterAngle{.min = 0, .max = 180, .minOpen = true, .maxOpen = true, .unit = "degrees"};

void readDirection(ObjectReader& object, vec3& direction) {
  if (!object.vector("direction", direction, kCoordinate)) return;
  const dvec3 given(direction);
  const double length = std::sqrt(given.x * given.x + given.y * given.y + given.z * given.z);
  if (length > 0) {
    direction = vec3(given / length);
  } else {
    object.problem("direction", "a direction that is not zero", "[0, 0, 0]");
  }
}

/// Turns the light from its position to the target; without one it shines straight down.
void readTarget(ObjectReader& object, LightSource& light) {
  dvec3 target(0);
  if (!object.vector("target", target, kCoordinate) || light.type != LightType::Spot) return;
  const dvec3 way = target - light.position;
  const double length = glm::length(way);
  if (length > 0) {
    light.direction = vec3(way / length);
  } else {
    object.problem("target", "a target that is not the light's position", "both at the same place");
  }
}

/// Where only one of the angles is given, the other's default gives way to it.
void readAngles(ObjectReader& object, LightSource& light) {
  const bool inner = object.number("inner_angle", light.innerAngle, kInnerAngle);
  const bool outer = object.number("outer_angle", light.outerAngle, kOuterAngle);
  if (!inner) light.innerAngle = std::min(light.innerAngle, light.outerAngle);
  if (!outer) light.outerAngle = std::max(light.innerAngle, light.outerAngle);
  if (light.innerAngle > light.outerAngle)
    object.problem("inner_angle", "inner_angle <= outer_angle",
                   fmt::format("inner {} and outer {}", light.innerAngle, light.outerAngle),
                   "both are half angles, in degrees from the axis");
}

void checkKeysOfType(ObjectReader& object, LightType type) {
  const bool spot = type == LightType::Spot, directional = type == LightType::Directional, placed = !directional;
  const char* way = spot ? "a spot light has a target" : "a point light has a position";
  object.onlyWhere(placed, "position", R"("position" only in point and spot lights)",
                   "a directional light has a direction");
  object.onlyWhere(placed, "intensity", R"("intensity" only in point and spot lights)",
                   "a directional light has an irradiance");
  object.onlyWhere(placed, "decay", R"("decay" only in point and spot lights)");
  for (const char* key : {"target", "inner_angle", "outer_angle"})
    object.onlyWhere(spot, key, fmt::format("\"{}\" only in spot lights", key));
  object.onlyWhere(directional, "direction", R"("direction" only in directional lights)", way);
  object.onlyWhere(directional, "irradiance", R"("irradiance" only in directional lights)",
                   spot ? "a spot light has an intensity" : "a point light has an intensity");
}

LightSource readLight(ObjectReader& object, std::size_t index) {
  LightSource light;
  light.name = fmt::format("light{}", index);
  readName(object, light.name, "it becomes the channel Transmittance_<name>");
  object.choice<LightType>(
      "type", light.type,
      {{"point", LightType::Point}, {"spot", LightType::Spot}, {"directional", LightType::Directional}});
  object.vector("position", light.position, kCoordinate);
  readDirection(object, light.direction);
  readTarget(object, light);
  readAngles(object, light);
  object.vector("color", light.color, atLeast(0));
  object.number("intensity", light.strength, atLeast(0, "W/sr"));
  object.number("irradiance", light.strength, atLeast(0, "W/m²"));
  object.number("decay", light.decay, between(0, 2));
  object.number("shadow_density", light.shadowDensity, atLeast(0));
  object.boolean("casts_shadows", light.castsShadows);
  checkKeysOfType(object, light.type);
  object.finish();
  return light;
}

}  // namespace

void readLights(ObjectReader& root, Scene& scene) {
  scene.defaultLights = !root.has("lights");
  std::vector<ObjectReader> objects = root.list("lights", "a light");
  for (std::size_t i = 0; i < objects.size(); ++i) {
    LightSource light = readLight(objects[i], i);
    const auto earlier = std::find_if(scene.lights.begin(), scene.lights.end(),
                                      [&](const LightSource& other) { return other.name == light.name; });
    if (earlier != scene.lights.end())
      objects[i].problem("name", "a name that no other light has", quotedForMessage(light.name),
                         fmt::format("/lights/{} has it", earlier - scene.lights.begin()));
    scene.lights.push_back(std::move(light));
  }
}

}  // namespace mote
