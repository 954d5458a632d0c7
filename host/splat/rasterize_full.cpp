#include "host/splat/rasterize_full.h"

#include <algorithm>

#include "host/core/error.h"
#include "host/splat/full_splat.h"
#include "host/splat/splat.h"
#include "host/splat/tile_bins.h"

namespace mote {
namespace {

constexpr std::size_t kBatch = std::size_t{1} << 18;  // splats kept at once; the result does not depend on it

struct FullSplat {
  FullFootprint footprint;
  vec2 velocity;                           ///< on the picture [pixels per frame]; 0 unless that layer is drawn
  layout::uint particle;                   ///< index into the set
  std::uint16_t left, top, right, bottom;  ///< pixels [left, right) × [top, bottom) of the picture
};

FullSplat makeFullSplat(const SplatSet& set, layout::uint particle, bool withVelocity) {
  FullSplat s{};
  s.particle = particle;
  const layout::SplatParticle& p = set.particles[particle];
  const vec3 velocity = set.velocity.empty() ? vec3(0) : set.velocity[particle];
  if (!makeFullFootprint(p, velocity, set.scene, s.footprint)) return s;
  if (withVelocity) s.velocity = screenVelocity(p.position, velocity, set.scene);
  s.left = nearestPixel(s.footprint.lo.x), s.top = nearestPixel(s.footprint.lo.y);
  s.right = nearestPixel(s.footprint.hi.x), s.bottom = nearestPixel(s.footprint.hi.y);
  return s;
}

/// One splat over the pixels of one tile.
void drawSplat(const SplatSet& set, const FullSplat& s, const Tiling& tiling, std::size_t tile,
               std::span<const float> surfaces, Image& image) {
  const int left = std::max<int>(s.left, tiling.left(tile)),
            right = std::min<int>(s.right, tiling.left(tile) + kTileWidth);
  const int top = std::max<int>(s.top, tiling.top(tile)),
            bottom = std::min<int>(s.bottom, tiling.top(tile) + kTileHeight);
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) {
      const std::size_t pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
      const float surface = surfaces.empty() ? kNoDepth : surfaces[pixel];
      if (surface == layout::kPixelLeftOut) continue;
      SplatSample sample;
      const vec2 at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      if (!sampleSplat(set, s.footprint, s.particle, at, surface, sample)) continue;
      const float alpha = ((sample.alpha.x + sample.alpha.y) + sample.alpha.z) / 3.0f;
      vec4& value = image.pixels[pixel];
      value = value * (1.0f - vec4(sample.alpha, alpha)) + vec4(sample.color, alpha);
      if (!image.alpha.empty()) image.alpha[pixel] = image.alpha[pixel] * (1.0f - sample.alpha) + sample.alpha;
      if (!image.depth.empty() && alpha >= kDepthAlpha)
        image.depth[pixel] = std::min(image.depth[pixel], s.footprint.depth);
      if (!image.opticalDepth.empty()) image.opticalDepth[pixel] += sample.depth;
      if (!image.velocity.empty()) image.velocity[pixel] = image.velocity[pixel] * (1.0f - alpha) + alpha * s.velocity;
    }
}

}  // namespace

bool SplatSet::plain() const {
  const layout::SplatCamera& c = scene.camera;
  return extinction.empty() && emission.empty() && spriteColor.empty() && spriteOpacity.empty() && scene.moving == 0 &&
         c.orthographic == 0 && c.apertureRadius == 0 && c.pixelAspect == 1;
}

void finishLayers(Image& image) {
  for (std::size_t i = 0; i < image.velocity.size(); ++i)
    if (image.pixels[i].w > 0) image.velocity[i] /= image.pixels[i].w;
  for (std::size_t i = 0; i < image.alpha.size(); ++i)
    image.pixels[i].w = ((image.alpha[i].x + image.alpha[i].y) + image.alpha[i].z) / 3.0f;
}

Image rasterizeFull(const SplatSet& set, std::span<const layout::uint> order, std::span<const float> surfaces,
                    SplatLayers layers, const SplatsDone& done) {
  const layout::SplatCamera& camera = set.camera();
  Image image(static_cast<int>(camera.imageSize.x), static_cast<int>(camera.imageSize.y), layers.depth);
  MOTE_CHECK(std::max(image.width, image.height), <=, 65535);  // the splats' rectangles
  const std::size_t pixels = image.pixels.size();
  if (!surfaces.empty()) MOTE_CHECK(surfaces.size(), ==, pixels);
  if (layers.colorAlpha) image.alpha.assign(pixels, vec3(0));
  if (layers.opticalDepth) image.opticalDepth.assign(pixels, 0);
  if (layers.velocity) image.velocity.assign(pixels, vec2(0));
  const Tiling tiling(image.width, image.height);
  std::vector<FullSplat> splats;
  Bins bins;
  for (std::size_t batch = 0; batch < order.size(); batch += kBatch) {
    splats.resize(std::min(kBatch, order.size() - batch));
    parallelBlocks(splats.size(), 4096, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) splats[i] = makeFullSplat(set, order[batch + i], layers.velocity);
    });
    forEachTile(splats, tiling, bins, done, [&](std::size_t tile, const std::uint32_t* items, std::size_t count) {
      for (std::size_t k = 0; k < count; ++k) drawSplat(set, splats[items[k]], tiling, tile, surfaces, image);
    });
  }
  finishLayers(image);
  return image;
}

}  // namespace mote
