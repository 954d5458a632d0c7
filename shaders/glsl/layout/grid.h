// The light grid on the device (engine/passes/light_grid_pass.h): what the grid_*.comp read and write.
//
// Nodes of a tile go in blocks of 4 × 4, bins of depth in groups of 4. A stored block has the optical depths at both edges
// of each of a group's bins for 16 nodes, [bin][row][column]; those of a tile's 4 × 4 nodes that any particle touches
// stand one behind the other, by depth. Block 0 is all zeros: what lies before everything. Shaders load two words at once.
#ifndef MOTE_LAYOUT_GRID_H
#define MOTE_LAYOUT_GRID_H
#include "types.h"

MOTE_LAYOUT_BEGIN
MOTE_CONST uint kBlockEdge = 4u;   // nodes along a block's edge
MOTE_CONST uint kBlockNodes = 16u;
MOTE_CONST uint kBlockBins = 4u;
MOTE_CONST uint kBlockPairs = 64u;
MOTE_CONST uint kTileBlocks = 9u;    // along the edge of a tile of 33 nodes
MOTE_CONST uint kEntriesAtOnce = 4u;

// A particle's kernel: weights F(q) with q = form · (Δx² + Δy² + (Δx·v − Δy·u)²) in nodes, (u, v) where the particle
// stands on the plane one unit from a point light, else 0. Where form is 0 it is a tent over a cell. Where it is curved the
// light is near: (u, v) is the node's, and form is to be divided by 1 + u² + v².
struct GridKernel {
  float x;              // [nodes from the tile's corner]
  float y;
  float depth;          // of the middle [bins from the tile's base]
  float scale;          // of the weights: optical depth; with three channels for a peak of 1
  float form;           // [1 / nodes²]
  float slope;          // 1 / the q from which on weights of the smooth falloff are 0
  float curved;         // 1 or 0
  float inverseRadius;  // [1 / bins]
};
MOTE_ASSERT_OFFSET(GridKernel, x, 0);
MOTE_ASSERT_OFFSET(GridKernel, y, 4);
MOTE_ASSERT_OFFSET(GridKernel, depth, 8);
MOTE_ASSERT_OFFSET(GridKernel, scale, 12);
MOTE_ASSERT_OFFSET(GridKernel, form, 16);
MOTE_ASSERT_OFFSET(GridKernel, slope, 20);
MOTE_ASSERT_OFFSET(GridKernel, curved, 24);
MOTE_ASSERT_OFFSET(GridKernel, inverseRadius, 28);
MOTE_ASSERT_SIZE(GridKernel, 32);

// The particles of one group of bins on 4 × 4 nodes, or some of them: what one lane sums up.
struct GridWork {
  uint first;    // entries; a multiple of kEntriesAtOnce
  uint end;      // > first
  uint sums;     // where its kBlockPairs sums go, [bin][row][column]
  float bin;     // the group's first [bins from the tile's base]
  float column;  // of the first node [nodes from the tile's corner]
  float row;
  float u;       // where that node stands on the plane one unit from a point light; else 0
  float v;
  float inverseRadius;  // of its particles, where all have one
};
MOTE_BUFFER(GridWorkBuffer, GridWork)
MOTE_ASSERT_OFFSET(GridWork, first, 0);
MOTE_ASSERT_OFFSET(GridWork, end, 4);
MOTE_ASSERT_OFFSET(GridWork, sums, 8);
MOTE_ASSERT_OFFSET(GridWork, bin, 12);
MOTE_ASSERT_OFFSET(GridWork, column, 16);
MOTE_ASSERT_OFFSET(GridWork, row, 20);
MOTE_ASSERT_OFFSET(GridWork, u, 24);
MOTE_ASSERT_OFFSET(GridWork, v, 28);
MOTE_ASSERT_OFFSET(GridWork, inverseRadius, 32);
MOTE_ASSERT_SIZE(GridWork, 36);

// Works through the depth over the same 4 × 4 nodes, or some of them. Neighbours may have one stored block.
struct GridStrand {
  uint first;   // works, by their sums
  uint end;     // > first
  uint before;  // the stored block that those before have come to; 0: none
};
MOTE_BUFFER(GridStrandBuffer, GridStrand)
MOTE_ASSERT_OFFSET(GridStrand, first, 0);
MOTE_ASSERT_OFFSET(GridStrand, end, 4);
MOTE_ASSERT_OFFSET(GridStrand, before, 8);
MOTE_ASSERT_SIZE(GridStrand, 12);

// Both edges of a bin on a node's ray: what lies before them.
struct GridPair {
  float before;
  float after;
};
MOTE_BUFFER(GridPairBuffer, GridPair)
MOTE_ASSERT_OFFSET(GridPair, before, 0);
MOTE_ASSERT_OFFSET(GridPair, after, 4);
MOTE_ASSERT_SIZE(GridPair, 8);

// Where a group's depths over a tile's 4 × 4 nodes are: 2 · stored block, + 1 where it is of the group, else of one before.
struct GridPlaces {
  uint here;
  uint right;  // of the next 4 columns
  uint below;  // of the next 4 rows
  uint belowRight;
};
MOTE_BUFFER(GridPlacesBuffer, GridPlaces)
MOTE_ASSERT_OFFSET(GridPlaces, here, 0);
MOTE_ASSERT_OFFSET(GridPlaces, right, 4);
MOTE_ASSERT_OFFSET(GridPlaces, below, 8);
MOTE_ASSERT_OFFSET(GridPlaces, belowRight, 12);
MOTE_ASSERT_SIZE(GridPlaces, 16);

struct GridReceiver {
  float x;     // [nodes from the tile's corner]
  float y;
  float into;  // its bin [bins]
  uint place;  // 4 · where its group's part of the table begins + which of its group's the bin is
};
MOTE_BUFFER(GridReceiverBuffer, GridReceiver)
MOTE_ASSERT_OFFSET(GridReceiver, x, 0);
MOTE_ASSERT_OFFSET(GridReceiver, y, 4);
MOTE_ASSERT_OFFSET(GridReceiver, into, 8);
MOTE_ASSERT_OFFSET(GridReceiver, place, 12);
MOTE_ASSERT_SIZE(GridReceiver, 16);

// One dispatch of a grid_*.comp, of one channel. Kernels and their entries come as texel views.
struct GridParams {
  MOTE_ADDRESS(FloatBuffer) peaks;       // of the kernels: optical depth through the centre; three channels alone
  MOTE_ADDRESS(GridWorkBuffer) works;    // in any order
  MOTE_ADDRESS(FloatBuffer) sums;        // kBlockPairs a work
  MOTE_ADDRESS(UintBuffer) blocks;       // the stored block of each work, by its sums
  MOTE_ADDRESS(GridStrandBuffer) strands;
  MOTE_ADDRESS(GridPairBuffer) stored;   // kBlockPairs a block
  MOTE_ADDRESS(GridPlacesBuffer) table;  // tile by tile, [group][block of the tile]
  MOTE_ADDRESS(GridReceiverBuffer) receivers;
  MOTE_ADDRESS(FloatBuffer) depths;      // in: what each receiver would find of its own particle; out: what it finds
  uint count;                            // of works, strands or receivers
  float cell;                            // [on the plane one unit from a point light]; else 0
};
MOTE_ASSERT_OFFSET(GridParams, peaks, 0);
MOTE_ASSERT_OFFSET(GridParams, works, 8);
MOTE_ASSERT_OFFSET(GridParams, sums, 16);
MOTE_ASSERT_OFFSET(GridParams, blocks, 24);
MOTE_ASSERT_OFFSET(GridParams, strands, 32);
MOTE_ASSERT_OFFSET(GridParams, stored, 40);
MOTE_ASSERT_OFFSET(GridParams, table, 48);
MOTE_ASSERT_OFFSET(GridParams, receivers, 56);
MOTE_ASSERT_OFFSET(GridParams, depths, 64);
MOTE_ASSERT_OFFSET(GridParams, count, 72);
MOTE_ASSERT_OFFSET(GridParams, cell, 76);
MOTE_ASSERT_SIZE(GridParams, 80);
MOTE_LAYOUT_END

#endif
