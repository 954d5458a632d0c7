// Which frames of a run need no work, because their pictures are there.
#pragma once
#include <string>

#include "engine/stats.h"
#include "host/scene/scene.h"

namespace mote {

/// SHA-256 of everything but the input files that a picture may depend on: the program's version, the scene with all
/// flags applied, where it is computed, and the frame that settles what the scene leaves open (the run's first).
std::string settingsOf(const Scene& scene, const RunStats& run);

/// Whether the picture at `path` is whole, was made with these settings, and from files that have not changed since.
bool isRendered(const std::string& path, const Scene& scene, int frame, const std::string& settings);

}  // namespace mote
