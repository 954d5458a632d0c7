// KHR_lights_punctual: points, spots and directions.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "host/core/log.h"
#include "host/scene/gltf/gltf_parts.h"

namespace mote {
namespace {

constexpr const char* kExtension = "KHR_lights_punctual";
constexpr Range kAmount = between(0, std::numeric_limits<float>::max());
constexpr Range kInnerCone{.min = 0, .max = 0.5 * kPi, .unit = "radians"};
constexpr Range kOuterCone{.min = 0, .max = 0.5 * kPi + 1e-6, .minOpen = true, .unit = "radians"};  // single precision

LightType typeOf(const GltfValue& value) {
  const std::string word = value.text();
  if (word == "directional") return LightType::Directional;
  if (word == "spot") return LightType::Spot;
  if (word != "point") value.refuse("point, spot or directional", value ? quotedForMessage(word) : "none");
  return LightType::Point;
}

void readCone(const GltfValue& spot, LightSource& light) {
  const double inner = spot.member("innerConeAngle").number(0, kInnerCone);
  const double outer = spot.member("outerConeAngle").number(0.25 * kPi, kOuterCone);
  light.outerAngle = static_cast<float>(glm::degrees(outer));
  light.innerAngle = static_cast<float>(glm::degrees(inner));
  if (!(light.outerAngle > 0) || light.innerAngle > light.outerAngle)
    spot.refuse("an innerConeAngle <= outerConeAngle", fmt::format("{} and {}", inner, outer));
}

LightSource lightAt(const GltfShot& gltf, std::size_t node, const GltfValue& value) {
  LightSource light;
  light.type = typeOf(value.member("type"));
  const GltfFrame frame = frameOf(gltf.nodes.all[node].world, gltf.value(node), "");
  light.direction = vec3(frame.forward);
  if (light.type != LightType::Directional) light.position = vec3(frame.position);
  double color[3] = {1, 1, 1};
  value.member("color").numbers(color, 3);
  for (int k = 0; k < 3; ++k) {
    if (!isInside(color[k], kAmount)) value.member("color").refuse("three numbers >= 0", fmt::format("{}", color[k]));
    light.color[k] = static_cast<float>(color[k]);
  }
  light.strength = static_cast<float>(value.member("intensity").number(1, kAmount) / gltf.options.lumensPerWatt);
  if (light.type == LightType::Spot) readCone(value.member("spot"), light);
  return light;
}

}  // namespace

void importLights(const GltfShot& gltf, ImportedShot& shot) {
  const GltfValue lights = gltf.file.list("extensions").member(kExtension).member("lights");
  SceneNames names;
  for (const std::size_t i : gltf.nodes.inScene) {
    const GltfValue value = gltf.value(i), index = value.member("extensions").member(kExtension).member("light");
    if (!index) continue;
    const GltfValue source = lights.item(index.index(lights.size(), "lights"));
    const std::string own = userName(gltf.nodes.all[i]);
    LightSource light = lightAt(gltf, i, source);
    light.name =
        names.take(own.empty() ? source.member("name").text() : own, fmt::format("light{}", shot.lights.size()));
    const auto warn = [&](const std::string& what) {
      logWarning(fmt::format("{}: {}: the light {} {}", gltf.file.path(), value.pointer(), light.name, what));
    };
    if (source.member("range"))
      warn("has a range, which is left out: it falls off with the square of the distance and reaches everything");
    if (gltf.animations.moves(i)) warn("stands still: only cameras move");
    shot.lights.push_back(std::move(light));
  }
}

}  // namespace mote
