// A picture in memory: float RGBA, and depth where it was asked for.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "host/core/vec.h"

namespace mote {

/// Depth of a pixel that no particle covers, as Blender and others write it: large, finite, safe to filter.
constexpr float kNoDepth = 1e10f;

/// One more channel of numbers, of any meaning; its name is the EXR channel's ("shadow.key", "light.key.R").
struct ImageLayer {
  std::string name;
  std::vector<float> values;  ///< width × height
  bool colour = false;        ///< radiance: stored in the picture's precision; else always as float
};

/// Rows from the top, pixels from the left. Colour is linear and premultiplied.
struct Image {
  int width = 0, height = 0;
  std::vector<vec4> pixels;  ///< width × height; RGB radiance [W/(m² sr)], A = 1 − transmittance
  // Empty, or width × height; what they mean stands in host/splat/splat.h.
  std::vector<vec3> alpha;           ///< per channel, where extinction is not grey; A is then their mean
  std::vector<float> depth;          ///< Z [scene units]
  std::vector<float> opticalDepth;   ///< of the medium, mean of the channels
  std::vector<vec2> velocity;        ///< x to the right, y upward [pixels per frame]
  std::vector<ImageLayer> layers{};  ///< further channels, names all different

  Image() = default;
  Image(int w, int h, bool withDepth = false)
      : width(w), height(h), pixels(std::size_t(w) * h, vec4(0)), depth(withDepth ? std::size_t(w) * h : 0, kNoDepth) {}
  vec4& at(int x, int y) { return pixels[std::size_t(y) * width + x]; }
  const vec4& at(int x, int y) const { return pixels[std::size_t(y) * width + x]; }
};

}  // namespace mote
