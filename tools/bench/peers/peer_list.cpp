#include "tools/bench/peers/peer_list.h"

#include <fmt/format.h>

namespace mote {

Peer fourierPeer(const Task& task, const FourierMapOptions& options) {
  return {.name = fmt::format("Fourier opacity map {}², {} harmonics{}", options.size, options.harmonics,
                              options.thick ? ", chords" : ""),
          .opticalDepths = [task, options] { return fourierMapDepths(task.tree, task.light, options); }};
}

Peer spherePeer(const Task& task, SphereHits::Rays rays) {
  const auto spheres = std::make_shared<SphereHits>(task.tree);
  return {.name = rays == SphereHits::Rays::Single ? "Embree spheres, single rays" : "Embree spheres, packets of 16",
          .opticalDepths = [task, spheres, rays] { return spheres->opticalDepths(task.light, task.options, rays); },
          .prepare = [spheres] { spheres->build(); }};
}

Peer gridPeer(const Task& task, const DensityGridOptions& options) {
  const auto grid = std::make_shared<DensityGrid>(task.tree, options);
  return {.name = fmt::format("OpenVDB {}³, steps of {} voxels", options.size, options.step),
          .opticalDepths = [task, grid] { return grid->opticalDepths(task.light, task.options); },
          .prepare = [grid] { grid->build(); }};
}

}  // namespace mote
