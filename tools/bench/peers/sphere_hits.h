// Exact optical depths by a ray tracer: Embree 3 over spheres, with a filter that takes every hit and lets the ray go
// on.
#pragma once
#include <memory>
#include <vector>

#include "host/lighting/lighting.h"

namespace mote {

class SphereHits {
 public:
  /// 16: packets of Morton neighbours; 1: rays one by one.
  enum class Rays { Single = 1, Packets = 16 };

  /// Of a tree with one channel, which must live as long. Throws MachineError where Embree refuses.
  explicit SphereHits(const Octree& tree);
  ~SphereHits();

  /// The tree's slots as spheres in Embree's own hierarchy, built on TBB.
  void build();
  /// As mote::opticalDepths with falloff smooth and soft ends: a ball counts where the ray leaves it, with the share
  /// that lies between particle and light, and the ray ends beyond the cutoff. After build().
  std::vector<float> opticalDepths(const layout::Light& light, const LightingOptions& options, Rays rays) const;

 private:
  struct Scene;
  const Octree& tree_;
  std::unique_ptr<Scene> scene_;
};

}  // namespace mote
