// A frame's shadows on a device: its passes behind ShadowSources.
#pragma once
#include <vector>

#include "engine/lighting.h"
#include "engine/passes/light_grid_pass.h"
#include "engine/passes/light_pass.h"
#include "engine/passes/solid_pass.h"

namespace mote {

class DeviceShadows {
 public:
  /// All must outlive it. `methods`, where it is given, gets how each light of the particles was computed.
  DeviceShadows(const Device& device, const Frame& frame, std::vector<LightMethod>* methods);
  DeviceShadows(const DeviceShadows&) = delete;
  DeviceShadows& operator=(const DeviceShadows&) = delete;

  /// They use this object.
  ShadowSources sources();
  /// Adds the device's seconds.
  void addTo(FrameStats& stats) const;

 private:
  std::vector<float> sums(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                          const LightingOptions& options, std::span<const std::uint8_t> reached, const RaysDone& done);

  const Frame& frame_;
  std::vector<LightMethod>* methods_;
  LightPass light_;
  LightGridPass grid_;
  SolidPass solids_;
  DepthSources depths_;
  bool holdsFrame_ = false;
};

}  // namespace mote
