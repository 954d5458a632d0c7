// Random numbers as a function of (seed, index, dimension): no state, so any order and any thread gives the same.
#pragma once
#include <cstdint>

#include "host/core/vec.h"

namespace mote {

/// 64-bit finaliser of SplitMix64 (Steele, Lea and Flood 2014): every input bit reaches every output bit.
constexpr std::uint64_t mixBits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// Hash of a stream's seed, an item and a dimension.
constexpr std::uint64_t hashBits(std::uint64_t seed, std::uint64_t index, std::uint64_t dimension = 0) {
  return mixBits(mixBits(mixBits(seed) ^ index) ^ (dimension * 0xd1342543de82ef95ull));
}

/// Uniform in [0, 1), 24 bits, exactly representable as float.
constexpr float uniformFloat(std::uint64_t bits) { return static_cast<float>(bits >> 40) * 0x1p-24f; }
/// Uniform in [0, 1), 53 bits.
constexpr double uniformDouble(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

/// A counted sequence for code that draws many numbers for one item.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t index = 0) : state_(hashBits(seed, index)) {}
  std::uint64_t bits() { return mixBits(state_ += 0x9e3779b97f4a7c15ull); }
  double uniform() { return uniformDouble(bits()); }
  double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  /// Uniform on the unit sphere.
  dvec3 direction();
  /// Standard normal (Box and Muller 1958).
  double normal();

 private:
  std::uint64_t state_;
};

}  // namespace mote
