// One frame of a scene as a picture: lighting and rasterising on the host or on a Vulkan device.
#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "engine/lighting.h"
#include "engine/recovery.h"
#include "engine/surface_light.h"
#include "engine/vulkan/gpu.h"
#include "host/image/image.h"

namespace mote {

/// Where the two heavy stages run; never Auto.
struct Backends {
  bool gpuLighting = false, gpuRaster = false;
  /// It was Auto: where the device fails, the CPU may take over.
  bool autoLighting = false, autoRaster = false;
  bool anyGpu() const { return gpuLighting || gpuRaster; }
};

/// Backend::Auto becomes the device if there is one that is not a CPU itself: there TBB is faster
/// (docs/performance.md). Opens the device where it may be needed; `gpu` stays null where none is used. Says once, on
/// stderr, where the work is done. Throws MachineError when Gpu is asked for and there is no usable device.
Backends chooseBackends(Backend lighting, Backend raster, const DeviceOptions& options, std::unique_ptr<Gpu>& gpu);

/// What draw() needs of the light beside its sum.
LightWanted lightWanted(const Scene& scene);

struct DrawingSample {
  double seconds = 0;      ///< of the whole
  std::size_t inView = 0;  ///< particles
  Image picture;           ///< of some of them, without light
};

class Renderer {
 public:
  /// `gpu` may be null where `backends` names no device; it must outlive the renderer. Nothing else that its device
  /// made may be there while the renderer works: where the device is lost, it is opened anew.
  Renderer(Backends backends, Gpu* gpu);

  /// Where the work is done now: on the CPU, once a device has failed beyond recovery (recovery.h) and it may.
  Backends backends() const { return backends_; }

  /// Lights the particles; adds seconds["lighting"] and, on the device, deviceSeconds["lighting"] and deviceBytes.
  /// Where the device's budget is too small for the tree, it is passed in parts, and draw() sorts and splats in parts.
  LitParticles light(const Frame& frame, LightWanted wanted, FrameStats& stats);

  /// Sorts, splats, and lays solids and medium over each other, with the layers of scene.output (picture.h); adds
  /// seconds and deviceSeconds of solids (camera rays, compositing), lighting (of the solids), sort and splat. `lit` as
  /// lightWanted(scene) asks. `order`, if given, gets the sorted slots.
  Image draw(const Frame& frame, const Scene& scene, LitParticles lit, FrameStats& stats,
             std::vector<layout::uint>* order = nullptr);

  /// About what light() would take [s], from a sample of the receivers; lighting within an error is done as a whole.
  double lightingSeconds(const Frame& frame);
  /// About what draw() would take without solids, from samples of the particles in view.
  DrawingSample drawingSample(const Frame& frame, const Scene& scene);

 private:
  using Work = std::function<void()>;
  std::vector<SurfaceLight> lightOn(const Surfaces& surfaces, const Frame& frame, const Scene& scene,
                                    FrameStats& stats);
  void step(int frame, const std::string& name, bool Backends::*onDevice, bool Backends::*mayLeave, FrameStats& stats,
            std::string& place, const Work& device, const Work& host);

  Backends backends_;
  Gpu* gpu_;
  std::optional<Recovery> recovery_;
};

}  // namespace mote
