// Sorting by depth: what depth_key.comp and the bitonic passes read and write.
//
// A key is a float distance as an unsigned integer whose order is "farthest first"; a pair is (key, index) and pairs
// are compared as one 64-bit number, so equal keys stand in index order, as after std::stable_sort.
#ifndef MOTE_LAYOUT_SORT_H
#define MOTE_LAYOUT_SORT_H
#include "splat.h"
#include "types.h"

// The key of a particle at p, camera at c: flush(x) = |x| < 2⁻¹²⁶ ? 0 : x, since devices may or may not keep denormals;
//   d = flush(flush(p) − flush(c)), e = d · scale, q = flush(e · e), s = flush((q.x + q.y) + q.z), every operation
//   rounded once, key = ~bits(min(max(s, 0), greatest float)).
// Where the rays are parallel, depth along the view axis decides: q = flush(e · axis); what lies behind has s = 0.
MOTE_LAYOUT_BEGIN
struct SortPair {
  uint index;  // low word: breaks ties
  uint key;    // high word: 0 is farthest
};
MOTE_BUFFER(SortPairBuffer, SortPair)
MOTE_ASSERT_OFFSET(SortPair, index, 0);
MOTE_ASSERT_OFFSET(SortPair, key, 4);
MOTE_ASSERT_SIZE(SortPair, 8);

// One dispatch of depth_key.comp: pair k gets particle k's key and the index k.
struct DepthKeyParams {
  MOTE_ADDRESS(SplatParticleBuffer) particles;
  MOTE_ADDRESS(SortPairBuffer) pairs;  // out
  vec3 camera;                         // [scene units]
  float scale;                         // power of two near 1 / (greatest distance)
  vec3 axis;                           // orthographic: unit view axis; perspective: 0
  uint count;
};
MOTE_ASSERT_OFFSET(DepthKeyParams, particles, 0);
MOTE_ASSERT_OFFSET(DepthKeyParams, pairs, 8);
MOTE_ASSERT_OFFSET(DepthKeyParams, camera, 16);
MOTE_ASSERT_OFFSET(DepthKeyParams, scale, 28);
MOTE_ASSERT_OFFSET(DepthKeyParams, axis, 32);
MOTE_ASSERT_OFFSET(DepthKeyParams, count, 44);
MOTE_ASSERT_SIZE(DepthKeyParams, 48);

// What a pipeline of bitonic_merge.comp does with the 2^m pairs of an invocation.
MOTE_CONST uint kSortBlocks = 0u;    // sorts them (stride 1)
MOTE_CONST uint kSortFlip = 1u;      // the first m steps of a stage
MOTE_CONST uint kSortDisperse = 2u;  // m later steps of it

// One dispatch of a bitonic_*.comp.
struct SortParams {
  MOTE_ADDRESS(SortPairBuffer) pairs;  // in and out
  MOTE_ADDRESS(UintBuffer) indices;    // out, bitonic_extract.comp only
  uint count;                          // pairs, ≤ 2³⁰; bitonic_merge.comp: slot `count` holds the greatest pair
  uint log2Stride;                     // bitonic_merge.comp only: distance of an invocation's pairs, as a power of two
};
MOTE_ASSERT_OFFSET(SortParams, pairs, 0);
MOTE_ASSERT_OFFSET(SortParams, indices, 8);
MOTE_ASSERT_OFFSET(SortParams, count, 16);
MOTE_ASSERT_OFFSET(SortParams, log2Stride, 20);
MOTE_ASSERT_SIZE(SortParams, 24);
MOTE_LAYOUT_END

#endif
