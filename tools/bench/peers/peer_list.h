// The contenders, by name.
#pragma once
#include "host/lighting/lighting.h"
#include "tools/bench/peers/density_grid.h"
#include "tools/bench/peers/fourier_map.h"
#include "tools/bench/peers/peer.h"
#include "tools/bench/peers/sphere_hits.h"

namespace mote {

/// What they all light. The tree must live as long as the peers.
struct Task {
  const Octree& tree;
  layout::Light light;
  LightingOptions options;
};

Peer fourierPeer(const Task& task, const FourierMapOptions& options);
Peer spherePeer(const Task& task, SphereHits::Rays rays);
Peer gridPeer(const Task& task, const DensityGridOptions& options);

}  // namespace mote
