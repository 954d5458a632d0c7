// The share of a particle that lies before a point of a ray that passes it (DESIGN §2), for lighting's ends and for
// surfaces in the view. The GLSL twin is shaders/glsl/lib/cap.glsl.
#pragma once
#include <algorithm>

namespace mote {

/// Share of a particle with half chord c that lies on the positive side of a point at distance t before its middle:
/// 0 for t ≤ −c, ½ + ¾x − ¼x³ with x = t/c, 1 for t ≥ c.
inline float cap(float t, float halfChord) {
  // The least half chord keeps 0/0 away; a support that is only grazed weighs nothing anyway.
  const float x = std::min(std::max(t / std::max(halfChord, 1e-30f), -1.0f), 1.0f);
  return 0.5f + x * (0.75f - 0.25f * (x * x));
}

}  // namespace mote
