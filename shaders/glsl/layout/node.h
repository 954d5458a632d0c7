// One node of the flattened tree, shared by TBB and compute (DESIGN §4).
//
// Depth-first order with skip links: the walk goes to the next node where it hits, to `skip` where it misses, and needs
// no stack. A node is a leaf exactly if skip == its own index + 1. The particles of any node are the slots
// [first, nodes[skip].first); one sentinel node (first = number of particles, empty box) ends the array.
#ifndef MOTE_LAYOUT_NODE_H
#define MOTE_LAYOUT_NODE_H
#include "types.h"

MOTE_LAYOUT_BEGIN
struct Node {
  vec3 lo;     // tight box around the *supports* of the particles below, rounded outwards [scene units]
  uint first;  // slot of the first particle
  vec3 hi;
  uint skip;   // index of the next node that is not below this one
};
MOTE_BUFFER(NodeBuffer, Node)
MOTE_ASSERT_OFFSET(Node, lo, 0);
MOTE_ASSERT_OFFSET(Node, first, 12);
MOTE_ASSERT_OFFSET(Node, hi, 16);
MOTE_ASSERT_OFFSET(Node, skip, 28);
MOTE_ASSERT_SIZE(Node, 32);
MOTE_LAYOUT_END

#endif
