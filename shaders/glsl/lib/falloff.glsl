// Falloff of the optical depth (DESIGN §2): F(q) = W(b) / W(0) with q = b² / r² in [0, 1).
// C++ twin: falloff() in host/splat/footprint.h, operation by operation.
#ifndef MOTE_LIB_FALLOFF_GLSL
#define MOTE_LIB_FALLOFF_GLSL
#include "../layout/medium.h"

float falloff(float q, uint kind) {
  if (kind == kFalloffLinear) return 1.0 - sqrt(q);
  if (kind == kFalloffSphere) return sqrt(1.0 - q);
  return (1.0 - q) * (1.0 - q);
}

#endif
