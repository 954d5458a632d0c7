#include "engine/picture.h"

#include <algorithm>

#include "engine/splats.h"
#include "host/core/parallel.h"
#include "host/core/timer.h"
#include "host/splat/full_footprint.h"

namespace mote {
namespace {

constexpr std::size_t kBlock = 1 << 12;

/// What surfaces look like: of all lights, or of one.
using SurfaceRadiance = std::vector<vec3>;

class Composer {
 public:
  Composer(const Scene& scene, const Surfaces& surfaces, Rasterizer& rasterizer, FrameStats& stats)
      : scene_(scene), surfaces_(surfaces), rasterizer_(rasterizer), stats_(stats) {
    if (!surfaces.empty())
      for (int k = 0; k < surfaces.drawings(); ++k) depths_.push_back(surfaces.depths(k));
  }

  /// The medium as the rasteriser has it now, over surfaces of this radiance.
  Image compose(const SurfaceRadiance& radiance, SplatLayers layers) {
    if (surfaces_.empty()) return rasterizer_.draw({}, layers);
    Image sum;
    for (std::size_t k = 0; k < depths_.size(); ++k) {
      const Image drawn = rasterizer_.draw(depths_[k], layers);
      Timer timer;
      if (k == 0) sum = empty(drawn);
      parallelBlocks(drawn.pixels.size(), kBlock, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) add(drawn, static_cast<int>(k), p, radiance, sum);
      });
      stats_.seconds["solids"] += timer.lap();
    }
    for (std::size_t p = 0; p < sum.velocity.size(); ++p)
      if (sum.pixels[p].w > 0) sum.velocity[p] /= sum.pixels[p].w;
    return sum;
  }

 private:
  static Image empty(const Image& like) {
    Image image(like.width, like.height, !like.depth.empty());
    image.alpha.assign(like.alpha.size(), vec3(0));
    image.opticalDepth.assign(like.opticalDepth.size(), 0);
    image.velocity.assign(like.velocity.size(), vec2(0));
    return image;
  }

  void add(const Image& drawn, int k, std::size_t p, const SurfaceRadiance& radiance, Image& sum) const {
    float coverage = 0;
    const Surface* surface = surfaces_.at(p, k, coverage);
    if (coverage <= 0) return;
    const bool shaded = surface && scene_.solids[surface->solid].mode == SolidMode::Shaded;
    const vec4& medium = drawn.pixels[p];
    const vec3 alpha = drawn.alpha.empty() ? vec3(medium.w) : drawn.alpha[p];
    const vec3 seen =
        shaded ? (vec3(1) - alpha) * radiance[static_cast<std::size_t>(surface - surfaces_.all.data())] : vec3(0);
    const float behind = shaded ? 1 - medium.w : 0;  // what the surface adds to A
    sum.pixels[p] += coverage * vec4(vec3(medium) + seen, medium.w + behind);
    if (!sum.alpha.empty()) sum.alpha[p] += coverage * (shaded ? vec3(1) : alpha);
    if (!sum.opticalDepth.empty()) sum.opticalDepth[p] += coverage * drawn.opticalDepth[p];
    if (!sum.depth.empty()) sum.depth[p] = std::min({sum.depth[p], drawn.depth[p], shaded ? surface->depth : kNoDepth});
    if (!sum.velocity.empty()) {
      const vec2 own = shaded ? screenVelocity(surface->points[0], vec3(0), rasterizer_.set().scene) : vec2(0);
      sum.velocity[p] += coverage * (medium.w * drawn.velocity[p] + behind * own);
    }
  }

  const Scene& scene_;
  const Surfaces& surfaces_;
  Rasterizer& rasterizer_;
  FrameStats& stats_;
  std::vector<std::vector<float>> depths_;
};

/// R, G and B of a picture as three layers.
void addColorLayers(const Image& from, const std::string& name, Image& to) {
  constexpr const char* kNames[] = {".R", ".G", ".B"};
  for (int c = 0; c < 3; ++c) {
    ImageLayer layer{name + kNames[c], std::vector<float>(from.pixels.size()), true};
    for (std::size_t p = 0; p < layer.values.size(); ++p) layer.values[p] = from.pixels[p][c];
    to.layers.push_back(std::move(layer));
  }
}

/// What a light leaves at each pixel's surfaces, 1 where there are none.
ImageLayer shadowLayer(const std::string& light, const Surfaces& surfaces, const std::vector<float>& shadow,
                       std::size_t pixels) {
  ImageLayer layer{"shadow." + light, std::vector<float>(pixels, 1), false};
  for (std::size_t i = 0; i < surfaces.all.size(); ++i)
    layer.values[surfaces.all[i].pixel] -= surfaces.all[i].coverage * (1 - shadow[i]);
  for (float& value : layer.values) value = std::max(value, 0.0f);
  return layer;
}

}  // namespace

SplatLayers pictureLayers(const Frame& frame, const Scene& scene) {
  const Output& output = scene.output;
  return {.depth = output.depth,
          .opticalDepth = output.opticalDepth,
          .velocity = output.velocity,
          .colorAlpha = !frame.extinction.grey()};
}

Image makePicture(const Frame& frame, const Scene& scene, const LitParticles& lit, const Surfaces& surfaces,
                  std::vector<SurfaceLight> surfaceLights, Rasterizer& rasterizer, FrameStats& stats) {
  std::vector<ImageLayer> shadows;
  std::vector<SurfaceRadiance> byLight;
  SurfaceRadiance total(surfaces.all.size(), vec3(0));
  const std::size_t pixels =
      static_cast<std::size_t>(scene.output.size.x) * static_cast<std::size_t>(scene.output.size.y);
  surfaceLights.resize(frame.lights.size());  // empty ones where there are no surfaces
  for (std::size_t l = 0; l < frame.lights.size(); ++l) {
    SurfaceLight& own = surfaceLights[l];
    for (std::size_t i = 0; i < total.size(); ++i) total[i] += own.radiance[i];
    if (scene.output.shadow) shadows.push_back(shadowLayer(frame.lightNames[l], surfaces, own.shadow, pixels));
    byLight.push_back(std::move(own.radiance));
  }
  surfaceLights.clear();
  Composer composer(scene, surfaces, rasterizer, stats);
  Image picture = composer.compose(total, pictureLayers(frame, scene));
  picture.layers = std::move(shadows);
  if (!scene.output.lights) return picture;
  const SplatLayers plain{.colorAlpha = !frame.extinction.grey() && !surfaces.empty()};
  const bool emits = !rasterizer.set().emission.empty();
  if (emits) {  // first, since the others take the emission away
    rasterizer.relight(relit(rasterizer.set(), frame, scene, std::vector<vec3>(frame.density.source().size(), vec3(0))),
                       true);
    addColorLayers(composer.compose(SurfaceRadiance(total.size(), vec3(0)), plain), "emission", picture);
  }
  for (std::size_t l = 0; l < frame.lights.size(); ++l) {
    rasterizer.relight(relit(rasterizer.set(), frame, scene, lit.byLight[l]), false);
    addColorLayers(composer.compose(byLight[l], plain), "light." + frame.lightNames[l], picture);
  }
  return picture;
}

}  // namespace mote
