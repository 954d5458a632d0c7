// Falloff of the optical depth (DESIGN §2): F(q) = W(b) / W(0), q = b² / r² ≥ 0; 0 for q ≥ 1.
// C++ twin: host/core/falloff.h, operation by operation.
#ifndef MOTE_LIB_FALLOFF_GLSL
#define MOTE_LIB_FALLOFF_GLSL
#include "../layout/medium.h"

float falloff(float q, uint kind) {
  if (kind == kFalloffLinear) return max(1.0 - sqrt(q), 0.0);
  const float u = max(1.0 - q, 0.0);
  return kind == kFalloffSphere ? sqrt(u) : u * u;
}

#endif
