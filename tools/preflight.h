// What a run of a scene will take and what is wrong with it, found out before any work: `mote info SCENE` and
// `mote render --dry-run`.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/scene/scene.h"
#include "tools/command.h"

namespace mote {

/// The object that --json prints: what the scene holds (describeScene) and
///   missing     sentences: files that are not there, frames of sequences among them. With any, nothing is measured.
///   suspicious  sentences: what is allowed and yet seldom meant. Velocities of a hundred radii a frame, radii larger
///               than the box of the particles, a medium that is too thin to be seen or opaque, a camera that sees no
///               particle, no light at all.
///   estimate    host_bytes and device_bytes of the frame with most particles, rays; measured_frame; seconds of its
///               stages (load, octree, lighting, draw, write), of it (frame) and of the run (all)
/// One frame, that of the largest files, is loaded, its octree built, and samples of it lit, drawn and written to a
/// temporary file on the backends that the scene names: for a million particles it takes about as long as the frame,
/// for more a smaller part of it. Exact light is overestimated, up to twofold. Frames with larger or smaller files
/// count by their size. Not `measured`: only what headers tell. Throws InputError where a file is damaged,
/// MachineError.
nlohmann::ordered_json preflight(const Scene& scene, const CommonOptions& common, bool measured = true);
void printPreflight(const nlohmann::ordered_json& found);

/// Throws InputError with all of "missing", if there is any.
void requireNothingMissing(const nlohmann::ordered_json& found);

}  // namespace mote
