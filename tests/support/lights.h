// Lights as tests need them: white, casting full shadows.
#pragma once
#include "shaders/glsl/layout/light.h"

namespace mote {

inline layout::Light pointLight(const glm::vec3& position) {
  return {.position = position,
          .type = layout::kLightPoint,
          .direction = {0, -1, 0},
          .decay = 2,
          .power = glm::vec3(1),
          .shadowDensity = 1,
          .castsShadows = 1,
          .cosInner = 1,
          .cosOuter = -1};
}

/// `direction` of travel, of any length.
inline layout::Light directionalLight(const glm::vec3& direction) {
  return {.position = {},
          .type = layout::kLightDirectional,
          .direction = glm::normalize(direction),
          .decay = 0,
          .power = glm::vec3(1),
          .shadowDensity = 1,
          .castsShadows = 1,
          .cosInner = 1,
          .cosOuter = -1};
}

}  // namespace mote
