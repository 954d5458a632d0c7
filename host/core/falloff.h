// Falloff of a particle's optical depth (DESIGN §2), in single precision as every kernel computes it, for lighting and
// for the view. The GLSL twin is shaders/glsl/lib/falloff.glsl.
#pragma once
#include <algorithm>
#include <cmath>

#include "shaders/glsl/layout/medium.h"

namespace mote {

/// F(q) = W(b) / W(0), q = b²/r² ≥ 0; 0 for q ≥ 1.
template <layout::uint kFalloff>
inline float falloff(float q) {
  if constexpr (kFalloff == layout::kFalloffLinear) return std::max(1.0f - std::sqrt(q), 0.0f);
  const float u = std::max(1.0f - q, 0.0f);
  if constexpr (kFalloff == layout::kFalloffSphere) return std::sqrt(u);
  return u * u;
}

/// The same for a kind known at run time.
inline float falloff(float q, layout::uint kind) {
  if (kind == layout::kFalloffLinear) return falloff<layout::kFalloffLinear>(q);
  if (kind == layout::kFalloffSphere) return falloff<layout::kFalloffSphere>(q);
  return falloff<layout::kFalloffSmooth>(q);
}

}  // namespace mote
