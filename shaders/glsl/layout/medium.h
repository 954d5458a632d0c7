// Codes of the medium's choices, as host and shaders pass them (DESIGN §2).
#ifndef MOTE_LAYOUT_MEDIUM_H
#define MOTE_LAYOUT_MEDIUM_H
#include "types.h"

MOTE_LAYOUT_BEGIN
// Falloff F(q) = W(b) / W(0) of the optical depth, q = b² / r² in [0, 1).
MOTE_CONST uint kFalloffSmooth = 0u;  // (1 − q)²
MOTE_CONST uint kFalloffLinear = 1u;  // 1 − √q
MOTE_CONST uint kFalloffSphere = 2u;  // √(1 − q)

// What happens to particles that straddle an end of the segment particle → light.
MOTE_CONST uint kEndpointSoft = 0u;   // the share of the particle that lies between (cap function)
MOTE_CONST uint kEndpointClamp = 1u;  // distance to the segment, whole optical depth (thesis, algorithm 3)
MOTE_LAYOUT_END

#endif
