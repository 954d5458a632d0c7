// Morton order: the octree's cells as 63-bit numbers, three bits a level.
#pragma once
#include <cstdint>

#include "host/core/vec.h"

namespace mote {

/// Levels of the octree below its root: 21 bits an axis fill 63 bits.
constexpr int kMortonLevels = 21;

/// Moves bit i of a 21-bit number to bit 3·i.
constexpr std::uint64_t spreadBits(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffffull;
  x = (x | x << 16) & 0x001f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

/// Maps points of a cube to Morton codes.
class MortonGrid {
 public:
  /// The cube around `bounds`; a single point gives a cube of edge 0 and the code 0 for everything.
  explicit MortonGrid(const Bounds& bounds) : origin_(bounds.lo) {
    const dvec3 size = dvec3(bounds.hi) - dvec3(bounds.lo);
    const double edge = std::max({size.x, size.y, size.z});
    scale_ = edge > 0 ? kCells / edge : 0;
  }

  std::uint64_t code(const vec3& point) const {
    return spreadBits(cell(point.x, origin_.x)) << 2 | spreadBits(cell(point.y, origin_.y)) << 1 |
           spreadBits(cell(point.z, origin_.z));
  }

 private:
  static constexpr double kCells = 1 << kMortonLevels;
  std::uint64_t cell(float value, double origin) const {
    return static_cast<std::uint64_t>(std::clamp((value - origin) * scale_, 0.0, kCells - 1));
  }
  dvec3 origin_;
  double scale_;
};

}  // namespace mote
