// Gathering where particles lie far from a column's middle (needs shaderFloat64): see lib/light_gather.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#define MOTE_EXACT 1
#include "lib/light_gather.glsl"
