// The push constants of one drawing of splat.vert, .geom and .frag.
#ifndef MOTE_LAYOUT_SPLAT_PARAMS_H
#define MOTE_LAYOUT_SPLAT_PARAMS_H
#include "splat.h"

MOTE_LAYOUT_BEGIN
struct SplatParams {
  MOTE_ADDRESS(SplatParticleBuffer) particles;  // point k of the drawing is particles[index k]
  SplatCamera camera;
  uint pad;  // keeps the size a multiple of 8
};
MOTE_ASSERT_OFFSET(SplatParams, particles, 0);
MOTE_ASSERT_OFFSET(SplatParams, camera, 8);
MOTE_ASSERT_SIZE(SplatParams, 112);
MOTE_LAYOUT_END

#endif
