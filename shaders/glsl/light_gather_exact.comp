// Gathering for columns of more than 256 least radii (needs shaderFloat64): see lib/light_gather.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#define MOTE_EXACT 1
#include "lib/light_gather.glsl"
