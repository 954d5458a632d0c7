// The pass of full splats: lens, shutter, orthographic and anamorphic cameras, colours, emission, sprites, surfaces,
// layers. Particles in back-to-front order, each a quad out of the geometry shader, blended with two sources.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "engine/vulkan/device.h"
#include "host/image/image.h"
#include "host/splat/splat_set.h"

namespace mote {

/// Draws what rasterizeFull() in host/splat/rasterize_full.h draws, by the same operations (lib/full_splat.glsl).
class FullSplatPass {
 public:
  /// Copies the set's further arrays to the device, 12 bytes a particle each. `device` and `particles` (the set's, as
  /// SplatParticle) must outlive the pass; what is not their radiance stays as it was.
  /// `pointsPerSubmit` > 0 is what one submission draws. Throws MachineError where the device cannot draw pictures of
  /// this size or memory is short.
  FullSplatPass(const Device& device, const SplatSet& set, const Buffer& particles,
                std::uint32_t pointsPerSubmit = 1u << 20);

  /// Whether the set's emission is drawn; it is at first.
  void drawEmission(bool wanted) { scene_.emission = wanted ? emission_.address() : 0; }

  /// Draws the first `count` points of `order` (uint32 indices). `surfaces`, `layers`, result: as rasterizeFull.
  /// Orders itself after nothing: computeToIndexAndVertexInput does that for what wrote `order`.
  Image draw(const Buffer& order, std::uint32_t count, std::span<const float> surfaces, SplatLayers layers,
             const std::function<void(std::uint32_t)>& progress = {});

  /// Device seconds of all drawing so far, from timestamps, and bytes held while drawing.
  double deviceSeconds() const { return deviceSeconds_; }
  std::uint64_t deviceBytes() const { return deviceBytes_; }

 private:
  void drawInto(const GraphicsPipeline& pipeline, std::span<const Image2D> targets,
                std::span<const VkClearColorValue> clear, const Buffer& order, std::uint32_t count, bool alphaOnly,
                const std::function<void(std::uint32_t)>& progress);

  const Device& device_;
  std::uint32_t pointsPerSubmit_, width_, height_;
  layout::SplatScene scene_;
  Buffer extinction_, emission_, velocity_, spriteColor_, spriteOpacity_, sceneBuffer_;
  GraphicsPipeline color_;
  std::optional<GraphicsPipeline> layers_;  // made when it is first needed
  double deviceSeconds_ = 0;
  std::uint64_t deviceBytes_ = 0;
};

}  // namespace mote
