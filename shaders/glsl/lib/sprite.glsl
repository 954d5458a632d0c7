// Maps over a splat, bilinear between texel centres and clamped at the edges. C++ twin: host/splat/sprite.h.
#ifndef MOTE_LIB_SPRITE_GLSL
#define MOTE_LIB_SPRITE_GLSL
#include "../layout/splat_scene.h"

struct Texels {
  uint a, b, c, d;  // upper left, upper right, lower left, lower right
  float x, y;       // weights of the right and of the lower ones
};

Texels texelsAt(vec2 point, uint width, uint height) {
  precise float x = clamp((0.5 + 0.5 * point.x) * float(width) - 0.5, 0.0, float(width) - 1.0);
  precise float y = clamp((0.5 - 0.5 * point.y) * float(height) - 0.5, 0.0, float(height) - 1.0);
  const uint left = uint(x), top = uint(y);
  const uint right = min(left + 1, width - 1), bottom = min(top + 1, height - 1);
  Texels t;
  t.a = top * width + left, t.b = top * width + right, t.c = bottom * width + left, t.d = bottom * width + right;
  t.x = x - float(left), t.y = y - float(top);
  return t;
}

vec3 spriteColorAt(SplatScene scene, vec2 point) {
  const Texels t = texelsAt(point, scene.spriteColorWidth, scene.spriteColorHeight);
  precise vec3 upper = scene.spriteColor.at[t.a].rgb * (1.0 - t.x) + scene.spriteColor.at[t.b].rgb * t.x;
  precise vec3 lower = scene.spriteColor.at[t.c].rgb * (1.0 - t.x) + scene.spriteColor.at[t.d].rgb * t.x;
  precise vec3 color = upper * (1.0 - t.y) + lower * t.y;
  return color;
}

float spriteOpacityAt(SplatScene scene, vec2 point) {
  const Texels t = texelsAt(point, scene.spriteOpacityWidth, scene.spriteOpacityHeight);
  precise float upper = scene.spriteOpacity.at[t.a] * (1.0 - t.x) + scene.spriteOpacity.at[t.b] * t.x;
  precise float lower = scene.spriteOpacity.at[t.c] * (1.0 - t.x) + scene.spriteOpacity.at[t.d] * t.x;
  precise float opacity = upper * (1.0 - t.y) + lower * t.y;
  return opacity;
}

#endif
