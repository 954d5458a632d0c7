// What a contender is: something that gives each particle's optical depth toward a light.
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace mote {

struct Peer {
  std::string name;
  /// Optical depth of every slot of the octree toward the light, before shadowDensity. Timed.
  std::function<std::vector<float>()> opticalDepths;
  /// What serves every light and is done once: a tree, a grid. Timed apart, as the octree's build is; may be empty.
  std::function<void()> prepare = {};
};

}  // namespace mote
