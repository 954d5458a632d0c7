#include "host/splat/small_splats.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "host/core/parallel.h"
#include "host/splat/footprint.h"

namespace mote {
namespace {

/// True for nearly all that are small, never for others. A ball that is farther from the camera's plane than eight of
/// its radii is at most 2.7 r · √(1 + tan²) / z wide on the plane at depth 1: with δ the angle that it is seen under
/// and θ that of its middle with the axis, tan(θ + δ) − tan(θ − δ) = sin 2δ / (cos(θ + δ) · cos(θ − δ)). Three pixels
/// more are room for whole pixels and slack.
bool surelySmall(const layout::SplatParticle& particle, const layout::SplatCamera& camera, float side) {
  const vec3 p = particle.position - camera.position;
  const float z = glm::dot(p, camera.forward);
  const float radius = std::max(particle.radius, camera.minRadius * camera.pixelSize * z);
  return radius < z / 8 && 2.7f * radius * glm::length(p) <= (side - 3) * camera.pixelSize * (z * z);
}

bool isSmall(const layout::SplatParticle& particle, const layout::SplatCamera& camera, float side) {
  if (surelySmall(particle, camera, side)) return true;
  Footprint f;
  if (!makeFootprint(particle.position, particle.radius, camera, f)) return true;
  const vec2 size = glm::floor(f.hi + 0.5f) - glm::ceil(glm::max(f.lo - 0.5f, vec2(0)));
  return std::max(size.x, size.y) <= side;
}

}  // namespace

std::uint32_t smallSplatsFirst(std::span<const layout::SplatParticle> particles, const layout::SplatCamera& camera,
                               float keyScale, float side) {
  constexpr std::size_t kGrain = 1 << 14;
  constexpr layout::uint kNone = std::numeric_limits<layout::uint>::max();
  const vec3 axis = viewAxis(camera);
  const auto keyOf = [&](std::size_t i) { return depthKey(particles[i].position, camera.position, keyScale, axis); };
  const std::size_t blocks = (particles.size() + kGrain - 1) / kGrain;
  std::vector<layout::uint> firstLarge(blocks, kNone);  // keys
  parallelBlocks(particles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    layout::uint& first = firstLarge[begin / kGrain];
    for (std::size_t i = begin; i < end; ++i)
      if (!isSmall(particles[i], camera, side)) first = std::min(first, keyOf(i));
  });
  const layout::uint first = firstLarge.empty() ? kNone : *std::min_element(firstLarge.begin(), firstLarge.end());
  if (first == kNone) return static_cast<std::uint32_t>(particles.size());
  std::vector<std::uint32_t> before(blocks, 0);
  parallelBlocks(particles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) before[begin / kGrain] += keyOf(i) < first;
  });
  std::uint32_t sum = 0;
  for (const std::uint32_t count : before) sum += count;
  return sum;
}

}  // namespace mote
