// The inner loop of the reference rasteriser: splats onto one tile of the picture, with the CPU's best vector
// instructions chosen at run time. Every instruction set gives the same bits: the operations of footprint.h, no fused
// multiply-add.
#pragma once
#include <cstddef>
#include <cstdint>

#include "host/core/vec.h"
#include "shaders/glsl/layout/splat.h"

namespace mote {

constexpr int kTileWidth = 64, kTileHeight = 32;
/// Rows are longer than the tile by one vector of at most 16 lanes: a vector may start at a row's last pixel.
constexpr int kTileLanes = 16;
constexpr int kTileStride = kTileWidth + kTileLanes;

/// A footprint with what drawing needs beside it.
struct Splat {
  vec3 centre;
  float depth;
  vec2 image, pixel;
  vec3 radiance;
  float opacity, peak;
  std::uint16_t left, top, right, bottom;  ///< pixels [left, right) × [top, bottom) of the picture
};

/// One tile's pixels, a plane a channel.
struct alignas(64) Tile {
  int left = 0, top = 0;  ///< its first pixel in the picture
  bool withDepth = false;
  float r[kTileHeight * kTileStride], g[kTileHeight * kTileStride], b[kTileHeight * kTileStride],
      a[kTileHeight * kTileStride], depth[kTileHeight * kTileStride];
};

/// Draws splats[item[0]], splats[item[1]], … over the tile, in this order.
void drawSplats(const Splat* splats, const std::uint32_t* items, std::size_t count, float pixelSize,
                layout::uint falloff, Tile& tile);

}  // namespace mote
