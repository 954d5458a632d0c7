// One frame of a scene as a picture: lighting and rasterising on the host or on a Vulkan device.
#pragma once
#include <memory>

#include "engine/frame.h"
#include "engine/passes/light_pass.h"
#include "engine/passes/splat_pass.h"
#include "engine/vulkan/gpu.h"
#include "host/image/image.h"

namespace mote {

/// Where the two heavy stages run; never Auto.
struct Backends {
  bool gpuLighting = false, gpuRaster = false;
  bool anyGpu() const { return gpuLighting || gpuRaster; }
};

/// Backend::Auto becomes the device if there is one that is not a CPU itself: there TBB is faster
/// (docs/performance.md). Opens the device where it may be needed; `gpu` stays null where none is used. Says once, on
/// stderr, where the work is done. Throws MachineError when Gpu is asked for and there is no usable device.
Backends chooseBackends(Backend lighting, Backend raster, const DeviceOptions& options, std::unique_ptr<Gpu>& gpu);

class Renderer {
 public:
  /// `gpu` may be null where `backends` names no device; it must outlive the renderer.
  Renderer(Backends backends, Gpu* gpu);

  /// Lights the particles; adds seconds["lighting"] and, on the device, deviceSeconds["lighting"].
  LitParticles light(const Frame& frame, bool keepTransmittance, FrameStats& stats);

  /// Sorts and splats; adds seconds and deviceSeconds of sort and splat. `order`, if given, gets the sorted slots.
  Image draw(const Frame& frame, const std::vector<layout::SplatParticle>& splats, bool withDepth, FrameStats& stats,
             std::vector<layout::uint>* order = nullptr);

 private:
  Image drawOnHost(const Frame& frame, const std::vector<layout::SplatParticle>& splats, float keyScale, bool withDepth,
                   FrameStats& stats, std::vector<layout::uint>* order);
  Image drawOnDevice(const Frame& frame, const std::vector<layout::SplatParticle>& splats, float keyScale,
                     bool withDepth, FrameStats& stats, std::vector<layout::uint>* order);

  Backends backends_;
  Gpu* gpu_;
};

}  // namespace mote
