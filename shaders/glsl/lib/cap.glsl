// The share of a particle that lies before a point of a ray that passes it. C++ twin: host/core/cap.h.
#ifndef MOTE_LIB_CAP_GLSL
#define MOTE_LIB_CAP_GLSL

float cap(float t, float halfChord) {
  const float x = clamp(t / max(halfChord, 1e-30), -1.0, 1.0);
  return 0.5 + x * (0.75 - 0.25 * (x * x));
}

#endif
