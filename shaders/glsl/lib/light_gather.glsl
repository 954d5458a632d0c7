// What lies in a column's way: the twin of gather, place and sort in host/lighting/exact (column.h says what the numbers are).
//
// A subgroup walks the tree for one column. All lanes go the same way: each tests a node against two of the planes, and
// a vote decides; the particles of a leaf are tested one a lane, and those inside are appended side by side. When the
// list is full, or the walk long, the state is kept, what was found is added up, and the next dispatch goes on: sums do
// not mind. (A driver may end loops that take too many steps: lavapipe does so after 65535 a shader, without a word.)
//
// MOTE_EXACT 1: single precision is 1e-7 of the way from the column's middle off, which matters after hundreds of least
// radii; then particles are placed in double. It costs little: they are far fewer than the pairs that are added up.
#ifndef MOTE_LIB_LIGHT_GATHER_GLSL
#define MOTE_LIB_LIGHT_GATHER_GLSL
#include "light_scratch.glsl"

#if MOTE_EXACT
#define Real double
#define Real3 dvec3
#define WHOLE(high, low) (Real(high) + Real(low))
#define WHOLE3(high, low) (Real3(high) + Real3(low))
#else
#define Real float
#define Real3 vec3
#define WHOLE(high, low) (high)
#define WHOLE3(high, low) (high)
#endif

const uint kMostSteps = 48000;  // of the walk's loops, a dispatch: with the sort's below 65535
const uint kPlanes = 6;         // as ColumnPlanes
// As in host/lighting/exact/column.h.
const float kNearLightRadii = 8.0;
const float kLeastCosine = 0.45;
const float kGreatestInverseArea = 1e36;
const float kFarOff = 3e38;

float lowPart(Real value) { return float(value - Real(float(value))); }

/// By ascending bin of their reach, into the lists of the order. Each lane counts its own, so nothing is atomic and the
/// order is the same every time.
void sortByReach(uint column, LightWalk walk) {
  const uint lane = gl_SubgroupInvocationID, width = gl_SubgroupSize;
  const uint order = orderList(column, 0), boxes = orderList(column, 1), sortedBoxes = orderList(column, 2),
             bins = binCounters(column), ends = foundList(column, 1), lasts = binEnds(column);
  for (uint bin = 0; bin < kLightBins; ++bin) params.order.at[bins + bin * width + lane] = 0;
  for (uint at = 0; at < walk.count; at += width)
    if (at + lane < walk.count) {
      const vec2 end = params.found.at[ends + at + lane].xy;
      ++params.order.at[bins + binOf(end.x + end.y, walk) * width + lane];
    }
  uint before = 0;
  for (uint bin = 0; bin < kLightBins; ++bin) {
    const uint count = params.order.at[bins + bin * width + lane];
    const uint sum = subgroupInclusiveAdd(count);
    params.order.at[bins + bin * width + lane] = before + sum - count;
    before += subgroupAdd(count);
    if (subgroupElect()) params.order.at[lasts + bin] = before;
  }
  for (uint at = 0; at < walk.count; at += width)
    if (at + lane < walk.count) {
      const vec2 end = params.found.at[ends + at + lane].xy;
      const uint counter = bins + binOf(end.x + end.y, walk) * width + lane;
      const uint place = params.order.at[counter]++;
      params.order.at[order + place] = at + lane;
      params.order.at[sortedBoxes + place] = params.order.at[boxes + at + lane];
    }
}

/// What a particle covers of the beams' rectangle, in its steps.
uint boxOf(LightColumn column, vec2 place, float extent) {
  const vec2 reach = vec2(extent * column.boxExtent), scale = vec2(column.boxScaleU, column.boxScaleV);
  const vec2 offset = place - vec2(column.boxU, column.boxV);
  const uvec2 low = uvec2(clamp((offset - reach) * scale, 0.0, 255.0));
  const uvec2 high = uvec2(clamp((offset + reach) * scale, 0.0, 255.0));
  return low.x | low.y << 8 | high.x << 16 | high.y << 24;
}

void main() {
  const uint index = subgroupOfDispatch(), lane = gl_SubgroupInvocationID, width = gl_SubgroupSize;
  if (index >= params.columnCount) return;
  const LightColumn column = params.columns.at[index];
  const vec4 nodePlane = params.planes.at[8 * index + (lane & 7u)];
  const vec4 otherPlane = params.planes.at[8 * index + ((lane + 4u) & 7u)];
  vec4 plane[kPlanes];
  for (uint k = 0; k < kPlanes; ++k) plane[k] = params.planes.at[8 * index + k];
  const Real3 axisU = WHOLE3(column.u, column.uLow), axisV = WHOLE3(column.v, column.vLow),
              axis = WHOLE3(column.axis, column.axisLow);
  const Real middleU = WHOLE(column.middleU, column.middleULow), middleV = WHOLE(column.middleV, column.middleVLow),
             middleZ = WHOLE(column.middleZ, column.middleZLow);
  const Real shift = Real(column.middleZ - column.depthBase) + Real(column.middleZLow - column.depthBaseLow);
  const uint places = foundList(index, 0), ends = foundList(index, 1), others = foundList(index, 2),
             boxes = orderList(index, 1);

  LightWalk walk = params.walks.at[index];
  walk.count = walk.nearCount = 0;
  uint steps = 0;
  float lowest = kFarOff, highest = -kFarOff, greatest = 0.0;
  while ((walk.slot < walk.end || walk.node < params.nodeCount) &&
         walk.count + walk.nearCount + width <= kFoundCapacity && steps < kMostSteps) {
    steps += 3;  // of this loop, and those in which the two inside of it end
    while (walk.slot >= walk.end && walk.node < params.nodeCount && steps < kMostSteps) {  // to the next leaf
      const Node node = params.nodes.at[walk.node];
      const vec3 extent = 0.5 * (node.hi - node.lo), centre = 0.5 * (node.lo + node.hi) - column.planeOrigin;
      const bool beyond =
          dot(centre, nodePlane.xyz) - nodePlane.w > dot(extent, abs(nodePlane.xyz)) ||
          dot(centre, otherPlane.xyz) - otherPlane.w > dot(extent, abs(otherPlane.xyz));
      const bool outside = subgroupAny(beyond);
      const bool leaf = !outside && node.skip == walk.node + 1;
      walk.node = outside ? node.skip : walk.node + 1;
      walk.slot = node.first;
      walk.end = leaf ? params.nodes.at[walk.node].first : node.first;
      ++steps;
    }
    while (walk.slot < walk.end && walk.count + walk.nearCount + width <= kFoundCapacity && steps < kMostSteps) {
      const uint slot = min(walk.slot + lane, walk.end - 1);
      const vec4 particle = params.particles.at[slot];
      const float radius = particle.w;
      const vec3 offset = particle.xyz - column.planeOrigin;
      bool inside = walk.slot + lane < walk.end && radius > 0.0;
      for (uint k = 0; k < kPlanes; ++k) inside = inside && dot(offset, plane[k].xyz) - plane[k].w <= radius;

      const Real3 p = Real3(particle.xyz) - Real3(column.middle);
      const Real x = dot(p, axisU) + middleU, y = dot(p, axisV) + middleV, along = dot(p, axis), z = along + middleZ;
      Real u = x, v = y, depth = along + shift, perRadius = Real(1.0) / Real(radius), extent = Real(radius);
      bool near = false, ahead = true;
      if (kPerspective) {
        const Real across = x * x + y * y, distance = sqrt(across + z * z);
        u = x / z, v = y / z, perRadius = z / Real(radius), extent = Real(radius) / z;
        depth += across / max(distance + z, Real(1e-30));  // distance − z, no digits lost
        near = float(distance) < kNearLightRadii * radius;
        ahead = float(z) > kLeastCosine * float(distance);
      }
      const float inverseArea = min(float(perRadius * perRadius), kGreatestInverseArea);
      const float reach = float(depth) + radius;  // as in sortByReach
      const bool nearLight = inside && near, sorted = inside && !near && ahead;
      const uvec4 ahead4 = subgroupBallot(sorted);
      const uint to = walk.count + subgroupBallotExclusiveBitCount(ahead4);
      walk.count += subgroupBallotBitCount(ahead4);
      const float peak = params.peaks.at[slot];
      vec2 colours = vec2(0);
      if (kChannels == 3)
        colours = vec2(params.peaks.at[params.slotCount + slot], params.peaks.at[2 * params.slotCount + slot]);
      if (sorted) {
        params.found.at[places + to] = vec4(float(u), float(v), inverseArea, peak);
        params.found.at[ends + to] = vec4(float(depth), radius, lowPart(depth), uintBitsToFloat(slot));
        if (kCareful || kChannels == 3) params.found.at[others + to] = vec4(lowPart(u), lowPart(v), colours);
        params.order.at[boxes + to] = boxOf(column, vec2(u, v), float(extent));
        lowest = min(lowest, reach), highest = max(highest, reach), greatest = max(greatest, radius);
      }
      if (kPerspective) {  // those near the light from the end of the list
        const uvec4 near4 = subgroupBallot(nearLight);
        const uint place = kFoundCapacity - 1 - (walk.nearCount + subgroupBallotExclusiveBitCount(near4));
        walk.nearCount += subgroupBallotBitCount(near4);
        if (nearLight) {
          params.found.at[places + place] =
              vec4(float(x), float(y), float(z), min(1.0 / (radius * radius), kGreatestInverseArea));
          params.found.at[ends + place] = vec4(peak, radius, 0, uintBitsToFloat(slot));
          if (kChannels == 3) params.found.at[others + place] = vec4(0, 0, colours);
        }
      }
      walk.slot += width;
      ++steps;
    }
  }
  walk.lowestReach = subgroupMin(lowest);
  highest = subgroupMax(highest);
  walk.greatestRadius = subgroupMax(greatest);
  walk.binScale = highest > walk.lowestReach ? float(kLightBins) / (highest - walk.lowestReach) : 0.0;
  shareWrites();
  sortByReach(index, walk);
  if (subgroupElect()) params.walks.at[index] = walk;
}

#endif
