#include <algorithm>

#include "host/core/error.h"
#include "host/splat/footprint.h"
#include "host/splat/splat.h"
#include "host/splat/tile_bins.h"

namespace mote {
namespace {

/// Particles whose splats are kept at once (72 bytes each); with the pairs of tile_bins.h 150 MB beside the picture.
/// The result does not depend on it.
constexpr std::size_t kBatch = std::size_t{1} << 18;

/// An empty rectangle where the particle cannot be seen.
Splat makeSplat(const layout::SplatParticle& particle, const layout::SplatCamera& camera) {
  Splat s{};
  Footprint f;
  if (!makeFootprint(particle.position, particle.radius, camera, f)) return s;
  s.centre = f.centre, s.depth = f.depth, s.image = f.image, s.pixel = f.pixel, s.opacity = f.opacity;
  s.radiance = particle.radiance, s.peak = particle.peak;
  s.left = nearestPixel(f.lo.x), s.top = nearestPixel(f.lo.y);
  s.right = nearestPixel(f.hi.x), s.bottom = nearestPixel(f.hi.y);
  return s;
}

void loadTile(const Image& image, Tile& tile) {
  for (int y = tile.top; y < std::min(tile.top + kTileHeight, image.height); ++y)
    for (int x = tile.left; x < std::min(tile.left + kTileWidth, image.width); ++x) {
      const int i = (y - tile.top) * kTileStride + (x - tile.left);
      const vec4& p = image.at(x, y);
      tile.r[i] = p.x, tile.g[i] = p.y, tile.b[i] = p.z, tile.a[i] = p.w;
      if (tile.withDepth) tile.depth[i] = image.depth[std::size_t(y) * image.width + x];
    }
}

void storeTile(const Tile& tile, Image& image) {
  for (int y = tile.top; y < std::min(tile.top + kTileHeight, image.height); ++y)
    for (int x = tile.left; x < std::min(tile.left + kTileWidth, image.width); ++x) {
      const int i = (y - tile.top) * kTileStride + (x - tile.left);
      image.at(x, y) = vec4(tile.r[i], tile.g[i], tile.b[i], tile.a[i]);
      if (tile.withDepth) image.depth[std::size_t(y) * image.width + x] = tile.depth[i];
    }
}

}  // namespace

Image rasterize(std::span<const layout::SplatParticle> particles, std::span<const layout::uint> order,
                const layout::SplatCamera& camera, bool withDepth, const SplatsDone& done) {
  Image image(static_cast<int>(camera.imageSize.x), static_cast<int>(camera.imageSize.y), withDepth);
  MOTE_CHECK(std::max(image.width, image.height), <=, 65535);  // Splat's rectangle
  const Tiling tiling(image.width, image.height);
  std::vector<Splat> splats;
  Bins bins;
  for (std::size_t batch = 0; batch < order.size(); batch += kBatch) {
    splats.resize(std::min(kBatch, order.size() - batch));
    parallelBlocks(splats.size(), 4096, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        // The order jumps through memory: ask for a particle some twenty splats (about 1 µs) before it is needed.
        __builtin_prefetch(&particles[order[std::min(batch + i + 20, order.size() - 1)]]);
        splats[i] = makeSplat(particles[order[batch + i]], camera);
      }
    });
    forEachTile(splats, tiling, bins, done, [&](std::size_t index, const std::uint32_t* items, std::size_t count) {
      thread_local Tile tile{};  // its padding is drawn on too: zero once, then whatever it holds
      tile.left = tiling.left(index), tile.top = tiling.top(index);
      tile.withDepth = withDepth;
      loadTile(image, tile);
      drawSplats(splats.data(), items, count, camera.pixelSize, camera.falloff, tile);
      storeTile(tile, image);
    });
  }
  return image;
}

}  // namespace mote
