// Maps over a splat, bilinear between texel centres and clamped at the edges (thesis §4.7). Twin of
// shaders/glsl/lib/sprite.glsl, operation by operation.
#pragma once
#include <algorithm>
#include <vector>

#include "host/core/vec.h"
#include "shaders/glsl/layout/types.h"

namespace mote {

struct Texels {
  layout::uint a, b, c, d;  ///< upper left, upper right, lower left, lower right
  float x, y;               ///< weights of the right and of the lower ones
};

/// `point` in [−1, 1]² over the map, y upward.
inline Texels texelsAt(const vec2& point, layout::uint width, layout::uint height) {
  const float lastX = static_cast<float>(width) - 1.0f, lastY = static_cast<float>(height) - 1.0f;
  const float x = std::min(std::max((0.5f + 0.5f * point.x) * static_cast<float>(width) - 0.5f, 0.0f), lastX);
  const float y = std::min(std::max((0.5f - 0.5f * point.y) * static_cast<float>(height) - 0.5f, 0.0f), lastY);
  const auto left = static_cast<layout::uint>(x), top = static_cast<layout::uint>(y);
  const layout::uint right = std::min(left + 1, width - 1), bottom = std::min(top + 1, height - 1);
  return {top * width + left,     top * width + right,          bottom * width + left,
          bottom * width + right, x - static_cast<float>(left), y - static_cast<float>(top)};
}

/// The map's value there; T is float or vec4.
template <class T>
T spriteAt(const std::vector<T>& map, layout::uint width, layout::uint height, const vec2& point) {
  const Texels t = texelsAt(point, width, height);
  const T upper = map[t.a] * (1.0f - t.x) + map[t.b] * t.x;
  const T lower = map[t.c] * (1.0f - t.x) + map[t.d] * t.x;
  return upper * (1.0f - t.y) + lower * t.y;
}

}  // namespace mote
