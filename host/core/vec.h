// Vector types of the host (glm), and the axis-aligned box.
#pragma once
#include <glm/glm.hpp>

#include <algorithm>
#include <limits>

namespace mote {

using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using glm::ivec2;
using glm::mat4;
using glm::vec2;
using glm::vec3;
using glm::vec4;

constexpr double kPi = 3.14159265358979323846;

/// Axis-aligned box; empty until something is added (lo > hi).
struct Bounds {
  vec3 lo{std::numeric_limits<float>::infinity()};
  vec3 hi{-std::numeric_limits<float>::infinity()};

  bool empty() const { return !(lo.x <= hi.x); }
  void add(const vec3& point) { lo = glm::min(lo, point), hi = glm::max(hi, point); }
  void add(const Bounds& other) { lo = glm::min(lo, other.lo), hi = glm::max(hi, other.hi); }
  vec3 centre() const { return 0.5f * lo + 0.5f * hi; }
  vec3 size() const { return empty() ? vec3(0) : hi - lo; }
};

}  // namespace mote
