// Every channel of an Image under its EXR name: what writing, reading and comparing walk over.
#pragma once
#include <string>
#include <vector>

#include "host/image/image.h"

namespace mote {

/// One number a pixel inside an Image, `stride` floats apart.
struct ChannelView {
  std::string name;
  float* first;
  std::size_t stride;
  bool colour;      ///< radiance or alpha, which half precision holds; else a measure, always written as float
  float empty = 0;  ///< what a pixel has where there is no picture

  float& at(std::size_t pixel) const { return first[pixel * stride]; }
};

/// R G B A, then AR AG AB, Z, optical_depth, velocity.x, velocity.y and the layers, as far as the image has them.
/// The views hold while the image's arrays stay where they are; through those of a constant image nothing is written.
std::vector<ChannelView> channelsOf(Image& image);
std::vector<ChannelView> channelsOf(const Image& image);

/// An image of this size with room for the named channels: the typed arrays where their names are complete (AR AG AB;
/// velocity.x with velocity.y), layers for all others. R G B A are always there.
Image imageWith(int width, int height, const std::vector<std::string>& names);

}  // namespace mote
