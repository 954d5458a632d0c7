// The scene of the benchmarks that draw whole frames, and what two backends' pictures of it are held to.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "engine/stats.h"
#include "host/image/image.h"
#include "host/scene/scene.h"
#include "tools/bench/bench.h"

namespace mote {

/// `source` is one entry of a scene's "particles". One point light outside of the cloud (benchLight), exact light,
/// everything else as a scene's defaults: mean optical depth 4, camera fitted.
Scene benchScene(const nlohmann::json& source, ivec2 size);

/// The noise cloud of mote generate, seed 0, made in memory, as an entry of "particles".
nlohmann::json benchCloudSource(std::uint64_t count);

/// A picture's size with `share` of its pixels, in the same proportions; at least one pixel, never more than `full`.
ivec2 scaledSize(ivec2 full, double share);

/// The GPU's own seconds of a stage beside the wall clock's, as "device_lighting" and so on.
void addDeviceClock(FrameStats& stats);

/// By the limits of mote crosscheck.
BenchCheck samePicture(const Image& host, const Image& device);

/// The picture holds something, and nothing that is not finite.
BenchCheck plausible(const Image& image);

}  // namespace mote
