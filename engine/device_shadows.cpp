#include "engine/device_shadows.h"

namespace mote {

DeviceShadows::DeviceShadows(const Device& device, const Frame& frame, std::vector<LightMethod>* methods)
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

ShadowSources DeviceShadows::sources() {
  return {
      .opticalDepths = depthsWithin(frame_, depths_, methods_),
      .occluded = [this](const Receivers& receivers, std::span<const std::uint8_t> wanted, const layout::Light& from) {
        light_.release();
        return solids_.occluded(receivers, wanted, from);
      }};
}

void DeviceShadows::addTo(FrameStats& stats) const {
  stats.deviceSeconds["lighting"] += light_.deviceSeconds() + grid_.deviceSeconds() + solids_.deviceSeconds();
}

/// The frame's tree stays on the device from light to light; others are gone when the call is over.
std::vector<float> DeviceShadows::sums(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                       const LightingOptions& options, std::span<const std::uint8_t> reached,
                                       const RaysDone& done) {
  grid_.release();
  const bool lasts = &tree == &frame_.density.tree();
  if (!lasts || !holdsFrame_) light_.setTree(tree);  // into what is left
  holdsFrame_ = lasts;
  return light_.opticalDepths(receivers, light, options, reached, done);
}

}  // namespace mote
