// Each peer against the exact optical depths, with so much detail that little but its principle is left.
#pragma once
#include "host/lighting/lighting.h"

namespace mote {

/// Lights a small cloud by a point and by a directional light, prints a line for each peer; true if all agree. Some
/// seconds.
bool checkPeers(const LightingOptions& options);

}  // namespace mote
