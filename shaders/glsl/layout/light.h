// A light as the host and the compute shader see it, and the parameters of one lighting dispatch.
#ifndef MOTE_LAYOUT_LIGHT_H
#define MOTE_LAYOUT_LIGHT_H
#include "medium.h"
#include "node.h"
#include "types.h"

MOTE_LAYOUT_BEGIN
MOTE_CONST uint kLightPoint = 0u;
MOTE_CONST uint kLightDirectional = 1u;

struct Light {
  vec3 position;        // point: where it is [scene units]
  uint type;            // kLightPoint | kLightDirectional
  vec3 direction;       // directional: unit vector of travel, from the light into the scene
  float decay;          // point: exponent n of 1 / dⁿ, 0–2
  vec3 power;           // RGB: point: radiant intensity [W/sr]; directional: irradiance [W/m²]
  float shadowDensity;  // factor on the optical depth that casts its shadow, ≥ 0
  uint castsShadows;    // 0: its light reaches everything
};
MOTE_ASSERT_OFFSET(Light, position, 0);
MOTE_ASSERT_OFFSET(Light, type, 12);
MOTE_ASSERT_OFFSET(Light, direction, 16);
MOTE_ASSERT_OFFSET(Light, decay, 28);
MOTE_ASSERT_OFFSET(Light, power, 32);
MOTE_ASSERT_OFFSET(Light, shadowDensity, 44);
MOTE_ASSERT_OFFSET(Light, castsShadows, 48);
MOTE_ASSERT_SIZE(Light, 52);

// One dispatch of light.comp: rays [firstRay, firstRay + rayCount) of `order` toward one light.
struct LightParams {
  MOTE_ADDRESS(NodeBuffer) nodes;           // nodeCount nodes and the sentinel
  MOTE_ADDRESS(Vec4Buffer) particles;       // slot order: x, y, z, support radius [scene units]
  MOTE_ADDRESS(FloatBuffer) peaks;          // slot order: optical depth through the centre
  MOTE_ADDRESS(UintBuffer) order;           // the slot at which each ray starts; neighbours lie behind one another
  MOTE_ADDRESS(FloatBuffer) opticalDepths;  // out, slot order: Σ τ before shadowDensity
  vec3 lightPosition;                       // [scene units]
  uint lightType;
  vec3 lightDirection;                      // unit vector of travel
  float opticalDepthLimit;                  // rays may stop beyond it: −ln(cutoff) / shadowDensity; +∞ for cutoff 0
  uint nodeCount;
  uint firstRay;
  uint rayCount;
  float boxSlack;                           // boxes grow by this against rounding [scene units]
};
MOTE_ASSERT_OFFSET(LightParams, nodes, 0);
MOTE_ASSERT_OFFSET(LightParams, particles, 8);
MOTE_ASSERT_OFFSET(LightParams, peaks, 16);
MOTE_ASSERT_OFFSET(LightParams, order, 24);
MOTE_ASSERT_OFFSET(LightParams, opticalDepths, 32);
MOTE_ASSERT_OFFSET(LightParams, lightPosition, 40);
MOTE_ASSERT_OFFSET(LightParams, lightType, 52);
MOTE_ASSERT_OFFSET(LightParams, lightDirection, 56);
MOTE_ASSERT_OFFSET(LightParams, opticalDepthLimit, 68);
MOTE_ASSERT_OFFSET(LightParams, nodeCount, 72);
MOTE_ASSERT_OFFSET(LightParams, firstRay, 76);
MOTE_ASSERT_OFFSET(LightParams, rayCount, 80);
MOTE_ASSERT_OFFSET(LightParams, boxSlack, 84);
MOTE_ASSERT_SIZE(LightParams, 88);
MOTE_LAYOUT_END

#endif
