#include "engine/renderer.h"

#include <algorithm>
#include <optional>

#include "engine/passes/light_grid_pass.h"
#include "engine/passes/light_pass.h"
#include "engine/passes/solid_pass.h"
#include "engine/picture.h"
#include "engine/splats.h"
#include "engine/surface_light.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
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

}  // namespace

Backends chooseBackends(Backend lighting, Backend raster, const DeviceOptions& options, std::unique_ptr<Gpu>& gpu) {
  const bool needed = lighting == Backend::Gpu || raster == Backend::Gpu;
  const bool considered = needed || lighting == Backend::Auto || raster == Backend::Auto;
  std::string why;
  if (considered) gpu = tryOpen(options, needed, why);
  const bool prefer = gpu && !gpu->device().isCpu();
  const Backends chosen{lighting == Backend::Gpu || (lighting == Backend::Auto && prefer),
                        raster == Backend::Gpu || (raster == Backend::Auto && prefer)};
  const std::string host = fmt::format("{} threads, {}", threadCount(), simdTargets().front());
  if (chosen.anyGpu())
    logInfo(fmt::format("lighting on the {}, picture on the {} ({}; {})", place(chosen.gpuLighting),
                        place(chosen.gpuRaster), gpu->device().name(), host));
  else if (considered && !gpu)
    logInfo(fmt::format("lighting and picture on the CPU ({}); Vulkan is not used: {}", host, why));
  else
    logInfo(fmt::format("lighting and picture on the CPU ({}); Vulkan is not used", host));
  if (!chosen.anyGpu()) gpu.reset();
  return chosen;
}

Renderer::Renderer(Backends backends, Gpu* gpu) : backends_(backends), gpu_(gpu) {
  MOTE_CHECK(backends.anyGpu() && gpu == nullptr, ==, false);
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
  DevicePeak(const Gpu* gpu, FrameStats& stats) : gpu_(gpu), stats_(stats) {
    if (gpu_) gpu_->device().restartPeak();
  }
  ~DevicePeak() {
    if (gpu_) stats_.deviceBytes = std::max(stats_.deviceBytes, gpu_->device().budget().peak());
  }
  DevicePeak(const DevicePeak&) = delete;
  DevicePeak& operator=(const DevicePeak&) = delete;

 private:
  const Gpu* gpu_;
  FrameStats& stats_;
};

}  // namespace

LitParticles Renderer::light(const Frame& frame, LightWanted wanted, FrameStats& stats) {
  Timer timer;
  const DevicePeak peak(gpu_, stats);
  std::vector<LightMethod>* methods = frame.error.mean > 0 ? &stats.methods : nullptr;
  LitParticles lit;
  if (backends_.gpuLighting) {
    DeviceShadows device(gpu_->device(), frame, methods);
    lit = lightParticles(frame, device.sources(), wanted);
    device.addTo(stats);
  } else {
    lit = lightParticles(frame, hostShadows(frame, methods), wanted);
  }
  stats.seconds["lighting"] += timer.lap();
  return lit;
}

Image Renderer::draw(const Frame& frame, const Scene& scene, LitParticles lit, FrameStats& stats,
                     std::vector<layout::uint>* order) {
  Timer timer;
  const DevicePeak peak(gpu_, stats);
  Surfaces surfaces;
  const bool seen = std::any_of(scene.solids.begin(), scene.solids.end(),
                                [](const Solid& solid) { return solid.mode != SolidMode::Hidden; });
  if (seen) surfaces = traceSurfaces(scene.solids, frame.meshes, frame.view);
  if (seen) stats.seconds["solids"] += timer.lap();
  std::vector<SurfaceLight> surfaceLights;
  if (!surfaces.empty()) {
    std::optional<DeviceShadows> device;  // gone before the splats need the memory
    if (backends_.gpuLighting) device.emplace(gpu_->device(), frame, nullptr);
    const ShadowSources sources = device ? device->sources() : hostShadows(frame);
    for (const layout::Light& light : frame.lights)
      surfaceLights.push_back(lightSurfaces(frame, scene, surfaces, light, sources));
    if (device) device->addTo(stats);
    stats.seconds["lighting"] += timer.lap();
  }

  timer.lap();
  SplatSet set = splatSet(frame, scene, lit.radiance);
  lit.radiance = {};
  stats.drawn = set.particles.size();
  stats.seconds["splat"] += timer.lap();
  const float keyScale = depthKeyScale(frame.particles.bounds(), frame.view.position);
  const std::unique_ptr<Rasterizer> rasterizer = backends_.gpuRaster
                                                     ? deviceRasterizer(gpu_->device(), std::move(set), keyScale, stats)
                                                     : hostRasterizer(std::move(set), keyScale, stats);
  if (order) *order = rasterizer->order();
  return makePicture(frame, scene, std::move(lit), surfaces, std::move(surfaceLights), *rasterizer, stats);
}

}  // namespace mote
