// The particles of one source on their way into the scene.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "host/particles/file_units.h"
#include "host/particles/particle_set.h"
#include "host/scene/scene.h"

namespace mote {

struct LoadedSource {
  ParticleSet set;
  std::string place;  ///< what messages about them start with: the file's path, or where the source stands
  bool hasColor = false;
  std::size_t count = 0;             ///< particles of the file, those that were left out included
  std::vector<std::uint64_t> index;  ///< which of them each particle is; empty: none was left out
  FileUnits units;
  dvec3 centre{0};  ///< what the set's positions are measured from, in the file's units; once moved, in the scene's
};

/// Where a source stands in the scene, for messages.
inline std::string scenePlace(const ParticleSource& source) {
  return source.pointer.empty() ? "particles" : source.pointer;
}

}  // namespace mote
