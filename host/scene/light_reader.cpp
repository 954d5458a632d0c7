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

/// `light`: of that name already, or one of defaults; it is what absent keys leave. Another type starts anew.
void readLight(ObjectReader& object, LightSource& light) {
  LightType type = light.type;
  object.choice<LightType>(
      "type", type, {{"point", LightType::Point}, {"spot", LightType::Spot}, {"directional", LightType::Directional}});
  if (type != light.type) light = {.name = light.name, .type = type};
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
}

}  // namespace

void readLights(ObjectReader& root, Scene& scene) {
  scene.defaultLights = !root.has("lights") && scene.lights.empty();
  std::vector<ObjectReader> objects = root.list("lights", "a light");
  std::vector<std::string> given;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    std::string name = fmt::format("light{}", i);
    readName(objects[i], name, "it becomes the channel Transmittance_<name>");
    const auto known = findNamed(scene.lights, name);
    const auto before = std::find(given.begin(), given.end(), name);
    // A light that is called as one of the import's changes it; that must be meant, so it must be written.
    const bool changes = known != scene.lights.end() && before == given.end() && objects[i].has("name");
    if (known != scene.lights.end() && !changes)
      objects[i].problem("name", "a name that no other light has", quotedForMessage(name),
                         before != given.end() ? fmt::format("/lights/{} has it", before - given.begin())
                                               : "a light of the import has it");
    LightSource light = changes ? *known : LightSource{.name = name};
    readLight(objects[i], light);
    if (changes)
      *known = std::move(light);
    else
      scene.lights.push_back(std::move(light));
    given.push_back(std::move(name));
  }
}

}  // namespace mote
