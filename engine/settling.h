// What a scene leaves open, settled by its whole shot: a part of it, or one frame alone, is then what it is among all.
#pragma once
#include <optional>

#include "host/scene/scene.h"

namespace mote {

/// Whether particles must say what the scene does not: where a fitted camera stands, the default light, the density of
/// an optical depth, an "auto" sub-sample. (The origin is theirs too; where it is not 0, see Batch in tools/batch.cpp.)
bool leavesOpen(const Scene& scene);

/// Settles that by the first frame of the shot (Scene::wholeShot) that can be read, and returns its
/// number. Frames from `before` on, if given, are not tried: the frame that is drawn next settles what is open itself.
/// None: nothing was open, or no frame could be read. Loads one frame; its warnings are dropped. Throws MachineError.
std::optional<int> settleByShot(Scene& scene, std::optional<int> before = {});

}  // namespace mote
