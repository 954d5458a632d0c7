// The optical depths of a beam's rays from what light_gather.comp found for its column: the twin of choose and sum in
// host/lighting/exact (beam_kernel.h), for one subgroup a beam.
//
// First the column's particles that may touch the beam are chosen, in the order of their reach: by boxes of four bytes,
// so what most of them cost is a word. Then rays go in sets of kRays. A lane has a particle of its own and all rays of
// the set, the same in all lanes; sums are added up over the lanes at the end. A beam's rays stand by their depth, so a
// group of kGroupRays covers a short piece of it: what lies before the piece is wholly in the way of all its rays and
// goes through the short formula, also for all groups behind; what may straddle a start goes through the long one, for
// that group alone; what lies behind is never looked at. Every loop runs over whole blocks of particles, a subgroup
// wide, with the same bounds in all lanes.
//
// On hardware rays are scalars, particles are loads side by side, and nothing diverges. On lavapipe (Mesa 22.3) a load
// inside of a loop takes about 90 instructions for each component of a subgroup, and a broadcast 54: so what is loaded
// must meet many rays, and nothing is broadcast. Loops over rays must unroll, or their arrays live in memory: NIR
// unrolls those that count by ones, from and to what is known when the shader is compiled.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/light_scratch.glsl"

layout(constant_id = 7) const uint kGroupRays = 4;  // at most as many as a subgroup has lanes
layout(constant_id = 8) const uint kGroups = 4;     // likewise, and at most 8
layout(constant_id = 9) const uint kFalloff = 0;
layout(constant_id = 10) const uint kEndpoint = 0;
layout(constant_id = 11) const bool kNearLight = false;  // there may be particles near a point light

#include "lib/cap.glsl"
#include "lib/falloff.glsl"

const uint kRays = kGroupRays * kGroups;
const uint kMostGroups = 8;
const uint kStride = 64;  // particles between two looks at whether all is dark
const float kBehind = 2.07;  // 1 + kBehindRadii of host/lighting/exact/column.h
const float kGreatestInverseArea = 1e36;

LightBeam beam;
LightWalk walk;
uint beamIndex, chosenCount;
// Of the set's rays: the same in all lanes …
float rayU[kRays], rayV[kRays], rayULow[kRays], rayVLow[kRays], rayDepth[kRays], rayDepthLow[kRays], rayNorm[kRays];
uint raySelf[kRays];
// … and what the lane's particles add to each.
float sum[kRays], sumGreen[kRays], sumBlue[kRays];

bool touches(uint box) {
  const uvec4 own = uvec4(box, box >> 8, box >> 16, box >> 24) & 0xffu;
  const uvec4 beams = uvec4(beam.box, beam.box >> 8, beam.box >> 16, beam.box >> 24) & 0xffu;
  return own.x <= beams.z && own.y <= beams.w && own.z >= beams.x && own.w >= beams.y;
}

/// The particles from `at` (in the column's order) on that may touch the beam, until the list is full; returns where to
/// go on. Those are few, so what they are is looked up only when all are known.
uint choose(uint at) {
  const uint lane = gl_SubgroupInvocationID, width = gl_SubgroupSize;
  const uint boxes = orderList(beam.column, 2), order = orderList(beam.column, 0);
  const uint inOrder = chosenList(beamIndex, 0), inLists = chosenList(beamIndex, 1);
  chosenCount = 0;
  do {
    const bool chosen = at + lane < walk.count && touches(params.order.at[boxes + min(at + lane, kFoundCapacity - 1)]);
    const uvec4 all = subgroupBallot(chosen);
    if (chosen) params.chosenIndex.at[inOrder + chosenCount + subgroupBallotExclusiveBitCount(all)] = at + lane;
    chosenCount += subgroupBallotBitCount(all);
    at += width;
  } while (at < walk.count && chosenCount + 2 * width <= kChosenCapacity);
  shareWrites();
  uint block = 0;
  do {  // the last block is filled up with nothing
    const uint place = block + lane;
    const bool own = place < chosenCount;
    const uint from = own ? params.order.at[order + params.chosenIndex.at[inOrder + place]] : 0;
    const vec4 p = params.found.at[foundList(beam.column, 0) + from];
    const vec3 uv1 = vec3(p.xy, 1.0);
    const float w = dot(beam.turnW, uv1);
    const vec4 turned = vec4(dot(beam.turnU, uv1) / w, dot(beam.turnV, uv1) / w, p.z * (w * w), p.w);
    params.chosen.at[chosenList(beamIndex, 0) + place] = own ? turned : vec4(0);
    if (kCareful || kChannels == 3) {
      const vec4 others = params.found.at[foundList(beam.column, 2) + from];
      params.chosen.at[chosenList(beamIndex, 1) + place] = own ? others : vec4(0);
    }
    params.chosenIndex.at[inLists + place] = from;
    block += width;
  } while (block < chosenCount);
  shareWrites();
  return at;
}

/// The first chosen particle whose reach is in this bin or a later one; each lane for its own.
uint firstFrom(uint bin) {
  const uint inOrder = chosenList(beamIndex, 0);
  uint behind = params.order.at[binEnds(beam.column) + max(bin, 1) - 1];
  if (bin == 0) behind = 0;
  uint low = 0, high = chosenCount;
  while (subgroupAny(low < high)) {
    const uint middle = (low + high) / 2;
    const bool before = params.chosenIndex.at[inOrder + min(middle, kChosenCapacity - 1)] < behind, open = low < high;
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

/// The lane's particle of a block.
struct Particle {
  vec4 place;   // u, v, 1/r², peak
  vec4 others;  // uLow, vLow, the other peaks
};
Particle particleAt(uint at) {
  Particle p = Particle(params.chosen.at[chosenList(beamIndex, 0) + at], vec4(0));
  if (kCareful || kChannels == 3) p.others = params.chosen.at[chosenList(beamIndex, 1) + at];
  return p;
}

/// A block that lies before the starts of the groups from `group` on.
void addBefore(uint block, const uint group) {
  const Particle p = particleAt(block + gl_SubgroupInvocationID);
  [[unroll]] for (uint g = group; g < kGroups; ++g) {
    [[unroll]] for (uint j = 0; j < kGroupRays; ++j) {
      const uint k = g * kGroupRays + j;
      add(k, p.place.w, p.others.zw, falloff(separation(p.place, p.others.xy, k), kFalloff));
    }
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
void addAtStart(uint block, const uint group) {
  const uint at = block + gl_SubgroupInvocationID;
  const Particle p = particleAt(at);
  const uint from = params.chosenIndex.at[chosenList(beamIndex, 1) + at];
  const vec4 end = params.found.at[foundList(beam.column, 1) + from];
  const float radius = end.y, inverseRadius = 1.0 / radius, area = radius * radius;
  const float inverseDepth = kPerspective ? 1.0 / (end.x + beam.depthBase) : 0.0;
  const float sagFirst = 0.5 * inverseDepth, sagRatio = 0.25 * (inverseDepth * inverseDepth);
  const float inverseArea = min(inverseRadius * inverseRadius, kGreatestInverseArea);
  [[unroll]] for (uint j = 0; j < kGroupRays; ++j) {
    const uint k = group * kGroupRays + j;
    const float q = separation(p.place, p.others.xy, k);
    float t = (rayDepth[k] - end.x) + (rayDepthLow[k] - end.z);
    if (kPerspective) {
      const float b2 = q * area;
      t += b2 * sagFirst * (1.0 + b2 * sagRatio);
    }
    float share;
    if (kEndpoint == kEndpointClamp) {
      const float back = min(t, 0.0);
      share = falloff(q + back * back * inverseArea, kFalloff);
    } else {
      share = softShare(q, t, radius, inverseRadius);
    }
    add(k, p.place.w, p.others.zw, raySelf[k] == floatBitsToUint(end.w) ? 0.0 : share);
  }
}

/// Those near a point light, in plain coordinates.
void addNearLight() {
  uint near = gl_SubgroupInvocationID;
  do {
    const uint at = kFoundCapacity - 1 - min(near, max(walk.nearCount, 1) - 1);
    // Without any of them nothing was written there: a share of that might be infinite.
    const vec4 p = near < walk.nearCount ? params.found.at[foundList(beam.column, 0) + at] : vec4(0);
    const vec4 end = params.found.at[foundList(beam.column, 1) + at];
    vec3 peak = vec3(end.x, 0, 0);
    if (kChannels == 3) peak.yz = params.found.at[foundList(beam.column, 2) + at].zw;
    if (near >= walk.nearCount) peak = vec3(0);
    [[unroll]] for (uint g = 0; g < kGroups; ++g) {
      [[unroll]] for (uint j = 0; j < kGroupRays; ++j) {
        const uint k = g * kGroupRays + j;
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
    near += gl_SubgroupSize;
  } while (subgroupAny(near < walk.nearCount));
}

/// Whether all rays of the groups from `group` on are beyond the limit. Least of the rays in each lane, then the sum
/// over the lanes: never more than the least sum, and one sum instead of kRays.
bool allDark(const uint group) {
  float least = 1e38;
  [[unroll]] for (uint g = group; g < kGroups; ++g) {
    [[unroll]] for (uint j = 0; j < kGroupRays; ++j) {
      const uint k = g * kGroupRays + j;
      least = min(least, sum[k]);
      if (kChannels == 3) least = min(least, min(sumGreen[k], sumBlue[k]));
    }
  }
  return subgroupAdd(least) > params.opticalDepthLimit;
}

// The loops have their ends behind them: before them lavapipe would run the body once more, for nobody.
#define ADD_AT_START(K)                             \
  if (K < kGroups && firstAtStart[K] < endAtStart[K]) { \
    uint block = firstAtStart[K];                   \
    do {                                            \
      addAtStart(block, K);                         \
      block += gl_SubgroupSize;                     \
    } while (block < endAtStart[K]);                \
  }
#define ADD_BEFORE(K)                                     \
  if (K < kGroups && at < firstAtStart[K] && !dark) {     \
    do {                                                  \
      const uint stop = min(at + kStride, firstAtStart[K]); \
      do {                                                \
        addBefore(at, K);                                 \
        at += gl_SubgroupSize;                            \
      } while (at < stop);                                \
      dark = allDark(K);                                  \
    } while (at < firstAtStart[K] && !dark);              \
  }

/// One set against what is chosen.
void addSet(uint first) {
  const uint last = beam.rayCount - 1;
  [[unroll]] for (uint g = 0; g < kGroups; ++g) {
    [[unroll]] for (uint j = 0; j < kGroupRays; ++j) {
      const uint k = g * kGroupRays + j;
      const LightRay r = params.rays.at[beam.firstRay + min(first + k, last)];
      rayU[k] = r.u, rayV[k] = r.v, rayDepth[k] = r.depth, rayDepthLow[k] = r.depthLow, raySelf[k] = r.self;
      rayULow[k] = rayVLow[k] = 0.0, rayNorm[k] = 1.0;
      if (kCareful) {
        rayULow[k] = r.uLow, rayVLow[k] = r.vLow;
        if (kPerspective) rayNorm[k] = 1.0 / (1.0 + r.u * r.u + r.v * r.v);
      }
      sum[k] = sumGreen[k] = sumBlue[k] = 0.0;
    }
  }
  // Each lane looks up one group.
  const uint begin = first + min(gl_SubgroupInvocationID, kGroups - 1) * kGroupRays;
  const float nearest = params.rays.at[beam.firstRay + min(begin, last)].depth - beam.margin;
  const float deepest = params.rays.at[beam.firstRay + min(begin + kGroupRays - 1, last)].depth + beam.margin;
  const uint from = firstFrom(binOf(nearest, walk)) / gl_SubgroupSize * gl_SubgroupSize;
  const uint end = firstFrom(binOf(deepest + kBehind * walk.greatestRadius, walk) + 1);
  uint firstAtStart[kMostGroups], endAtStart[kMostGroups];
  [[unroll]] for (uint g = 0; g < kGroups; ++g)
    firstAtStart[g] = subgroupBroadcast(from, g), endAtStart[g] = subgroupBroadcast(end, g);

  ADD_AT_START(0) ADD_AT_START(1) ADD_AT_START(2) ADD_AT_START(3)
  ADD_AT_START(4) ADD_AT_START(5) ADD_AT_START(6) ADD_AT_START(7)
  uint at = 0;
  bool dark = allDark(0);
  ADD_BEFORE(0) ADD_BEFORE(1) ADD_BEFORE(2) ADD_BEFORE(3)
  ADD_BEFORE(4) ADD_BEFORE(5) ADD_BEFORE(6) ADD_BEFORE(7)
}

/// Adds to what is there.
void storeSet(uint first) {
  const uint lane = gl_SubgroupInvocationID;
  [[unroll]] for (uint g = 0; g < kGroups; ++g) {
    float red = 0.0, green = 0.0, blue = 0.0;  // of the lane's ray
    [[unroll]] for (uint j = 0; j < kGroupRays; ++j) {
      const uint k = g * kGroupRays + j;
      const float total = subgroupAdd(sum[k]);
      red = lane == j ? total : red;
      if (kChannels == 3) {
        const float totalGreen = subgroupAdd(sumGreen[k]), totalBlue = subgroupAdd(sumBlue[k]);
        green = lane == j ? totalGreen : green, blue = lane == j ? totalBlue : blue;
      }
    }
    const uint place = first + g * kGroupRays + lane;
    if (lane < kGroupRays && place < beam.rayCount) {
      const uint ray = beam.firstRay + place;
      params.opticalDepths.at[ray] += red;
      if (kChannels == 3) {
        params.opticalDepths.at[params.rayCount + ray] += green;
        params.opticalDepths.at[2 * params.rayCount + ray] += blue;
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
  do {
    at = choose(at);
    uint first = 0;
    do {
      addSet(first);
      if (kNearLight) addNearLight();
      storeSet(first);
      first += kRays;
    } while (first < beam.rayCount);
    walk.nearCount = 0;
  } while (at < walk.count);
}
