// What the splat pass and the reference rasteriser read: particles ready to draw, and the camera (DESIGN §2, view).
//
// Camera space: origin at the camera, x right, y up, z forward (the depth), a rigid transform of scene space. The pixel
// ray through the image-plane point (u, v) has the direction (u, v, 1). With d the particle's centre in camera space and
// (u0, v0) = d.xy / d.z its image, the ray at (u0 + δx, v0 + δy) passes the centre at the distance b,
//   b² = |d × (δx, δy, 0)|² / |(u0 + δx, v0 + δy, 1)|²,
// which is exact for any field of view and keeps its digits for particles much smaller than their distance.
#ifndef MOTE_LAYOUT_SPLAT_H
#define MOTE_LAYOUT_SPLAT_H
#include "medium.h"
#include "types.h"

MOTE_LAYOUT_BEGIN
struct SplatParticle {
  vec3 position;  // [scene units]
  float radius;   // support radius for the view [scene units]
  vec3 radiance;  // RGB source radiance: albedo × in-scattered radiance [W/(m² sr)]
  float peak;     // optical depth through the centre
};
MOTE_BUFFER(SplatParticleBuffer, SplatParticle)
MOTE_ASSERT_OFFSET(SplatParticle, position, 0);
MOTE_ASSERT_OFFSET(SplatParticle, radius, 12);
MOTE_ASSERT_OFFSET(SplatParticle, radiance, 16);
MOTE_ASSERT_OFFSET(SplatParticle, peak, 28);
MOTE_ASSERT_SIZE(SplatParticle, 32);

struct SplatCamera {
  vec3 right;       // unit vectors of camera space, in scene space
  float near;       // particles whose centre has a depth below are not drawn [scene units]
  vec3 up;
  float far;        // … and above
  vec3 forward;
  float pixelSize;  // height of a pixel on the image plane: (2·tan(fov/2)) / height at depth 1; orthographic [scene units]
  vec3 position;    // [scene units]
  uint falloff;     // kFalloff…
  vec2 halfExtent;  // half width and half height of the picture on the image plane at depth 1
  vec2 imageSize;   // [pixels]
  float minRadius;  // smallest splat radius [pixels]; below it the splat is stretched and its α scaled (opacity kept)
  float pixelAspect;    // width / height of a pixel
  uint orthographic;    // 1: rays are parallel, and the image plane's unit is the scene's
  float apertureRadius; // of the lens [scene units]; 0: everything is sharp
  float focusDistance;  // depth that is sharp [scene units], > 0
};
MOTE_ASSERT_OFFSET(SplatCamera, right, 0);
MOTE_ASSERT_OFFSET(SplatCamera, near, 12);
MOTE_ASSERT_OFFSET(SplatCamera, up, 16);
MOTE_ASSERT_OFFSET(SplatCamera, far, 28);
MOTE_ASSERT_OFFSET(SplatCamera, forward, 32);
MOTE_ASSERT_OFFSET(SplatCamera, pixelSize, 44);
MOTE_ASSERT_OFFSET(SplatCamera, position, 48);
MOTE_ASSERT_OFFSET(SplatCamera, falloff, 60);
MOTE_ASSERT_OFFSET(SplatCamera, halfExtent, 64);
MOTE_ASSERT_OFFSET(SplatCamera, imageSize, 72);
MOTE_ASSERT_OFFSET(SplatCamera, minRadius, 80);
MOTE_ASSERT_OFFSET(SplatCamera, pixelAspect, 84);
MOTE_ASSERT_OFFSET(SplatCamera, orthographic, 88);
MOTE_ASSERT_OFFSET(SplatCamera, apertureRadius, 92);
MOTE_ASSERT_OFFSET(SplatCamera, focusDistance, 96);
MOTE_ASSERT_SIZE(SplatCamera, 100);
MOTE_LAYOUT_END

#endif
