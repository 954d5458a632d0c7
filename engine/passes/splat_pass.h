// The splat pass: particles in back-to-front order, each a quad out of the geometry shader, or a point where it is
// small, blended over a float picture.
#pragma once
#include <cstdint>
#include <functional>

#include "engine/vulkan/device.h"
#include "host/image/image.h"
#include "shaders/glsl/layout/splat.h"

namespace mote {

/// The picture on the device while it is drawn. Made by SplatPass::createTarget.
struct SplatTarget {
  Image2D color;  // RGBA32F, premultiplied
  Image2D depth;  // R32F; empty where the pass has no depth layer
};

/// Draws what rasterize() in host/splat/splat.h draws, by the same operations (lib/footprint.glsl): the same pixels,
/// the same depths, colours equal but for what the device's division, square root and blending round differently:
/// nothing at all on lavapipe. Cost on lavapipe with 2 cores: about 1.2 s for a million splats of 4 pixels' radius.
class SplatPass {
 public:
  /// Points of one submission: a second on a software device, far below the watchdog of a hardware driver. lavapipe
  /// keeps all of a submission's quads in memory that is no device's: 0.8 GB more for 4 M at once
  /// (docs/performance.md).
  static constexpr std::uint32_t kPointsPerSubmit = 1u << 20;

  /// `falloff` kFalloff…; `withDepth` adds the depth layer Z; `pointsPerSubmit` > 0 is what draw() submits at once.
  /// The device must outlive the pass and its targets.
  SplatPass(const Device& device, layout::uint falloff, bool withDepth,
            std::uint32_t pointsPerSubmit = kPointsPerSubmit);

  /// Widest and highest splats [pixels] that are small (smallSplatsFirst): one point each, without a geometry shader,
  /// the same pixels in two thirds of the time on lavapipe. 0: no splat is.
  static float smallSide(const Device& device);

  /// What drawing and downloading pictures of this size [pixels, ≥ 1] take of the device's budget beside the particles.
  std::uint64_t drawingCost(std::uint32_t width, std::uint32_t height) const;
  /// … of it what download() takes while the target is there.
  std::uint64_t downloadCost(std::uint32_t width, std::uint32_t height) const;

  /// Throws MachineError with the numbers where the device cannot draw pictures of this size [pixels, ≥ 1].
  SplatTarget createTarget(std::uint32_t width, std::uint32_t height) const;

  /// Draws `count` points from element `first` of `order` on: uint32 indices into `particles` (SplatParticle), which
  /// the caller keeps in range. `keep` draws over what the target holds, else it is cleared first (also for count 0).
  /// The camera has the target's imageSize and the pass's falloff. Orders itself after earlier drawing on the target,
  /// not after the writing of the buffers: computeToIndexAndVertexInput does that. The first `small` of `order` are
  /// known to be small.
  void record(CommandBuffer& commands, const SplatTarget& target, const Buffer& particles, const Buffer& order,
              std::uint32_t first, std::uint32_t count, const layout::SplatCamera& camera, bool keep,
              std::uint32_t small = 0) const;

  /// Submissions that draw() makes for `count` points, ≥ 1: the spans that its timestamps need.
  std::uint32_t submissions(std::uint32_t count) const;

  /// Records and submits all `count` points in parts; returns when they are drawn, over what the target holds where
  /// `keep` is set. `times`, where given, gets one span "splat" a submission; `progress` the number of points drawn so
  /// far, after each. `small` as for record.
  void draw(const SplatTarget& target, const Buffer& particles, const Buffer& order, std::uint32_t count,
            const layout::SplatCamera& camera, TimestampQueries* times = nullptr,
            const std::function<void(std::uint32_t)>& progress = {}, bool keep = false, std::uint32_t small = 0) const;

  /// The target's picture, with depth where the pass has it. Throws MachineError where host-visible memory is short.
  Image download(const SplatTarget& target) const;

 private:
  const GraphicsPipeline& pipeline(bool points) const;

  const Device& device_;
  layout::uint falloff_;
  bool withDepth_;
  std::uint32_t pointsPerSubmit_;
  mutable GraphicsPipeline quads_, points_;  // made when they are first drawn with
};

}  // namespace mote
