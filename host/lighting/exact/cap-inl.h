// The share of a particle before a point (host/core/cap.h) on vectors, for files that are compiled once for each
// instruction set.
#if defined(MOTE_LIGHTING_EXACT_CAP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MOTE_LIGHTING_EXACT_CAP_INL_H
#undef MOTE_LIGHTING_EXACT_CAP_INL_H
#else
#define MOTE_LIGHTING_EXACT_CAP_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class D, class V>
HWY_INLINE V capOf(D d, V t, V halfChord) {
  const auto set = [d](float x) { return hn::Set(d, x); };
  const V x = hn::Min(hn::Max(hn::Div(t, hn::Max(halfChord, set(1e-30f))), set(-1.0f)), set(1.0f));
  return hn::Add(set(0.5f), hn::Mul(x, hn::Sub(set(0.75f), hn::Mul(set(0.25f), hn::Mul(x, x)))));
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
