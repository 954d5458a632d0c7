// Triangles of solids in the order of their tree, and the parameters of one dispatch of shadow rays (thesis §4.4).
#ifndef MOTE_LAYOUT_SOLID_H
#define MOTE_LAYOUT_SOLID_H
#include "light.h"
#include "node.h"
#include "types.h"

MOTE_LAYOUT_BEGIN
// Both sides count. Triangles that share an edge hold bit-equal corners: what keeps the walk watertight.
struct Triangle {
  vec3 a;  // corners [scene units]
  vec3 b;
  vec3 c;
};
MOTE_BUFFER(TriangleBuffer, Triangle)
MOTE_ASSERT_OFFSET(Triangle, a, 0);
MOTE_ASSERT_OFFSET(Triangle, b, 12);
MOTE_ASSERT_OFFSET(Triangle, c, 24);
MOTE_ASSERT_SIZE(Triangle, 36);

// One dispatch of solid_shadow.comp: is there a triangle between each point and the light?
struct SolidShadowParams {
  MOTE_ADDRESS(NodeBuffer) nodes;          // nodeCount nodes and the sentinel; a node's "particles" are triangles
  MOTE_ADDRESS(TriangleBuffer) triangles;  // in leaf order
  MOTE_ADDRESS(FloatBuffer) x;             // rayCount origins [scene units]
  MOTE_ADDRESS(FloatBuffer) y;
  MOTE_ADDRESS(FloatBuffer) z;
  MOTE_ADDRESS(UintBuffer) occluded;       // out: 1 behind a triangle, else 0
  vec3 lightPosition;                      // not read for a directional light
  uint lightType;                          // kLightDirectional, anything else is a point
  vec3 lightDirection;                     // directional: unit vector of travel
  uint nodeCount;
  uint rayCount;
  uint pad;  // keeps the size a multiple of 8
};
MOTE_ASSERT_OFFSET(SolidShadowParams, nodes, 0);
MOTE_ASSERT_OFFSET(SolidShadowParams, triangles, 8);
MOTE_ASSERT_OFFSET(SolidShadowParams, x, 16);
MOTE_ASSERT_OFFSET(SolidShadowParams, y, 24);
MOTE_ASSERT_OFFSET(SolidShadowParams, z, 32);
MOTE_ASSERT_OFFSET(SolidShadowParams, occluded, 40);
MOTE_ASSERT_OFFSET(SolidShadowParams, lightPosition, 48);
MOTE_ASSERT_OFFSET(SolidShadowParams, lightType, 60);
MOTE_ASSERT_OFFSET(SolidShadowParams, lightDirection, 64);
MOTE_ASSERT_OFFSET(SolidShadowParams, nodeCount, 76);
MOTE_ASSERT_OFFSET(SolidShadowParams, rayCount, 80);
MOTE_ASSERT_SIZE(SolidShadowParams, 88);
MOTE_LAYOUT_END

#endif
