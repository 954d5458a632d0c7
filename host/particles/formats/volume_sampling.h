// What the user may say of a grid that is sampled into particles.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

namespace mote {

struct VolumeSampling {
  std::optional<std::uint64_t> count;  ///< particles, ≥ 1; none: as many as voxels above 0, kMostDefaultSamples at most
  std::uint64_t seed = 0;
  std::string grid;  ///< its name in the file; empty: `density`, or the only one
};

/// Beyond it more particles are asked for by number: a file's size should not decide how long a picture takes.
constexpr std::uint64_t kMostDefaultSamples = 1'000'000;

}  // namespace mote
