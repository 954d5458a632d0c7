#include "engine/renderer.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "engine/passes/light_grid_pass.h"
#include "engine/passes/light_pass.h"
#include "engine/passes/solid_pass.h"
#include "engine/picture.h"
#include "engine/splats.h"
#include "engine/surface_light.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/log_event.h"
#include "host/core/parallel.h"
#include "host/core/progress.h"
#include "host/core/simd_targets.h"
#include "host/core/timer.h"
#include "host/lighting/exact/beam_kernel.h"
#include "host/solids/surfaces.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

const char* place(bool onDevice) { return onDevice ? "GPU" : "CPU"; }

/// The device if there is one; null, with the reason in `why`, if there is none and none was asked for by name.
std::unique_ptr<Gpu> tryOpen(const DeviceOptions& options, bool needed, std::string& why) {
  try {
    return std::make_unique<Gpu>(options);
  } catch (const MachineError& error) {
    if (needed) throw;
    why = error.what();
    return nullptr;
  }
}

/// `device`: "" where none is used, because of `why` where there is a reason.
void logChoice(const Backends& chosen, const std::string& device, const std::string& why) {
  const std::string host = fmt::format("{} threads, {}", threadCount(), simdTargetInUse());
  std::string text = fmt::format("lighting and picture on the CPU ({}); Vulkan is not used", host);
  if (!why.empty()) text += ": " + why;
  if (chosen.anyGpu())
    text = fmt::format("lighting on the {}, picture on the {} ({}; {})", place(chosen.gpuLighting),
                       place(chosen.gpuRaster), device, host);
  logEvent("info",
           {{"message", text},
            {"lighting", chosen.gpuLighting ? "gpu" : "cpu"},
            {"raster", chosen.gpuRaster ? "gpu" : "cpu"},
            {"device", device.empty() ? "none" : device}},
           text);
}

}  // namespace

Backends chooseBackends(Backend lighting, Backend raster, const DeviceOptions& options, std::unique_ptr<Gpu>& gpu) {
  const bool needed = lighting == Backend::Gpu || raster == Backend::Gpu;
  const bool considered = needed || lighting == Backend::Auto || raster == Backend::Auto;
  std::string why;
  if (considered) gpu = tryOpen(options, needed, why);
  const bool prefer = gpu && !gpu->device().isCpu();
  const Backends chosen{lighting == Backend::Gpu || (lighting == Backend::Auto && prefer),
                        raster == Backend::Gpu || (raster == Backend::Auto && prefer), lighting == Backend::Auto,
                        raster == Backend::Auto};
  if (!chosen.anyGpu()) gpu.reset();
  logChoice(chosen, gpu ? gpu->device().name() : "", considered ? why : "");
  return chosen;
}

Renderer::Renderer(Backends backends, Gpu* gpu) : backends_(backends), gpu_(gpu) {
  MOTE_CHECK(backends.anyGpu() && gpu == nullptr, ==, false);
  if (gpu) recovery_.emplace(*gpu);
}

LightWanted lightWanted(const Scene& scene) { return {.byLight = scene.output.lights}; }

namespace {

/// The device's passes behind ShadowSources.
class DeviceShadows {
 public:
  DeviceShadows(const Device& device, const Frame& frame, std::vector<LightMethod>* methods)
      : frame_(frame),
        methods_(methods),
        light_(device, frame.rules.falloff, frame.rules.endpoint),
        grid_(device),
        solids_(device) {
    if (!frame.solidTree.empty()) solids_.setTree(frame.solidTree);
    depths_.exact = [this](const Octree& tree, const Receivers& receivers, const layout::Light& light,
                           const LightingOptions& options, std::span<const std::uint8_t> reached,
                           const RaysDone& done) { return sums(tree, receivers, light, options, reached, done); };
    depths_.grid = [this](const Octree& tree, const Receivers& receivers, const layout::Light& light,
                          const LightingOptions& options, const GridResolution& resolution,
                          std::span<const std::uint8_t> reached, const RaysDone& done) {
      return grid_.opticalDepths(tree, receivers, light, options, resolution, reached, done);
    };
  }
  DeviceShadows(const DeviceShadows&) = delete;
  DeviceShadows& operator=(const DeviceShadows&) = delete;

  ShadowSources sources() {
    return {.opticalDepths = depthsWithin(frame_, depths_, methods_),
            .occluded = [this](const Receivers& receivers, std::span<const std::uint8_t> wanted,
                               const layout::Light& from) {
              light_.release();
              return solids_.occluded(receivers, wanted, from);
            }};
  }

  void addTo(FrameStats& stats) const {
    stats.deviceSeconds["lighting"] += light_.deviceSeconds() + grid_.deviceSeconds() + solids_.deviceSeconds();
  }

 private:
  /// The frame's tree stays on the device from light to light; others are gone when the call is over.
  std::vector<float> sums(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                          const LightingOptions& options, std::span<const std::uint8_t> reached, const RaysDone& done) {
    grid_.release();
    const bool lasts = &tree == &frame_.density.tree();
    if (!lasts || !holdsFrame_) light_.setTree(tree);  // into what is left
    holdsFrame_ = lasts;
    return light_.opticalDepths(receivers, light, options, reached, done);
  }

  const Frame& frame_;
  std::vector<LightMethod>* methods_;
  LightPass light_;
  LightGridPass grid_;
  SolidPass solids_;
  DepthSources depths_;
  bool holdsFrame_ = false;
};

/// Adds the most device memory that was held while it lived to the statistics.
class DevicePeak {
 public:
  DevicePeak(const Gpu* gpu, FrameStats& stats) : device_(gpu->device()), stats_(stats) { device_.restartPeak(); }
  ~DevicePeak() { stats_.deviceBytes = std::max(stats_.deviceBytes, device_.budget().peak()); }
  DevicePeak(const DevicePeak&) = delete;
  DevicePeak& operator=(const DevicePeak&) = delete;

 private:
  const Device& device_;
  FrameStats& stats_;
};

}  // namespace

void Renderer::step(int frame, const std::string& name, bool Backends::*onDevice, bool Backends::*mayLeave,
                    FrameStats& stats, std::string& place, const Work& device, const Work& host) {
  const auto done = [&](const char* where) {
    if (place.find(where) == std::string::npos) place += place.empty() ? where : fmt::format(", {}", where);
  };
  if (backends_.*onDevice) {
    const FrameStats before = stats;  // of what has been done; what is repeated counts once, but for its seconds
    const auto work = [&] {
      stats = before;
      const DevicePeak peak(gpu_, stats);
      device();
    };
    if (recovery_->onDevice(frame, name, backends_.*mayLeave, work)) return done("gpu");
    stats = before;
    backends_.*onDevice = false;
    if (!gpu_->isOpen() && backends_.autoLighting) backends_.gpuLighting = false;  // it was lost, and lost again
    if (!gpu_->isOpen() && backends_.autoRaster) backends_.gpuRaster = false;
  }
  host();
  done("cpu");
}

LitParticles Renderer::light(const Frame& frame, LightWanted wanted, FrameStats& stats) {
  Timer timer;
  std::vector<LightMethod>* methods = frame.error.mean > 0 ? &stats.methods : nullptr;
  LitParticles lit;
  step(
      frame.number, "lighting", &Backends::gpuLighting, &Backends::autoLighting, stats, stats.lighting,
      [&] {
        DeviceShadows device(gpu_->device(), frame, methods);
        lit = lightParticles(frame, device.sources(), wanted);
        device.addTo(stats);
      },
      [&] { lit = lightParticles(frame, hostShadows(frame, methods), wanted); });
  stats.seconds["lighting"] += timer.lap();
  return lit;
}

std::vector<SurfaceLight> Renderer::lightOn(const Surfaces& surfaces, const Frame& frame, const Scene& scene,
                                            FrameStats& stats) {
  std::vector<SurfaceLight> lights;
  const auto lightFrom = [&](const ShadowSources& sources) {
    lights.clear();
    Progress progress("lighting", static_cast<double>(frame.lights.size()), "lights");
    for (const layout::Light& light : frame.lights) {
      lights.push_back(lightSurfaces(frame, scene, surfaces, light, sources));
      progress.advance(1);
    }
  };
  step(
      frame.number, "lighting of its solids", &Backends::gpuLighting, &Backends::autoLighting, stats, stats.lighting,
      [&] {
        DeviceShadows device(gpu_->device(), frame, nullptr);
        lightFrom(device.sources());
        device.addTo(stats);
      },
      [&] { lightFrom(hostShadows(frame)); });
  return lights;
}

namespace {

/// Σ over the lights, in the order in which lightParticles adds them up.
std::vector<vec3> sumOf(const std::vector<std::vector<vec3>>& byLight, std::size_t count) {
  std::vector<vec3> sum(count, vec3(0));
  for (const std::vector<vec3>& light : byLight)
    for (std::size_t k = 0; k < count; ++k) sum[k] += light[k];
  return sum;
}

}  // namespace

Image Renderer::draw(const Frame& frame, const Scene& scene, LitParticles lit, FrameStats& stats,
                     std::vector<layout::uint>* order) {
  Timer timer;
  Surfaces surfaces;
  const bool seen = std::any_of(scene.solids.begin(), scene.solids.end(),
                                [](const Solid& solid) { return solid.mode != SolidMode::Hidden; });
  if (seen) {
    const Progress progress("solids");
    surfaces = traceSurfaces(scene.solids, frame.meshes, frame.view);
    stats.seconds["solids"] += timer.lap();
  }
  std::vector<SurfaceLight> surfaceLights;
  if (!surfaces.empty()) {  // their light's arrays are gone before the splats need the memory
    surfaceLights = lightOn(surfaces, frame, scene, stats);
    stats.seconds["lighting"] += timer.lap();
  }

  timer.lap();
  SplatSet set;
  {
    const Progress progress("splat");
    set = splatSet(frame, scene, lit.radiance);
  }
  const std::size_t count = lit.radiance.size();
  lit.radiance = {};
  stats.drawn = set.particles.size();
  stats.seconds["splat"] += timer.lap();
  const float keyScale = depthKeyScale(frame.particles.bounds(), frame.view.position);
  Image image;
  bool relit = false;
  const auto draw = [&](const auto& rasterizerOf) {
    // Only layers of single lights draw the particles in another light.
    if (std::exchange(relit, scene.output.lights)) set = splatSet(frame, scene, sumOf(lit.byLight, count));
    const std::unique_ptr<Rasterizer> rasterizer = rasterizerOf();
    if (order) *order = rasterizer->order();
    image = makePicture(frame, scene, lit, surfaces, surfaceLights, *rasterizer, stats);
  };
  step(
      frame.number, "picture", &Backends::gpuRaster, &Backends::autoRaster, stats, stats.raster,
      [&] { draw([&] { return deviceRasterizer(gpu_->device(), set, keyScale, stats); }); },
      [&] { draw([&] { return hostRasterizer(set, keyScale, stats); }); });
  return image;
}

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
    const std::unique_ptr<Rasterizer> rasterizer =
        backends_.gpuRaster ? deviceRasterizer(gpu_->device(), some, keyScale, ignored)
                            : hostRasterizer(some, keyScale, ignored);
    sample.picture = rasterizer->draw({}, pictureLayers(frame, scene));
    return one.lap();
  };
  // On a straight line through two sizes, or all of it where that is little.
  constexpr std::size_t kFew = 100'000, kStep = 8;
  secondsOf(std::max<std::size_t>(1, drawn / 1000));  // pipelines and the like, made once
  double once = secondsOf(drawn <= kFew ? 1 : kStep);
  if (drawn > kFew)
    once += std::max(0.0, once - secondsOf(2 * kStep)) * 2 * (static_cast<double>(kStep) - 1);
  std::size_t pictures = 1;
  if (scene.output.lights) pictures += frame.lights.size() + !all.emission.empty();
  sample.seconds = gathered + once * static_cast<double>(pictures);
  return sample;
}

}  // namespace mote
