// What the full splats read: those of a lens, a shutter, colours with different extinction, emission, sprites, surfaces.
//
// A splat is a profile around the path of its centre over the image plane. With image points (u, v) on the plane at
// depth 1 (orthographic: in scene units), the pixel's at and the centre's m + s·h for s in [−1, 1],
//   q(s) = scale² · (|at − m − s·h|² + ε·((m + s·h) × at)²) / (1 + ε·|at|²)
// is the squared distance of pixel ray and centre in units of the support's radius R; ε = 1, orthographic 0.
#ifndef MOTE_LAYOUT_SPLAT_SCENE_H
#define MOTE_LAYOUT_SPLAT_SCENE_H
#include "splat.h"

MOTE_LAYOUT_BEGIN
MOTE_BUFFER(Vec3Buffer, vec3)

MOTE_CONST float kPixelLeftOut = -1.0f;  // in place of a surface's depth: nothing is drawn at this pixel

struct SplatScene {
  MOTE_ADDRESS(SplatParticleBuffer) particles;
  MOTE_ADDRESS(Vec3Buffer) extinction;     // factor on the optical depth of each colour; 0: 1 for all
  MOTE_ADDRESS(Vec3Buffer) emission;       // radiance at the centre of a particle without extinction; 0: none
  MOTE_ADDRESS(Vec3Buffer) velocity;       // [scene units / s]; 0: at rest
  MOTE_ADDRESS(FloatBuffer) solidDepth;    // of each pixel, row by row: depth of an opaque surface; 0: none
  MOTE_ADDRESS(Vec4Buffer) spriteColor;    // rows from the top; 0: white
  MOTE_ADDRESS(FloatBuffer) spriteOpacity;  // rows from the top; 0: 1
  SplatCamera camera;                      // at the frame's time: depths, sizes, lens
  SplatCamera open, close;                 // when the shutter opens and closes; both `camera` without motion blur
  SplatCamera before, after;               // half a frame before and after: the velocity layer
  float openTime, closeTime;               // of the shutter, relative to the frame [s]
  float halfFrame;                         // half of a frame's duration [s]
  uint moving;                             // 1: there is motion blur
  uint spriteColorWidth, spriteColorHeight;
  uint spriteOpacityWidth, spriteOpacityHeight;
};
MOTE_BUFFER(SplatSceneBuffer, SplatScene)
MOTE_ASSERT_OFFSET(SplatScene, particles, 0);
MOTE_ASSERT_OFFSET(SplatScene, extinction, 8);
MOTE_ASSERT_OFFSET(SplatScene, emission, 16);
MOTE_ASSERT_OFFSET(SplatScene, velocity, 24);
MOTE_ASSERT_OFFSET(SplatScene, solidDepth, 32);
MOTE_ASSERT_OFFSET(SplatScene, spriteColor, 40);
MOTE_ASSERT_OFFSET(SplatScene, spriteOpacity, 48);
MOTE_ASSERT_OFFSET(SplatScene, camera, 56);
MOTE_ASSERT_OFFSET(SplatScene, open, 156);
MOTE_ASSERT_OFFSET(SplatScene, close, 256);
MOTE_ASSERT_OFFSET(SplatScene, before, 356);
MOTE_ASSERT_OFFSET(SplatScene, after, 456);
MOTE_ASSERT_OFFSET(SplatScene, openTime, 556);
MOTE_ASSERT_OFFSET(SplatScene, closeTime, 560);
MOTE_ASSERT_OFFSET(SplatScene, halfFrame, 564);
MOTE_ASSERT_OFFSET(SplatScene, moving, 568);
MOTE_ASSERT_OFFSET(SplatScene, spriteColorWidth, 572);
MOTE_ASSERT_OFFSET(SplatScene, spriteColorHeight, 576);
MOTE_ASSERT_OFFSET(SplatScene, spriteOpacityWidth, 580);
MOTE_ASSERT_OFFSET(SplatScene, spriteOpacityHeight, 584);
MOTE_ASSERT_SIZE(SplatScene, 592);

// The push constants of one drawing of splat_full.vert, .geom, .frag or splat_layers.frag.
struct SplatFullParams {
  MOTE_ADDRESS(SplatSceneBuffer) scene;  // one
  uint alphaOnly;                        // 1: draws each colour's opacity instead of its radiance
  uint pad;                              // keeps the size a multiple of 8
};
MOTE_ASSERT_OFFSET(SplatFullParams, scene, 0);
MOTE_ASSERT_OFFSET(SplatFullParams, alphaOnly, 8);
MOTE_ASSERT_SIZE(SplatFullParams, 16);
MOTE_LAYOUT_END

#endif
