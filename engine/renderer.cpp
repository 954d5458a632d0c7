#include "engine/renderer.h"

#include "engine/passes/depth_key_pass.h"
#include "engine/passes/sort_pass.h"
#include "engine/vulkan/barrier.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/timer.h"
#include "host/lighting/kernel.h"
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

void addDeviceSeconds(FrameStats& stats, const TimestampQueries& queries) {
  for (const StageTime& time : queries.results()) stats.deviceSeconds[time.stage] += time.seconds;
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

LitParticles Renderer::light(const Frame& frame, bool keepTransmittance, FrameStats& stats) {
  Timer timer;
  LitParticles lit;
  if (backends_.gpuLighting) {
    LightPass pass(gpu_->device(), frame.rules.falloff, frame.rules.endpoint);
    pass.setTree(frame.density.tree());
    lit = lightParticles(
        frame,
        [&](const Receivers& receivers, const layout::Light& light, std::span<const std::uint8_t> reached,
            const RaysDone& done) { return pass.opticalDepths(receivers, light, frame.rules, reached, done); },
        keepTransmittance);
    stats.deviceSeconds["lighting"] += pass.deviceSeconds();
    stats.deviceBytes = std::max(stats.deviceBytes, pass.deviceBytes());
  } else {
    lit = lightParticles(frame, hostOpticalDepths(frame), keepTransmittance);
  }
  stats.seconds["lighting"] += timer.lap();
  return lit;
}

Image Renderer::draw(const Frame& frame, const std::vector<layout::SplatParticle>& splats, bool withDepth,
                     FrameStats& stats, std::vector<layout::uint>* order) {
  const float keyScale = depthKeyScale(frame.particles.bounds(), frame.view.position);
  return backends_.gpuRaster ? drawOnDevice(frame, splats, keyScale, withDepth, stats, order)
                             : drawOnHost(frame, splats, keyScale, withDepth, stats, order);
}

Image Renderer::drawOnHost(const Frame& frame, const std::vector<layout::SplatParticle>& splats, float keyScale,
                           bool withDepth, FrameStats& stats, std::vector<layout::uint>* order) {
  Timer timer;
  std::vector<layout::uint> sorted = sortByDepth(splats, frame.view, keyScale);
  stats.seconds["sort"] += timer.lap();
  Image image = rasterize(splats, sorted, frame.view, withDepth);
  stats.seconds["splat"] += timer.lap();
  if (order) *order = std::move(sorted);
  return image;
}

Image Renderer::drawOnDevice(const Frame& frame, const std::vector<layout::SplatParticle>& splats, float keyScale,
                             bool withDepth, FrameStats& stats, std::vector<layout::uint>* order) {
  const Device& device = gpu_->device();
  const auto count = static_cast<std::uint32_t>(splats.size());
  Timer timer;
  const Buffer particles = device.createBufferWith<layout::SplatParticle>(splats);
  const Buffer indices = device.createBuffer(count * sizeof(std::uint32_t));
  {
    const Buffer pairs = device.createBuffer(SortPass::pairBytes(count));
    const DepthKeyPass keys(device);
    const SortPass sort(device);
    TimestampQueries queries = device.createTimestampQueries(1);
    device.run([&](CommandBuffer& commands) {
      const std::uint32_t span = queries.begin(commands, "sort");
      keys.record(commands, particles, count, frame.view.position, keyScale, pairs);
      sort.record(commands, pairs, count);
      sort.recordExtract(commands, pairs, count, indices);
      queries.end(commands, span);
      commands.barrier(barrier::computeToIndexAndVertexInput);
    });
    addDeviceSeconds(stats, queries);
    stats.deviceBytes = std::max(stats.deviceBytes, particles.size() + indices.size() + pairs.size());
  }
  if (order) *order = device.download<layout::uint>(indices, count);
  stats.seconds["sort"] += timer.lap();

  const SplatPass pass(device, frame.rules.falloff, withDepth);
  const SplatTarget target = pass.createTarget(static_cast<std::uint32_t>(frame.view.imageSize.x),
                                               static_cast<std::uint32_t>(frame.view.imageSize.y));
  TimestampQueries queries = device.createTimestampQueries(pass.submissions(count));
  Progress progress("splat", count);
  std::uint32_t drawn = 0;
  pass.draw(target, particles, indices, count, frame.view, &queries, [&](std::uint32_t soFar) {
    progress.advance(soFar - drawn);
    drawn = soFar;
  });
  Image image = pass.download(target);
  addDeviceSeconds(stats, queries);
  stats.seconds["splat"] += timer.lap();
  return image;
}

}  // namespace mote
