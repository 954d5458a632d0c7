// Drawing of a set of splats, on the host or on a device, again and again: for surfaces in the way, for single lights.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "engine/stats.h"
#include "engine/vulkan/gpu.h"
#include "host/image/image.h"
#include "host/splat/splat_set.h"

namespace mote {

/// Sorts once, when it is made, and draws in that order. Sets without anything special are drawn the fast way
/// (SplatSet::plain). Adds its seconds of sort and splat, and the device's, to the statistics it was given.
class Rasterizer {
 public:
  virtual ~Rasterizer() = default;
  /// `surfaces` and `layers` as rasterizeFull takes them.
  virtual Image draw(std::span<const float> surfaces, SplatLayers layers) = 0;
  /// Other radiance for the same particles; `emission` false: theirs is not drawn.
  virtual void relight(std::vector<layout::SplatParticle> particles, bool emission) = 0;
  /// What is drawn, as it was lit last.
  virtual const SplatSet& set() const = 0;
  /// The particles from back to front.
  virtual const std::vector<layout::uint>& order() const = 0;
};

/// `keyScale`: depthKeyScale of the particles. `set`, which relight changes, and `stats` must outlive the rasteriser.
std::unique_ptr<Rasterizer> hostRasterizer(SplatSet& set, float keyScale, FrameStats& stats);
std::unique_ptr<Rasterizer> deviceRasterizer(const Device& device, SplatSet& set, float keyScale, FrameStats& stats);

}  // namespace mote
