// The frames of a run, one after another, to EXR pictures and PNG previews.
#pragma once
#include <optional>
#include <string>

#include "engine/renderer.h"
#include "engine/stats.h"
#include "host/scene/scene.h"

namespace mote {

struct BatchOptions {
  std::string preview;            ///< pattern of the PNGs; empty: none
  std::optional<float> exposure;  ///< of the previews [stops]; none: each by itself (autoExposure)
  bool resume = false;            ///< leave out the frames that isRendered finds whole
  bool stopOnError = false;       ///< throw what the first frame that fails throws
  bool ahead = true;              ///< a frame's files load while the one before is drawn
};

/// Draws scene.frames in their order and notes in `run` which were written, failed, or left out. A frame alone has the
/// bytes that it has among all of the shot: what the scene leaves open is settled as settling.h says. Returns 0, or the
/// exit code of the worst that failed; where there is but one frame, what it throws is thrown.
int renderBatch(Scene& scene, const BatchOptions& options, Renderer& renderer, RunStats& run);

}  // namespace mote
