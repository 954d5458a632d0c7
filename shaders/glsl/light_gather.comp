// Gathering in single precision throughout: see lib/light_gather.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#define MOTE_EXACT 0
#include "lib/light_gather.glsl"
