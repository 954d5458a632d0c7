// The falloff F(q) on vectors (host/core/falloff.h), for files that are compiled once for each instruction set.
#if defined(MOTE_LIGHTING_FALLOFF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MOTE_LIGHTING_FALLOFF_INL_H
#undef MOTE_LIGHTING_FALLOFF_INL_H
#else
#define MOTE_LIGHTING_FALLOFF_INL_H
#endif

#include <hwy/highway.h>

#include "shaders/glsl/layout/medium.h"

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// q ≥ 0; 0 from q = 1 on.
template <layout::uint kFalloff, class D, class V>
HWY_INLINE V falloffOf(D d, V q) {
  const V one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  if constexpr (kFalloff == layout::kFalloffLinear) {
    return hn::Max(hn::Sub(one, hn::Sqrt(q)), zero);
  } else {
    const V u = hn::Max(hn::Sub(one, q), zero);
    if constexpr (kFalloff == layout::kFalloffSphere)
      return hn::Sqrt(u);
    else
      return hn::Mul(u, u);
  }
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
