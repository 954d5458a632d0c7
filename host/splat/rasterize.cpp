#include <algorithm>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/splat/footprint.h"
#include "host/splat/splat.h"
#include "host/splat/tile_kernel.h"

namespace mote {
namespace {

/// Particles whose splats are kept at once (72 bytes each), and (tile, splat) pairs that are binned at once (4 bytes
/// each). They bound the memory to 150 MB beside the picture; the result does not depend on them.
constexpr std::size_t kBatch = std::size_t{1} << 18;
constexpr std::size_t kMaxPairs = std::size_t{1} << 25;
/// Blocks of a run that are binned side by side; each needs a counter for every tile.
constexpr std::size_t kBinBlocks = 64;

struct Tiling {
  std::size_t columns, rows;
  explicit Tiling(const Image& image)
      : columns((static_cast<std::size_t>(image.width) + kTileWidth - 1) / kTileWidth),
        rows((static_cast<std::size_t>(image.height) + kTileHeight - 1) / kTileHeight) {}
  std::size_t count() const { return columns * rows; }

  /// Calls body(tile) for every tile that the splat's rectangle touches.
  template <class Body>
  void forEach(const Splat& s, const Body& body) const {
    if (s.left >= s.right || s.top >= s.bottom) return;
    for (std::size_t row = s.top / kTileHeight; row <= std::size_t(s.bottom - 1) / kTileHeight; ++row)
      for (std::size_t column = s.left / kTileWidth; column <= std::size_t(s.right - 1) / kTileWidth; ++column)
        body(row * columns + column);
  }
  std::size_t touched(const Splat& s) const {
    if (s.left >= s.right || s.top >= s.bottom) return 0;
    return std::size_t((s.right - 1) / kTileWidth - s.left / kTileWidth + 1) *
           std::size_t((s.bottom - 1) / kTileHeight - s.top / kTileHeight + 1);
  }
};

/// Rounds x ≥ 0: the first pixel whose centre is not before x, or one past the last that is not after. Ties do not
/// matter, the footprint has slack. (std::floor is a call without SSE4.1.)
std::uint16_t nearestPixel(float x) { return static_cast<std::uint16_t>(static_cast<int>(x + 0.5f)); }

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

/// The splats of each tile, in drawing order.
struct Bins {
  std::vector<std::size_t> first;    ///< a tile's first item; one more entry ends the last
  std::vector<std::uint32_t> items;  ///< indices into the batch's splats
};

/// Counting sort of the run [begin, end) by tile: blocks count, one scan gives every (tile, block) its place, blocks
/// fill.
void fillBins(const std::vector<Splat>& splats, std::size_t begin, std::size_t end, const Tiling& tiling, Bins& bins) {
  const std::size_t tiles = tiling.count(), grain = (end - begin + kBinBlocks - 1) / kBinBlocks;
  std::vector<std::uint32_t> places(kBinBlocks * tiles, 0);
  parallelBlocks(end - begin, grain, [&](std::size_t from, std::size_t to) {
    std::uint32_t* mine = places.data() + from / grain * tiles;
    for (std::size_t i = from; i < to; ++i) tiling.forEach(splats[begin + i], [&](std::size_t tile) { ++mine[tile]; });
  });
  bins.first.resize(tiles + 1);
  std::uint32_t place = 0;  // the pairs of a run fit: one splat touches fewer than 2¹⁸ tiles, a run else kMaxPairs
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    bins.first[tile] = place;
    for (std::size_t block = 0; block < kBinBlocks; ++block) {
      const std::uint32_t count = places[block * tiles + tile];
      places[block * tiles + tile] = place;
      place += count;
    }
  }
  bins.first[tiles] = place;
  bins.items.resize(place);
  parallelBlocks(end - begin, grain, [&](std::size_t from, std::size_t to) {
    std::uint32_t* mine = places.data() + from / grain * tiles;
    for (std::size_t i = from; i < to; ++i)
      tiling.forEach(splats[begin + i],
                     [&](std::size_t tile) { bins.items[mine[tile]++] = static_cast<std::uint32_t>(begin + i); });
  });
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

/// Each tile is drawn by one thread from its own list, so the threads' number cannot change the picture.
void drawTiles(const std::vector<Splat>& splats, const Bins& bins, const Tiling& tiling,
               const layout::SplatCamera& camera, Image& image) {
  tbb::parallel_for(std::size_t{0}, tiling.count(), [&](std::size_t index) {
    const std::size_t first = bins.first[index], count = bins.first[index + 1] - first;
    if (count == 0) return;
    thread_local Tile tile{};  // its padding is drawn on too: zero once, then whatever it holds
    tile.left = static_cast<int>(index % tiling.columns) * kTileWidth;
    tile.top = static_cast<int>(index / tiling.columns) * kTileHeight;
    tile.withDepth = !image.depth.empty();
    loadTile(image, tile);
    drawSplats(splats.data(), bins.items.data() + first, count, camera.pixelSize, camera.falloff, tile);
    storeTile(tile, image);
  });
}

}  // namespace

Image rasterize(std::span<const layout::SplatParticle> particles, std::span<const layout::uint> order,
                const layout::SplatCamera& camera, bool withDepth) {
  Image image(static_cast<int>(camera.imageSize.x), static_cast<int>(camera.imageSize.y), withDepth);
  MOTE_CHECK(std::max(image.width, image.height), <=, 65535);  // Splat's rectangle
  const Tiling tiling(image);
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
    for (std::size_t begin = 0, end; begin < splats.size(); begin = end) {
      std::size_t pairs = 0;
      for (end = begin; end < splats.size(); ++end) {
        pairs += tiling.touched(splats[end]);
        if (pairs > kMaxPairs && end > begin) break;
      }
      fillBins(splats, begin, end, tiling, bins);
      drawTiles(splats, bins, tiling, camera, image);
    }
  }
  return image;
}

}  // namespace mote
