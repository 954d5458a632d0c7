#include <tbb/parallel_sort.h>

#include <bit>
#include <cmath>

#include "host/core/parallel.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

/// Devices may keep denormals or not: treating them as 0 after each operation that can make one gives the same key.
float flush(float x) { return std::fabs(x) < std::numeric_limits<float>::min() ? 0.0f : x; }
vec3 flush(const vec3& v) { return {flush(v.x), flush(v.y), flush(v.z)}; }

}  // namespace

vec3 viewAxis(const layout::SplatCamera& camera) { return camera.orthographic != 0 ? camera.forward : vec3(0); }

layout::uint depthKey(const vec3& particle, const vec3& camera, float scale, const vec3& axis) {
  const vec3 d = flush(flush(particle) - flush(camera));
  const vec3 e = d * scale;
  const vec3 q = flush(e * (axis == vec3(0) ? e : axis));
  const float sum = (q.x + q.y) + q.z;
  constexpr float kLeast = std::numeric_limits<float>::min(), kGreatest = std::numeric_limits<float>::max();
  const float s = sum >= kLeast ? std::min(sum, kGreatest) : 0.0f;
  return ~std::bit_cast<layout::uint>(s);  // bits of floats ≥ 0 ascend with them
}

float depthKeyScale(const Bounds& centres, const vec3& camera) {
  if (centres.empty()) return 1;
  // Farthest corner, in double: no overflow for any float scene.
  const dvec3 reach =
      glm::max(glm::abs(dvec3(centres.lo) - dvec3(camera)), glm::abs(dvec3(centres.hi) - dvec3(camera)));
  const double distance = glm::length(reach);
  if (!(distance > 0) || !std::isfinite(distance)) return 1;
  int exponent = 0;
  std::frexp(distance, &exponent);                            // distance = m · 2^exponent, m in [½, 1)
  return std::ldexp(1.0f, std::clamp(-exponent, -126, 127));  // a normal float whatever the distance
}

std::vector<layout::uint> sortByDepth(std::span<const layout::SplatParticle> particles,
                                      const layout::SplatCamera& camera, float scale) {
  // (key, index) as one number: all different, so any correct sort gives the one order, that of a stable sort.
  std::vector<std::uint64_t> pairs(particles.size());
  const vec3 axis = viewAxis(camera);
  constexpr std::size_t kGrain = 16384;
  parallelBlocks(particles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      pairs[i] = std::uint64_t{depthKey(particles[i].position, camera.position, scale, axis)} << 32 | i;
  });
  tbb::parallel_sort(pairs.begin(), pairs.end());
  std::vector<layout::uint> order(particles.size());
  parallelBlocks(particles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) order[i] = static_cast<layout::uint>(pairs[i]);
  });
  return order;
}

}  // namespace mote
