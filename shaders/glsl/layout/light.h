// A light as the host and the compute shader see it, and the parameters of one lighting dispatch.
#ifndef MOTE_LAYOUT_LIGHT_H
#define MOTE_LAYOUT_LIGHT_H
#include "medium.h"
#include "node.h"
#include "types.h"

MOTE_LAYOUT_BEGIN
MOTE_CONST uint kLightPoint = 0u;
MOTE_CONST uint kLightDirectional = 1u;
MOTE_CONST uint kLightSpot = 2u;  // a point light that shines into a cone; its rays are those of a point light

struct Light {
  vec3 position;        // point, spot: where it is [scene units]
  uint type;            // kLightPoint | kLightDirectional | kLightSpot
  vec3 direction;       // directional: unit vector of travel, from the light into the scene; spot: the cone's axis
  float decay;          // point, spot: exponent n of 1 / dⁿ, 0–2
  vec3 power;           // RGB: point, spot: radiant intensity [W/sr]; directional: irradiance [W/m²]
  float shadowDensity;  // factor on the optical depth that casts its shadow, ≥ 0
  uint castsShadows;    // 0: its light reaches everything
  float cosInner;       // spot: cosine of the half angle up to which it is at full strength …
  float cosOuter;       // … and of the one beyond which there is nothing, ≤ cosInner
};
MOTE_ASSERT_OFFSET(Light, position, 0);
MOTE_ASSERT_OFFSET(Light, type, 12);
MOTE_ASSERT_OFFSET(Light, direction, 16);
MOTE_ASSERT_OFFSET(Light, decay, 28);
MOTE_ASSERT_OFFSET(Light, power, 32);
MOTE_ASSERT_OFFSET(Light, shadowDensity, 44);
MOTE_ASSERT_OFFSET(Light, castsShadows, 48);
MOTE_ASSERT_OFFSET(Light, cosInner, 52);
MOTE_ASSERT_OFFSET(Light, cosOuter, 56);
MOTE_ASSERT_SIZE(Light, 60);

// One dispatch of light.comp: rays [firstRay, firstRay + rayCount) of `order` toward one light.
struct LightParams {
  MOTE_ADDRESS(NodeBuffer) nodes;           // nodeCount nodes and the sentinel
  MOTE_ADDRESS(Vec4Buffer) particles;       // slot order: x, y, z, support radius [scene units]
  MOTE_ADDRESS(FloatBuffer) peaks;          // slot order: optical depth through the centre (of red, where they differ)
  MOTE_ADDRESS(FloatBuffer) peaksGreen;     // … of green and of blue; 0 where one sum serves all colours
  MOTE_ADDRESS(FloatBuffer) peaksBlue;
  MOTE_ADDRESS(Vec4Buffer) origins;         // receivers: x, y, z [scene units]
  MOTE_ADDRESS(UintBuffer) selves;          // the slot that each receiver leaves out; 0: receiver k leaves out slot k
  MOTE_ADDRESS(UintBuffer) order;           // the receiver at which each ray starts; neighbours lie behind one another
  MOTE_ADDRESS(FloatBuffer) opticalDepths;  // out, [channel][receiver]: Σ τ before shadowDensity
  vec3 lightPosition;                       // [scene units]
  uint lightType;                           // a spot's rays are a point light's
  vec3 lightDirection;                      // unit vector of travel
  float opticalDepthLimit;                  // rays may stop beyond it: −ln(cutoff) / shadowDensity; +∞ for cutoff 0
  uint nodeCount;
  uint firstRay;
  uint rayCount;
  float boxSlack;                           // boxes grow by this against rounding [scene units]
  uint receiverCount;
  uint pad;                                 // keeps the size a multiple of 8
};
MOTE_ASSERT_OFFSET(LightParams, nodes, 0);
MOTE_ASSERT_OFFSET(LightParams, particles, 8);
MOTE_ASSERT_OFFSET(LightParams, peaks, 16);
MOTE_ASSERT_OFFSET(LightParams, peaksGreen, 24);
MOTE_ASSERT_OFFSET(LightParams, peaksBlue, 32);
MOTE_ASSERT_OFFSET(LightParams, origins, 40);
MOTE_ASSERT_OFFSET(LightParams, selves, 48);
MOTE_ASSERT_OFFSET(LightParams, order, 56);
MOTE_ASSERT_OFFSET(LightParams, opticalDepths, 64);
MOTE_ASSERT_OFFSET(LightParams, lightPosition, 72);
MOTE_ASSERT_OFFSET(LightParams, lightType, 84);
MOTE_ASSERT_OFFSET(LightParams, lightDirection, 88);
MOTE_ASSERT_OFFSET(LightParams, opticalDepthLimit, 100);
MOTE_ASSERT_OFFSET(LightParams, nodeCount, 104);
MOTE_ASSERT_OFFSET(LightParams, firstRay, 108);
MOTE_ASSERT_OFFSET(LightParams, rayCount, 112);
MOTE_ASSERT_OFFSET(LightParams, boxSlack, 116);
MOTE_ASSERT_OFFSET(LightParams, receiverCount, 120);
MOTE_ASSERT_SIZE(LightParams, 128);
MOTE_LAYOUT_END

#endif
