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

// One column of rays (host/lighting/exact/column.h) as light_gather.comp takes it. Particles are placed from `middle`, a
// point on the axis amid the tree, so that what is computed is short; …Low is what rounding to float left.
struct LightColumn {
  vec3 planeOrigin;       // what the planes are relative to [scene units]
  float depthBase;        // depths are the distances from the light (directional: along the travel) less this
  vec3 middle;            // [scene units]
  float depthBaseLow;
  vec3 u;                 // the frame: unit, orthogonal; the axis is the way of the light
  float middleU;          // where `middle` lies in it
  vec3 v;
  float middleV;
  vec3 axis;
  float middleZ;
  vec3 uLow;
  float middleULow;
  vec3 vLow;
  float middleVLow;
  vec3 axisLow;
  float middleZLow;
  float boxU;             // the beams' rectangle, in steps of a 255th: its corner, …
  float boxV;
  float boxScaleU;        // … steps a unit …
  float boxScaleV;
  float boxExtent;        // … and the factor on a particle's extents with which it covers all that it may touch
};
MOTE_BUFFER(LightColumnBuffer, LightColumn)
MOTE_ASSERT_OFFSET(LightColumn, planeOrigin, 0);
MOTE_ASSERT_OFFSET(LightColumn, depthBase, 12);
MOTE_ASSERT_OFFSET(LightColumn, middle, 16);
MOTE_ASSERT_OFFSET(LightColumn, depthBaseLow, 28);
MOTE_ASSERT_OFFSET(LightColumn, u, 32);
MOTE_ASSERT_OFFSET(LightColumn, middleU, 44);
MOTE_ASSERT_OFFSET(LightColumn, v, 48);
MOTE_ASSERT_OFFSET(LightColumn, middleV, 60);
MOTE_ASSERT_OFFSET(LightColumn, axis, 64);
MOTE_ASSERT_OFFSET(LightColumn, middleZ, 76);
MOTE_ASSERT_OFFSET(LightColumn, uLow, 80);
MOTE_ASSERT_OFFSET(LightColumn, middleULow, 92);
MOTE_ASSERT_OFFSET(LightColumn, vLow, 96);
MOTE_ASSERT_OFFSET(LightColumn, middleVLow, 108);
MOTE_ASSERT_OFFSET(LightColumn, axisLow, 112);
MOTE_ASSERT_OFFSET(LightColumn, middleZLow, 124);
MOTE_ASSERT_OFFSET(LightColumn, boxU, 128);
MOTE_ASSERT_OFFSET(LightColumn, boxV, 132);
MOTE_ASSERT_OFFSET(LightColumn, boxScaleU, 136);
MOTE_ASSERT_OFFSET(LightColumn, boxScaleV, 140);
MOTE_ASSERT_OFFSET(LightColumn, boxExtent, 144);
MOTE_ASSERT_SIZE(LightColumn, 148);

// How far the walk for a column has come, and what it has found since light_sum.comp last added up. All zero: nothing.
struct LightWalk {
  uint node;              // the next one
  uint slot;              // the leaf at hand: the next particle …
  uint end;               // … and the one behind its last
  uint count;             // particles found
  uint nearCount;         // … and those near the light
  float lowestReach;      // bin of a reach x: (x − lowestReach) · binScale
  float binScale;
  float greatestRadius;
};
MOTE_BUFFER(LightWalkBuffer, LightWalk)
MOTE_ASSERT_OFFSET(LightWalk, node, 0);
MOTE_ASSERT_OFFSET(LightWalk, slot, 4);
MOTE_ASSERT_OFFSET(LightWalk, end, 8);
MOTE_ASSERT_OFFSET(LightWalk, count, 12);
MOTE_ASSERT_OFFSET(LightWalk, nearCount, 16);
MOTE_ASSERT_OFFSET(LightWalk, lowestReach, 20);
MOTE_ASSERT_OFFSET(LightWalk, binScale, 24);
MOTE_ASSERT_OFFSET(LightWalk, greatestRadius, 28);
MOTE_ASSERT_SIZE(LightWalk, 32);

// One beam (host/lighting/beam.h) as light_sum.comp takes it.
struct LightBeam {
  uint firstRay;          // of the dispatch
  uint rayCount;
  uint column;            // of the dispatch
  uint box;               // its rectangle in the column's steps: low u, low v, high u, high v, a byte each
  vec3 turnU;             // rows: from the column's frame (u, v, 1) into the beam's
  float margin;           // rounding of depths [scene units]
  vec3 turnV;
  float depthBase;        // the column's
  vec3 turnW;
};
MOTE_BUFFER(LightBeamBuffer, LightBeam)
MOTE_ASSERT_OFFSET(LightBeam, firstRay, 0);
MOTE_ASSERT_OFFSET(LightBeam, rayCount, 4);
MOTE_ASSERT_OFFSET(LightBeam, column, 8);
MOTE_ASSERT_OFFSET(LightBeam, box, 12);
MOTE_ASSERT_OFFSET(LightBeam, turnU, 16);
MOTE_ASSERT_OFFSET(LightBeam, margin, 28);
MOTE_ASSERT_OFFSET(LightBeam, turnV, 32);
MOTE_ASSERT_OFFSET(LightBeam, depthBase, 44);
MOTE_ASSERT_OFFSET(LightBeam, turnW, 48);
MOTE_ASSERT_SIZE(LightBeam, 60);

// One ray of a beam; a beam's rays stand by ascending depth.
struct LightRay {
  float u;                // where it crosses the plane one unit from a point light, or that of a directional one
  float v;
  float depth;            // of its start
  uint self;              // slot that it leaves out, or none
  float uLow;
  float vLow;
  float depthLow;
};
MOTE_BUFFER(LightRayBuffer, LightRay)
MOTE_ASSERT_OFFSET(LightRay, u, 0);
MOTE_ASSERT_OFFSET(LightRay, v, 4);
MOTE_ASSERT_OFFSET(LightRay, depth, 8);
MOTE_ASSERT_OFFSET(LightRay, self, 12);
MOTE_ASSERT_OFFSET(LightRay, uLow, 16);
MOTE_ASSERT_OFFSET(LightRay, vLow, 20);
MOTE_ASSERT_OFFSET(LightRay, depthLow, 24);
MOTE_ASSERT_SIZE(LightRay, 28);

// Scratch lists, `capacity` long. Of a column, as vec4: u, v, 1/r², peak · depth, radius, depthLow, slot · uLow, vLow,
// green peak, blue peak (careful or in colour). As uint: the order by reach · boxes (as LightBeam::box) as they were
// found · boxes by reach; then how many stand before each bin's end, and counters.
MOTE_CONST uint kFoundLists = 3u;
MOTE_CONST uint kOrderLists = 3u;
MOTE_CONST uint kLightBins = 128u;
// Of a beam, as vec4: u, v, 1/r², peak · as the column's third. As uint: place in the column's order · place in its lists.
MOTE_CONST uint kChosenLists = 2u;

// One dispatch of light_gather.comp or light_sum.comp: columns [0, columnCount) and beams [0, beamCount).
struct LightParams {
  MOTE_ADDRESS(NodeBuffer) nodes;           // nodeCount nodes and the sentinel
  MOTE_ADDRESS(Vec4Buffer) particles;       // slot order: x, y, z, support radius [scene units]
  MOTE_ADDRESS(FloatBuffer) peaks;          // slot order, [channel][slot]: optical depth through the centre
  MOTE_ADDRESS(LightColumnBuffer) columns;
  MOTE_ADDRESS(Vec4Buffer) planes;          // eight a column: outward unit normal, offset
  MOTE_ADDRESS(LightWalkBuffer) walks;      // one a column
  MOTE_ADDRESS(LightBeamBuffer) beams;
  MOTE_ADDRESS(LightRayBuffer) rays;
  MOTE_ADDRESS(FloatBuffer) opticalDepths;  // in and out, [channel][ray]: Σ τ before shadowDensity
  MOTE_ADDRESS(Vec4Buffer) found;           // scratch, [column][kFoundLists][capacity]
  MOTE_ADDRESS(UintBuffer) order;           // scratch, [column]: [kOrderLists][capacity], bins' ends, counters
  MOTE_ADDRESS(Vec4Buffer) chosen;          // scratch, [beam][kChosenLists][capacity]
  MOTE_ADDRESS(UintBuffer) chosenIndex;     // scratch, [beam][kChosenLists][capacity]
  uint nodeCount;
  uint columnCount;
  uint beamCount;
  uint rayCount;
  float opticalDepthLimit;                  // rays may stop beyond it: −ln(cutoff) / shadowDensity; +∞ for cutoff 0
  uint slotCount;
};
MOTE_ASSERT_OFFSET(LightParams, nodes, 0);
MOTE_ASSERT_OFFSET(LightParams, particles, 8);
MOTE_ASSERT_OFFSET(LightParams, peaks, 16);
MOTE_ASSERT_OFFSET(LightParams, columns, 24);
MOTE_ASSERT_OFFSET(LightParams, planes, 32);
MOTE_ASSERT_OFFSET(LightParams, walks, 40);
MOTE_ASSERT_OFFSET(LightParams, beams, 48);
MOTE_ASSERT_OFFSET(LightParams, rays, 56);
MOTE_ASSERT_OFFSET(LightParams, opticalDepths, 64);
MOTE_ASSERT_OFFSET(LightParams, found, 72);
MOTE_ASSERT_OFFSET(LightParams, order, 80);
MOTE_ASSERT_OFFSET(LightParams, chosen, 88);
MOTE_ASSERT_OFFSET(LightParams, chosenIndex, 96);
MOTE_ASSERT_OFFSET(LightParams, nodeCount, 104);
MOTE_ASSERT_OFFSET(LightParams, columnCount, 108);
MOTE_ASSERT_OFFSET(LightParams, beamCount, 112);
MOTE_ASSERT_OFFSET(LightParams, rayCount, 116);
MOTE_ASSERT_OFFSET(LightParams, opticalDepthLimit, 120);
MOTE_ASSERT_OFFSET(LightParams, slotCount, 124);
MOTE_ASSERT_SIZE(LightParams, 128);
MOTE_LAYOUT_END

#endif
