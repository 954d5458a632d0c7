// The share of a particle that lies before a ray's end, and the choice of a kernel by the medium's rules (DESIGN §2).
#pragma once
#include <algorithm>
#include <cmath>

#include "host/core/error.h"
#include "host/core/falloff.h"
#include "shaders/glsl/layout/medium.h"

namespace mote {

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
