#include "host/particles/particle_set.h"

#include <vector>

#include "host/core/parallel.h"

namespace mote {
namespace {

// A block is large enough to hide its start, and fixed, so that sums round alike for any number of threads.
constexpr std::size_t kBlock = 1 << 16;

template <class Partial, class Body>
std::vector<Partial> blockResults(std::size_t count, const Body& body) {
  std::vector<Partial> partial((count + kBlock - 1) / kBlock);
  parallelBlocks(count, kBlock,
                 [&](std::size_t begin, std::size_t end) { partial[begin / kBlock] = body(begin, end); });
  return partial;
}

Bounds joined(const std::vector<Bounds>& parts) {
  Bounds all;
  for (const Bounds& part : parts) all.add(part);
  return all;
}

}  // namespace

Bounds ParticleSet::bounds() const {
  return joined(blockResults<Bounds>(size(), [&](std::size_t begin, std::size_t end) {
    Bounds box;
    for (std::size_t i = begin; i < end; ++i) box.add(position[i]);
    return box;
  }));
}

Bounds ParticleSet::supportBounds() const {
  return joined(blockResults<Bounds>(size(), [&](std::size_t begin, std::size_t end) {
    Bounds box;
    for (std::size_t i = begin; i < end; ++i) {
      box.add(position[i] - vec3(radius[i]));
      box.add(position[i] + vec3(radius[i]));
    }
    return box;
  }));
}

RadiusRange radiusRange(const ParticleSet& set) {
  struct Partial {
    float min, max;
    double sum;
  };
  if (set.radius.empty()) return {};
  const auto parts = blockResults<Partial>(set.radius.size(), [&](std::size_t begin, std::size_t end) {
    Partial part{set.radius[begin], set.radius[begin], 0};
    for (std::size_t i = begin; i < end; ++i) {
      part.min = std::min(part.min, set.radius[i]);
      part.max = std::max(part.max, set.radius[i]);
      part.sum += set.radius[i];
    }
    return part;
  });
  Partial all{parts[0].min, parts[0].max, 0};
  for (const Partial& part : parts) {
    all.min = std::min(all.min, part.min);
    all.max = std::max(all.max, part.max);
    all.sum += part.sum;
  }
  return {all.min, static_cast<float>(all.sum / static_cast<double>(set.radius.size())), all.max};
}

}  // namespace mote
