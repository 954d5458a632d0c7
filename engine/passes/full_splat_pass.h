// The pass of full splats: lens, shutter, orthographic and anamorphic cameras, colours, emission, sprites, surfaces,
// layers. Particles in back-to-front order, each a quad out of the geometry shader, blended with two sources.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/passes/splat_buffers.h"
#include "engine/vulkan/device.h"
#include "host/image/image.h"
#include "host/splat/splat_set.h"

namespace mote {

/// Draws what rasterizeFull() in host/splat/rasterize_full.h draws, by the same operations (lib/full_splat.glsl):
/// begin(), draw() once or for one part of the particles after the other, finish().
class FullSplatPass {
 public:
  /// What a pass for this set takes of the device's budget by itself.
  static std::uint64_t ownCost(const Device& device, const SplatSet& set);
  /// Copies the set's sprites to the device, which must outlive the pass. `pointsPerSubmit` > 0 is what one submission
  /// draws. Throws MachineError where the device cannot draw pictures of this size or memory is short.
  FullSplatPass(const Device& device, const SplatSet& set, std::uint32_t pointsPerSubmit = 1u << 20);

  /// What a picture takes of the device's budget beside the particles, from begin() to the end of finish().
  std::uint64_t drawingCost(bool surfaces, SplatLayers layers) const;
  /// … of it what finish() takes while the rest is there.
  std::uint64_t downloadCost() const;

  /// Starts a picture. `surfaces`, `layers`: as rasterizeFull.
  void begin(std::span<const float> surfaces, SplatLayers layers);
  /// Draws the first `count` points of `order` (uint32 indices into `splats`) over what was drawn since begin().
  /// Orders itself after nothing: computeToIndexAndVertexInput does that for what wrote `order`. `progress` gets the
  /// number of points drawn so far, after each submission.
  void draw(const SplatBuffers& splats, const Buffer& order, std::uint32_t count,
            const std::function<void(std::uint32_t)>& progress = {});
  /// The picture, after one draw() at least; what begin() made is given back.
  Image finish();

  /// Device seconds of all drawing so far, from timestamps.
  double deviceSeconds() const { return deviceSeconds_; }

 private:
  /// One drawing of all particles: what it is drawn by and on.
  struct Drawing {
    const GraphicsPipeline* pipeline;
    bool alphaOnly;
    std::vector<Image2D> targets;  // one, or three of the layers
  };
  void record(CommandBuffer& commands, const Drawing& drawing, const Buffer& order, std::uint32_t first,
              std::uint32_t count, bool keep) const;

  const Device& device_;
  std::uint32_t pointsPerSubmit_, width_, height_;
  layout::SplatScene scene_;
  Buffer spriteColor_, spriteOpacity_, sceneBuffer_, surface_;
  GraphicsPipeline color_;
  std::optional<GraphicsPipeline> layers_;  // made when it is first needed
  SplatLayers wanted_;                      // of the picture at hand, as are these
  std::vector<Drawing> drawings_;
  bool drawn_ = false;
  double deviceSeconds_ = 0;
};

}  // namespace mote
