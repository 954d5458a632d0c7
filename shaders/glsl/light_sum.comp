// The optical depths of a beam's rays from what light_gather.comp found for its column: the twin of choose and sum in
// host/lighting (beam_kernel.h), for one subgroup a beam.
//
// First the column's particles that may touch the beam are chosen, one a lane, in the order of their reach. Then rays go
// in packets of kRays a lane. A beam's rays stand by their depth, so each kRays-th of a packet (a group: one ray a lane)
// covers a short piece of it: what lies before the piece is wholly in the way of all its rays and goes through the short
// formula, also for all groups behind; what may straddle a start goes through the long one, for that group alone; what
// lies behind is never looked at. Every loop runs over whole blocks of particles with the same bounds in all lanes: on
// hardware there is no divergence and a particle is one load a subgroup; on lavapipe, where a branch does both sides and
// a load inside of a loop is one a lane, each lane loads a particle of the block, which is then broadcast.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/light_scratch.glsl"

layout(constant_id = 7) const uint kRays = 2;
layout(constant_id = 8) const uint kFalloff = 0;
layout(constant_id = 9) const uint kEndpoint = 0;
layout(constant_id = 10) const uint kBlock = 8;          // particles; a power of two
layout(constant_id = 11) const bool kBroadcast = false;  // kBlock lanes load one each
layout(constant_id = 12) const bool kGoOn = false;       // add to what is there

#include "lib/cap.glsl"
#include "lib/falloff.glsl"

const uint kMostGroups = 8;              // kRays at most
const uint kStride = 64;                 // particles between two looks at whether all is dark
const float kBehind = 2.07;              // 1 + kBehindRadii of host/lighting/column.h
const float kGreatestInverseArea = 1e36;

LightBeam beam;
LightWalk walk;
uint beamIndex, chosenCount;
float rayU[kRays], rayV[kRays], rayULow[kRays], rayVLow[kRays], rayDepth[kRays], rayDepthLow[kRays], rayNorm[kRays];
uint raySelf[kRays];
float sum[kRays], sumGreen[kRays], sumBlue[kRays];

/// The particles from `at` (in `order`) on that may touch the beam, until the list is full; returns where to go on.
uint choose(uint at) {
  const uint lane = gl_SubgroupInvocationID, width = gl_SubgroupSize;
  const uint places = foundList(beam.column, 0), peaks = foundList(beam.column, 2), order = orderList(beam.column);
  const uint to = chosenList(beamIndex, 0), colours = chosenList(beamIndex, 1), indices = beamIndex * kChosenCapacity;
  chosenCount = 0;
  while (at < walk.count && chosenCount + width + kBlock <= kChosenCapacity) {
    const uint from = params.order.at[order + min(at + lane, walk.count - 1)];
    const vec4 p = params.found.at[places + from];
    const float extent = p.z * beam.extentScale;
    const bool touches = at + lane < walk.count && p.x - extent <= beam.highU && p.x + extent >= beam.lowU &&
                         p.y - extent <= beam.highV && p.y + extent >= beam.lowV;
    const uvec4 chosen = subgroupBallot(touches);
    const uint place = chosenCount + subgroupBallotExclusiveBitCount(chosen);
    chosenCount += subgroupBallotBitCount(chosen);
    if (touches) {
      const vec3 uv1 = vec3(p.xy, 1.0);
      const float w = dot(beam.turnW, uv1);
      const vec4 peak = params.found.at[peaks + from];
      params.chosen.at[to + place] = vec4(dot(beam.turnU, uv1) / w, dot(beam.turnV, uv1) / w, p.w * (w * w), peak.x);
      if (kChannels == 3) params.chosen.at[colours + place] = peak;
      params.chosenIndex.at[indices + place] = from;
    }
    at += width;
  }
  // The last block is filled up with nothing.
  for (uint place = chosenCount + lane; subgroupAny(place < chosenCount + kBlock); place += width)
    if (place < chosenCount + kBlock) {
      params.chosen.at[to + place] = vec4(0);
      if (kChannels == 3) params.chosen.at[colours + place] = vec4(0);
      params.chosenIndex.at[indices + place] = 0;
    }
  shareWrites();
  return at;
}

/// The first chosen particle whose reach is in this bin or a later one; each lane for its own.
uint firstFrom(uint bin) {
  const uint indices = beamIndex * kChosenCapacity, ends = foundList(beam.column, 1);
  uint low = 0, high = chosenCount;
  while (subgroupAny(low < high)) {
    const uint middle = (low + high) / 2;
    const uint found = binOf(params.found.at[ends + params.chosenIndex.at[indices + middle]].z, walk);
    const bool before = found < bin;
    const bool open = low < high;
    low = open && before ? middle + 1 : low;
    high = open && !before ? middle : high;
  }
  return low;
}

float separation(vec4 p, vec2 low, uint k) {
  float du = p.x - rayU[k], dv = p.y - rayV[k];
  if (!kCareful) return (du * du + dv * dv) * p.z;
  du = du + (low.x - rayULow[k]), dv = dv + (low.y - rayVLow[k]);
  const float across = kPerspective ? du * rayV[k] - dv * rayU[k] : 0.0;
  return (du * du + dv * dv + across * across) * (p.z * rayNorm[k]);
}

void add(uint k, float red, vec2 others, float share) {
  sum[k] += red * share;
  if (kChannels == 3) sumGreen[k] += others.x * share, sumBlue[k] += others.y * share;
}

/// A block that lies before the starts of the groups from `group` on.
void addBefore(uint at, const uint group) {
  const uint base = chosenList(beamIndex, 0) + at, colours = chosenList(beamIndex, 1) + at,
             indices = beamIndex * kChosenCapacity + at, lows = foundList(beam.column, 3);
  const uint lane = kBroadcast ? gl_SubgroupInvocationID : 0;
  vec4 mine = vec4(0);
  vec2 mineOthers = vec2(0), mineLow = vec2(0);
  if (kBroadcast) {
    mine = params.chosen.at[base + lane];
    if (kChannels == 3) mineOthers = params.chosen.at[colours + lane].yz;
    if (kCareful) mineLow = params.found.at[lows + params.chosenIndex.at[indices + lane]].xy;
  }
  [[unroll]] for (uint i = 0; i < kBlock; ++i) {
    vec4 p;
    vec2 others = vec2(0), low = vec2(0);
    if (kBroadcast) {
      p = subgroupBroadcast(mine, i);
      if (kChannels == 3) others = subgroupBroadcast(mineOthers, i);
      if (kCareful) low = subgroupBroadcast(mineLow, i);
    } else {
      p = params.chosen.at[base + i];
      if (kChannels == 3) others = params.chosen.at[colours + i].yz;
      if (kCareful) low = params.found.at[lows + params.chosenIndex.at[indices + i]].xy;
    }
    [[unroll]] for (uint k = group; k < kRays; ++k) add(k, p.w, others, falloff(separation(p, low, k), kFalloff));
  }
}

/// Falloff times the share before a start at the distance t of the centre's place on the ray: softShare of the host.
float softShare(float q, float t, float radius, float inverseRadius) {
  const float s = sqrt(max(1.0 - q, 0.0));
  if (kFalloff != kFalloffSmooth) return falloff(q, kFalloff) * cap(t, radius * s);
  const float x = min(max(t * inverseRadius, -s), s);
  return (0.25 * s) * ((s + x) * (s + x)) * ((s + s) - x);
}

/// A block that may straddle the starts of one group.
void addAtStart(uint at, const uint k) {
  const uint base = chosenList(beamIndex, 0) + at, colours = chosenList(beamIndex, 1) + at,
             indices = beamIndex * kChosenCapacity + at, ends = foundList(beam.column, 1),
             peaks = foundList(beam.column, 2), lows = foundList(beam.column, 3);
  vec4 mine = vec4(0), mineEnd = vec4(0), mineLow = vec4(0);
  vec2 mineOthers = vec2(0);
  if (kBroadcast) {
    const uint from = params.chosenIndex.at[indices + gl_SubgroupInvocationID];
    mine = params.chosen.at[base + gl_SubgroupInvocationID];
    mineEnd = params.found.at[ends + from];
    mineLow.z = params.found.at[peaks + from].w;
    if (kCareful) mineLow.xy = params.found.at[lows + from].xy;
    if (kChannels == 3) mineOthers = params.chosen.at[colours + gl_SubgroupInvocationID].yz;
  }
  [[unroll]] for (uint i = 0; i < kBlock; ++i) {
    vec4 p, end, low = vec4(0);
    vec2 others = vec2(0);
    if (kBroadcast) {
      p = subgroupBroadcast(mine, i), end = subgroupBroadcast(mineEnd, i), low = subgroupBroadcast(mineLow, i);
      if (kChannels == 3) others = subgroupBroadcast(mineOthers, i);
    } else {
      const uint from = params.chosenIndex.at[indices + i];
      p = params.chosen.at[base + i];
      end = params.found.at[ends + from];
      low.z = params.found.at[peaks + from].w;
      if (kCareful) low.xy = params.found.at[lows + from].xy;
      if (kChannels == 3) others = params.chosen.at[colours + i].yz;
    }
    const float radius = end.y, inverseRadius = 1.0 / radius;
    const float q = separation(p, low.xy, k);
    float t = (rayDepth[k] - end.x) + (rayDepthLow[k] - low.z);
    if (kPerspective) {
      const float inverseDepth = 1.0 / (end.x + beam.depthBase), b2 = q * (radius * radius);
      t += b2 * (0.5 * inverseDepth) * (1.0 + 0.25 * (b2 * (inverseDepth * inverseDepth)));
    }
    float share;
    if (kEndpoint == kEndpointClamp) {
      const float back = min(t, 0.0);
      share = falloff(q + back * back * min(inverseRadius * inverseRadius, kGreatestInverseArea), kFalloff);
    } else {
      share = softShare(q, t, radius, inverseRadius);
    }
    add(k, p.w, others, raySelf[k] == floatBitsToUint(end.w) ? 0.0 : share);
  }
}

/// Those near a point light, in plain coordinates.
void addNearLight() {
  for (uint j = 0; j < walk.nearCount; ++j) {
    const uint at = kFoundCapacity - 1 - j;
    const vec4 p = params.found.at[foundList(beam.column, 0) + at], end = params.found.at[foundList(beam.column, 1) + at],
               peak = params.found.at[foundList(beam.column, 2) + at];
    [[unroll]] for (uint k = 0; k < kRays; ++k) {
      const vec3 own = normalize(vec3(rayU[k], rayV[k], 1.0));
      const vec3 direction = beam.turnU * own.x + beam.turnV * own.y + beam.turnW * own.z;
      const float len = rayDepth[k] + beam.depthBase, fromLight = dot(p.xyz, direction);
      const vec3 e = p.xyz - (kEndpoint == kEndpointClamp ? clamp(fromLight, 0.0, len) : fromLight) * direction;
      const float q = dot(e, e) * p.w;
      float share = falloff(q, kFalloff);
      if (kEndpoint == kEndpointSoft) {
        const float halfChord = end.y * sqrt(max(1.0 - q, 0.0));
        share = share * cap(len - fromLight, halfChord) * cap(fromLight, halfChord);
      }
      add(k, peak.x, peak.yz, raySelf[k] == floatBitsToUint(end.w) ? 0.0 : share);
    }
  }
}

bool allDark() {
  float least = sum[0];
  [[unroll]] for (uint k = 0; k < kRays; ++k) {
    least = min(least, sum[k]);
    if (kChannels == 3) least = min(least, min(sumGreen[k], sumBlue[k]));
  }
  return subgroupAll(least > params.opticalDepthLimit);
}

// The loops have their ends behind them: before them lavapipe would run the body once more, for nobody.
#define ADD_AT_START(K)                                            \
  if (K < kRays && firstAtStart[K] < endAtStart[K]) {              \
    uint block = firstAtStart[K];                                  \
    do {                                                           \
      addAtStart(block, K);                                        \
      block += kBlock;                                             \
    } while (block < endAtStart[K]);                               \
  }
#define ADD_BEFORE(K)                                              \
  if (K < kRays && at < firstAtStart[K] && !dark) {                \
    do {                                                           \
      const uint stop = min(at + kStride, firstAtStart[K]);        \
      do {                                                         \
        addBefore(at, K);                                          \
        at += kBlock;                                              \
      } while (at < stop);                                         \
      dark = allDark();                                            \
    } while (at < firstAtStart[K] && !dark);                       \
  }

/// One packet against what is chosen.
void addPacket(uint first, bool begins) {
  const uint lane = gl_SubgroupInvocationID, width = gl_SubgroupSize, last = beam.rayCount - 1;
  [[unroll]] for (uint k = 0; k < kRays; ++k) {
    const uint place = first + k * width + lane;
    const uint ray = beam.firstRay + min(place, last);
    const LightRay r = params.rays.at[ray];
    rayU[k] = r.u, rayV[k] = r.v, rayDepth[k] = r.depth, rayDepthLow[k] = r.depthLow, raySelf[k] = r.self;
    rayULow[k] = rayVLow[k] = 0.0, rayNorm[k] = 1.0;
    if (kCareful) {
      rayULow[k] = r.uLow, rayVLow[k] = r.vLow;
      if (kPerspective) rayNorm[k] = 1.0 / (1.0 + r.u * r.u + r.v * r.v);
    }
    sum[k] = sumGreen[k] = sumBlue[k] = 0.0;
    if (!begins) {
      sum[k] = params.opticalDepths.at[ray];
      if (kChannels == 3) {
        sumGreen[k] = params.opticalDepths.at[params.rayCount + ray];
        sumBlue[k] = params.opticalDepths.at[2 * params.rayCount + ray];
      }
    }
  }
  // Each lane looks up one group.
  const uint group = min(lane, kRays - 1);
  const float nearest = params.rays.at[beam.firstRay + min(first + group * width, last)].depth - beam.margin;
  const float deepest = params.rays.at[beam.firstRay + min(first + group * width + width - 1, last)].depth + beam.margin;
  const uint from = firstFrom(binOf(nearest, walk)) & ~(kBlock - 1);
  const uint end = firstFrom(binOf(deepest + kBehind * walk.greatestRadius, walk) + 1);
  uint firstAtStart[kMostGroups], endAtStart[kMostGroups];
  [[unroll]] for (uint k = 0; k < kRays; ++k)
    firstAtStart[k] = subgroupBroadcast(from, k), endAtStart[k] = subgroupBroadcast(end, k);

  ADD_AT_START(0) ADD_AT_START(1) ADD_AT_START(2) ADD_AT_START(3)
  ADD_AT_START(4) ADD_AT_START(5) ADD_AT_START(6) ADD_AT_START(7)
  uint at = 0;
  bool dark = allDark();
  ADD_BEFORE(0) ADD_BEFORE(1) ADD_BEFORE(2) ADD_BEFORE(3)
  ADD_BEFORE(4) ADD_BEFORE(5) ADD_BEFORE(6) ADD_BEFORE(7)
}

void storePacket(uint first) {
  [[unroll]] for (uint k = 0; k < kRays; ++k) {
    const uint place = first + k * gl_SubgroupSize + gl_SubgroupInvocationID;
    if (place < beam.rayCount) {
      params.opticalDepths.at[beam.firstRay + place] = sum[k];
      if (kChannels == 3) {
        params.opticalDepths.at[params.rayCount + beam.firstRay + place] = sumGreen[k];
        params.opticalDepths.at[2 * params.rayCount + beam.firstRay + place] = sumBlue[k];
      }
    }
  }
}

void main() {
  beamIndex = subgroupOfDispatch();
  if (beamIndex >= params.beamCount) return;
  beam = params.beams.at[beamIndex];
  walk = params.walks.at[beam.column];
  uint at = 0;
  bool begins = !kGoOn;
  do {
    at = choose(at);
    uint first = 0;
    do {
      addPacket(first, begins);
      if (kPerspective) {
        addNearLight();
      }
      storePacket(first);
      first += kRays * gl_SubgroupSize;
    } while (first < beam.rayCount);
    begins = false;
    walk.nearCount = 0;
  } while (at < walk.count);
}
