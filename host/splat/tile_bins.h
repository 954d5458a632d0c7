// Splats sorted into the tiles of a picture: each tile is then drawn by one thread from its own list, in drawing order,
// so that the number of threads cannot change the picture.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/core/bins.h"
#include "host/splat/splats_done.h"
#include "host/splat/tile_kernel.h"

namespace mote {

/// (Tile, splat) pairs that are binned at once, 4 bytes each; results do not depend on it.
constexpr std::size_t kMaxPairs = std::size_t{1} << 25;

/// The grid of tiles over a picture. A splat is anything with a pixel rectangle [left, right) × [top, bottom).
struct Tiling {
  std::size_t columns, rows;
  Tiling(int width, int height)
      : columns((static_cast<std::size_t>(width) + kTileWidth - 1) / kTileWidth),
        rows((static_cast<std::size_t>(height) + kTileHeight - 1) / kTileHeight) {}
  std::size_t count() const { return columns * rows; }
  int left(std::size_t tile) const { return static_cast<int>(tile % columns) * kTileWidth; }
  int top(std::size_t tile) const { return static_cast<int>(tile / columns) * kTileHeight; }

  /// Calls body(tile) for every tile that the splat's rectangle touches.
  template <class S, class Body>
  void forEach(const S& s, const Body& body) const {
    if (s.left >= s.right || s.top >= s.bottom) return;
    for (std::size_t row = s.top / kTileHeight; row <= std::size_t(s.bottom - 1) / kTileHeight; ++row)
      for (std::size_t column = s.left / kTileWidth; column <= std::size_t(s.right - 1) / kTileWidth; ++column)
        body(row * columns + column);
  }
  template <class S>
  std::size_t touched(const S& s) const {
    if (s.left >= s.right || s.top >= s.bottom) return 0;
    return std::size_t((s.right - 1) / kTileWidth - s.left / kTileWidth + 1) *
           std::size_t((s.bottom - 1) / kTileHeight - s.top / kTileHeight + 1);
  }
};

/// The splats of each tile, in drawing order. A run's fit: a splat touches fewer than 2¹⁸ tiles.
using Bins = Binned<std::uint32_t>;

/// Bins all splats in runs of at most kMaxPairs pairs and calls drawTile(tile, items, count) for each tile that has
/// some, tiles side by side, runs one after the other. `done`, where it is given, gets each tile's share of the splats.
template <class S, class DrawTile>
void forEachTile(const std::vector<S>& splats, const Tiling& tiling, Bins& bins, const SplatsDone& done,
                 const DrawTile& drawTile) {
  for (std::size_t begin = 0, end; begin < splats.size(); begin = end) {
    std::size_t pairs = 0;
    for (end = begin; end < splats.size(); ++end) {
      pairs += tiling.touched(splats[end]);
      if (pairs > kMaxPairs && end > begin) break;
    }
    const auto each = [&](std::size_t from, std::size_t to, const auto& put) {
      for (std::size_t i = begin + from; i < begin + to; ++i)
        tiling.forEach(splats[i], [&](std::size_t tile) { put(tile, static_cast<std::uint32_t>(i)); });
    };
    sortIntoBins(end - begin, tiling.count(), each, bins);
    const double perPair =
        static_cast<double>(end - begin) / static_cast<double>(std::max<std::size_t>(bins.items.size(), 1));
    tbb::parallel_for(std::size_t{0}, tiling.count(), [&](std::size_t tile) {
      const std::span<const std::uint32_t> items = bins.of(tile);
      if (items.empty()) return;
      drawTile(tile, items.data(), items.size());
      if (done) done(perPair * static_cast<double>(items.size()));
    });
    if (done && bins.items.empty()) done(static_cast<double>(end - begin));
  }
}

/// Rounds x ≥ 0: the first pixel whose centre is not before x, or one past the last that is not after. Ties do not
/// matter, footprints have slack. (std::floor is a call without SSE4.1.)
inline std::uint16_t nearestPixel(float x) { return static_cast<std::uint16_t>(static_cast<int>(x + 0.5f)); }

}  // namespace mote
