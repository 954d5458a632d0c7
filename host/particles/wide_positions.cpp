#include "host/particles/wide_positions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/core/parallel.h"
#include "host/scene/origin.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 15;

struct Box {
  dvec3 lo{std::numeric_limits<double>::infinity()}, hi{-std::numeric_limits<double>::infinity()};

  void add(const dvec3& from, const dvec3& to) { lo = glm::min(lo, from), hi = glm::max(hi, to); }
};

bool fitsFloats(const dvec3& v) {
  constexpr double kMost = std::numeric_limits<float>::max();
  return std::abs(v.x) <= kMost && std::abs(v.y) <= kMost && std::abs(v.z) <= kMost;  // false for what is no number
}

Box boxOf(std::span<const dvec3> positions) {
  std::vector<Box> boxes((positions.size() + kGrain - 1) / kGrain);
  parallelBlocks(positions.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (fitsFloats(positions[i])) boxes[begin / kGrain].add(positions[i], positions[i]);
  });
  Box all;
  for (const Box& box : boxes) all.add(box.lo, box.hi);
  return all;
}

}  // namespace

bool isWide(NumberType type) { return numberSize(type) >= 4 && type != NumberType::F32; }

dvec3 toFloats(std::span<const dvec3> wide, std::vector<vec3>& floats) {
  const Box box = boxOf(wide);
  const dvec3 centre = box.lo.x <= box.hi.x ? originOf(box.lo, box.hi) : dvec3(0);
  floats.resize(wide.size());
  parallelBlocks(wide.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) floats[i] = vec3(wide[i] - centre);
  });
  return centre;
}

}  // namespace mote
