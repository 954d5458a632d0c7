#include "engine/renderer.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "engine/device_shadows.h"
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

}  // namespace mote
