// Falloff and end cap of a particle's optical depth (DESIGN §2), in single precision as all kernels compute them.
// The GLSL twin is shaders/glsl/lib/falloff.glsl.
#pragma once
#include <algorithm>
#include <cmath>

#include "host/core/error.h"
#include "shaders/glsl/layout/medium.h"

namespace mote {

/// F(q), q = b²/r² ≥ 0; 0 for q ≥ 1.
template <layout::uint kFalloff>
inline float falloff(float q) {
  if constexpr (kFalloff == layout::kFalloffLinear) return std::max(1.0f - std::sqrt(q), 0.0f);
  const float u = std::max(1.0f - q, 0.0f);
  if constexpr (kFalloff == layout::kFalloffSphere) return std::sqrt(u);
  return u * u;
}

/// Share of a particle with half chord c that lies on the positive side of a point at distance t before its middle:
/// 0 for t ≤ −c, ½ + ¾x − ¼x³ with x = t/c, 1 for t ≥ c.
inline float cap(float t, float halfChord) {
  // The least half chord keeps 0/0 away; a support that is only grazed weighs nothing anyway.
  const float x = std::min(std::max(t / std::max(halfChord, 1e-30f), -1.0f), 1.0f);
  return 0.5f + x * (0.75f - 0.25f * (x * x));
}

/// Calls rule.template operator()<falloff, endpoint>() with run-time codes as compile-time constants.
template <class Rule>
void withRule(layout::uint falloffCode, layout::uint endpointCode, const Rule& rule) {
  using namespace layout;
  const auto withEndpoint = [&]<layout::uint kFalloff>() {
    if (endpointCode == kEndpointClamp)
      rule.template operator()<kFalloff, kEndpointClamp>();
    else
      rule.template operator()<kFalloff, kEndpointSoft>();
  };
  switch (falloffCode) {
    case kFalloffLinear: return withEndpoint.template operator()<kFalloffLinear>();
    case kFalloffSphere: return withEndpoint.template operator()<kFalloffSphere>();
    default: MOTE_CHECK(falloffCode, ==, kFalloffSmooth); return withEndpoint.template operator()<kFalloffSmooth>();
  }
}

}  // namespace mote
