// A picture in memory: float RGBA, and depth where it was asked for.
#pragma once
#include <cstddef>
#include <vector>

#include "host/core/vec.h"

namespace mote {

/// Depth of a pixel that no particle covers, as Blender and others write it: large, finite, safe to filter.
constexpr float kNoDepth = 1e10f;

/// Rows from the top, pixels from the left. Colour is linear and premultiplied.
struct Image {
  int width = 0, height = 0;
  std::vector<vec4> pixels;  ///< width × height; RGB radiance [W/(m² sr)], A = 1 − transmittance
  std::vector<float> depth;  ///< empty, or width × height: Z, see depth layer in host/splat/splat.h

  Image() = default;
  Image(int w, int h, bool withDepth = false)
      : width(w), height(h), pixels(std::size_t(w) * h, vec4(0)), depth(withDepth ? std::size_t(w) * h : 0, kNoDepth) {}
  vec4& at(int x, int y) { return pixels[std::size_t(y) * width + x]; }
  const vec4& at(int x, int y) const { return pixels[std::size_t(y) * width + x]; }
};

}  // namespace mote
