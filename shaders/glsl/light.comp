// Lighting in single precision throughout: see lib/light_walk.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#define MOTE_REBASE 0
#include "lib/light_walk.glsl"
