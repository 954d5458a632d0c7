// Gradient noise (Perlin 2002) on an integer lattice with hashed gradients, for the generators.
#pragma once
#include <cmath>
#include <cstdint>

#include "host/core/vec.h"

namespace mote {

/// Hash of a lattice point; enough for gradients, four multiplications.
inline std::uint32_t latticeHash(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t seed) {
  std::uint32_t h = seed ^ (static_cast<std::uint32_t>(x) * 0x8da6b343u) ^
                    (static_cast<std::uint32_t>(y) * 0xd8163841u) ^ (static_cast<std::uint32_t>(z) * 0xcb1ab31fu);
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  return h ^ (h >> 15);
}

/// One of the 12 edge directions of a cube (4 of them twice) times the offset.
inline float latticeGradient(std::uint32_t hash, float x, float y, float z) {
  const std::uint32_t h = hash & 15u;
  const float u = h < 8 ? x : y, v = h < 4 ? y : (h == 12 || h == 14 ? x : z);
  return ((h & 1u) ? -u : u) + ((h & 2u) ? -v : v);
}

/// Noise in about [-1, 1], zero at lattice points, twice differentiable. |coordinates| < 2³¹. About 20 ns.
inline float gradientNoise(const vec3& p, std::uint32_t seed) {
  const vec3 base = glm::floor(p), f = p - base;
  const auto x = static_cast<std::int32_t>(base.x), y = static_cast<std::int32_t>(base.y),
             z = static_cast<std::int32_t>(base.z);
  const vec3 w = f * f * f * (f * (f * 6.0f - 15.0f) + 10.0f);
  const auto corner = [&](int i, int j, int k) {
    return latticeGradient(latticeHash(x + i, y + j, z + k, seed), f.x - static_cast<float>(i),
                           f.y - static_cast<float>(j), f.z - static_cast<float>(k));
  };
  const auto alongX = [&](int j, int k) {
    const float a = corner(0, j, k), b = corner(1, j, k);
    return a + w.x * (b - a);
  };
  const float a = alongX(0, 0), b = alongX(1, 0), c = alongX(0, 1), d = alongX(1, 1);
  const float front = a + w.y * (b - a), back = c + w.y * (d - c);
  return front + w.z * (back - front);
}

/// 0 below `lo`, 1 above `hi`, a smooth step between.
inline float smoothStep(float lo, float hi, float x) {
  const float t = glm::clamp((x - lo) / (hi - lo), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

}  // namespace mote
