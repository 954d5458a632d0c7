// Lighting for trees that span more than 256 of their least radii (needs shaderFloat64): see lib/light_walk.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#define MOTE_REBASE 1
#include "lib/light_walk.glsl"
