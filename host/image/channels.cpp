#include "host/image/channels.h"

#include <algorithm>

#include "host/core/error.h"

namespace mote {

std::vector<ChannelView> channelsOf(Image& image) {
  const std::size_t pixels = image.pixels.size();
  const auto check = [&](std::size_t size) { MOTE_CHECK(size, ==, pixels); };
  std::vector<ChannelView> views;
  const auto add = [&](const char* name, float* first, std::size_t stride, bool colour, float empty = 0) {
    views.push_back({name, first, stride, colour, empty});
  };
  if (pixels == 0) return {};
  float* const rgba = &image.pixels[0].x;
  const char* const colours[] = {"R", "G", "B", "A"};
  for (std::size_t c = 0; c < 4; ++c) add(colours[c], rgba + c, 4, true);
  if (!image.alpha.empty()) {
    check(image.alpha.size());
    const char* const alphas[] = {"AR", "AG", "AB"};
    for (std::size_t c = 0; c < 3; ++c) add(alphas[c], &image.alpha[0].x + c, 3, true);
  }
  if (!image.depth.empty()) check(image.depth.size()), add("Z", image.depth.data(), 1, false, kNoDepth);
  if (!image.opticalDepth.empty())
    check(image.opticalDepth.size()), add("optical_depth", image.opticalDepth.data(), 1, false);
  if (!image.velocity.empty()) {
    check(image.velocity.size());
    add("velocity.x", &image.velocity[0].x, 2, false);
    add("velocity.y", &image.velocity[0].y, 2, false);
  }
  for (ImageLayer& layer : image.layers) {
    check(layer.values.size());
    add(layer.name.c_str(), layer.values.data(), 1, layer.colour);
  }
  return views;
}

std::vector<ChannelView> channelsOf(const Image& image) { return channelsOf(const_cast<Image&>(image)); }

Image imageWith(int width, int height, const std::vector<std::string>& names) {
  const auto has = [&](const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  Image image(width, height, has("Z"));
  const std::size_t pixels = image.pixels.size();
  const bool alpha = has("AR") && has("AG") && has("AB"), velocity = has("velocity.x") && has("velocity.y");
  if (alpha) image.alpha.assign(pixels, vec3(0));
  if (has("optical_depth")) image.opticalDepth.assign(pixels, 0.0f);
  if (velocity) image.velocity.assign(pixels, vec2(0));
  for (const std::string& name : names) {
    const bool typed = name == "R" || name == "G" || name == "B" || name == "A" || name == "Z" ||
                       name == "optical_depth" || (alpha && (name == "AR" || name == "AG" || name == "AB")) ||
                       (velocity && (name == "velocity.x" || name == "velocity.y"));
    if (!typed) image.layers.push_back({name, std::vector<float>(pixels, 0.0f), false});
  }
  return image;
}

}  // namespace mote
