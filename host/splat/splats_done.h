// How a rasteriser says how far it is.
#pragma once
#include <functional>

namespace mote {

/// Called from any thread with how many splats have been drawn since, in fractions: a splat is done tile by tile. They
/// sum up to all that were to be drawn, but for rounding.
using SplatsDone = std::function<void(double)>;

}  // namespace mote
