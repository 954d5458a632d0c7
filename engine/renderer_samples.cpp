// What light() and draw() would take: the same work on samples, timed.
#include <algorithm>
#include <memory>
#include <optional>

#include "engine/device_shadows.h"
#include "engine/picture.h"
#include "engine/renderer.h"
#include "engine/splats.h"
#include "host/core/timer.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

/// Runs of neighbours, evenly over all receivers: beams through them are as full as through all.
class ReceiverSample {
 public:
  explicit ReceiverSample(const Receivers& all) : all_(all) {
    constexpr std::size_t kRuns = 16, kLength = 8192;
    if (all.size() <= kRuns * kLength) return;
    for (std::size_t run = 0; run < kRuns; ++run) {
      const std::size_t begin = (all.size() - kLength) / (kRuns - 1) * run;
      for (std::size_t k = begin; k < begin + kLength; ++k) {
        x_.push_back(all.x[k]), y_.push_back(all.y[k]), z_.push_back(all.z[k]);
        self_.push_back(all.selfOf(k));
      }
    }
  }
  Receivers receivers() const { return x_.empty() ? all_ : Receivers{x_, y_, z_, self_}; }
  double share() const { return static_cast<double>(receivers().size()) / static_cast<double>(all_.size()); }

 private:
  Receivers all_;
  std::vector<float> x_, y_, z_;
  std::vector<std::uint32_t> self_;
};

template <class T>
std::vector<T> everyNth(const std::vector<T>& all, std::size_t step) {
  std::vector<T> some;
  for (std::size_t k = 0; k < all.size(); k += step) some.push_back(all[k]);
  return some;
}

SplatSet everyNth(const SplatSet& all, std::size_t step) {
  SplatSet some;
  some.particles = everyNth(all.particles, step);
  some.extinction = everyNth(all.extinction, step);
  some.emission = everyNth(all.emission, step);
  some.velocity = everyNth(all.velocity, step);
  some.spriteColor = all.spriteColor, some.spriteOpacity = all.spriteOpacity, some.scene = all.scene;
  return some;
}

}  // namespace

double Renderer::lightingSeconds(const Frame& frame) {
  const Receivers all = frame.density.receivers();
  const ReceiverSample sample(all);
  std::optional<DeviceShadows> device;
  if (backends_.gpuLighting) device.emplace(gpu_->device(), frame, nullptr);
  const ShadowSources sources = device ? device->sources() : hostShadows(frame);
  double seconds = 0;
  for (const layout::Light& light : frame.lights) {
    Timer timer;
    if (frame.error.mean > 0) {  // it is quick, and what it costs a sample says nothing of
      shadows(frame, all, light, sources);
      seconds += timer.lap();
      continue;
    }
    // The first has what all rays share: the tree on its way to the device.
    shadows(frame, sample.receivers(), light, sources);
    const double first = timer.lap();
    shadows(frame, sample.receivers(), light, sources);
    const double second = timer.lap();
    seconds += std::max(0.0, first - second) + second / sample.share();
  }
  return seconds;
}

DrawingSample Renderer::drawingSample(const Frame& frame, const Scene& scene) {
  DrawingSample sample;
  Timer timer;
  const SplatSet all = splatSet(frame, scene, std::vector<vec3>(frame.density.source().size(), vec3(0)));
  const double gathered = timer.lap();
  const std::size_t drawn = sample.inView = all.particles.size();
  const auto secondsOf = [&](std::size_t step) {
    Timer one;
    FrameStats ignored;
    const float keyScale = depthKeyScale(frame.particles.bounds(), frame.view.position);
    SplatSet some = everyNth(all, step);
    one.lap();
    const std::unique_ptr<Rasterizer> rasterizer = backends_.gpuRaster
                                                       ? deviceRasterizer(gpu_->device(), some, keyScale, ignored)
                                                       : hostRasterizer(some, keyScale, ignored);
    sample.picture = rasterizer->draw({}, pictureLayers(frame, scene));
    return one.lap();
  };
  // On a straight line through two sizes, or all of it where that is little.
  constexpr std::size_t kFew = 100'000, kStep = 8;
  secondsOf(std::max<std::size_t>(1, drawn / 1000));  // pipelines and the like, made once
  double once = secondsOf(drawn <= kFew ? 1 : kStep);
  if (drawn > kFew) once += std::max(0.0, once - secondsOf(2 * kStep)) * 2 * (static_cast<double>(kStep) - 1);
  std::size_t pictures = 1;
  if (scene.output.lights) pictures += frame.lights.size() + !all.emission.empty();
  sample.seconds = gathered + once * static_cast<double>(pictures);
  return sample;
}

}  // namespace mote
