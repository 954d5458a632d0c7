// Which frames of a run need no work, because their pictures are there.
#pragma once
#include <string>

#include "engine/stats.h"
#include "host/scene/scene.h"

namespace mote {

/// SHA-256 of everything but the input files that a picture may depend on: the program's version, the scene with all
/// flags applied. Which frames a run draws is no part of it, nor what "auto" came to: another machine may go on.
std::string settingsOf(const Scene& scene);

/// Whether the picture at `path` is whole, was made with the run's settings, what the scene leaves open settled by the
/// same frame (RunStats::settledBy), and from files that have not changed since.
bool isRendered(const std::string& path, const Scene& scene, int frame, const RunStats& run);

}  // namespace mote
