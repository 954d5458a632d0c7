// The choice of a kernel by the medium's rules (DESIGN §2).
#pragma once
#include "host/core/cap.h"
#include "host/core/error.h"
#include "host/core/falloff.h"
#include "shaders/glsl/layout/medium.h"

namespace mote {

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
