// A scalar volume on a sparse grid, as readers of OpenVDB and NanoVDB fill it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "host/core/vec.h"

namespace mote {

using glm::dmat3;
using glm::ivec3;

/// Voxels along a leaf's edge, and in it; voxel (x, y, z) of a leaf stands at 64x + 8y + z.
constexpr std::int32_t kVolumeLeafEdge = 8;
constexpr std::size_t kVolumeLeafVoxels = 512;

/// A voxel's sample stands at its integer coordinates: the voxel is the cube of edge 1 around them.
struct Volume {
  /// A cube of equal voxels, `edge` along each side, whose least coordinates are `origin`.
  struct Tile {
    ivec3 origin;
    std::int32_t edge;
    float value;
  };

  std::string grid;              ///< its name
  dmat3 linear{1};               ///< of voxels in the world: world = linear · index + translate
  dvec3 translate{0};            ///< …
  std::vector<ivec3> leaves;     ///< least coordinates
  std::vector<float> values;     ///< kVolumeLeafVoxels a leaf; 0: nothing is there, which includes inactive voxels
  std::vector<Tile> tiles;       ///< active ones with a value > 0
  std::uint64_t voxels = 0;      ///< active, those in tiles too
  std::uint64_t tileVoxels = 0;  ///< active, in tiles
  std::uint64_t held = 0;        ///< active, with a value > 0
  std::uint64_t dropped = 0;     ///< active, but of a value that is no density: negative or not finite; counted as 0

  /// Adds an active leaf's values: `value(k)` where bit k of `isActive(k)` is set.
  template <class IsActive, class Value>
  void addLeaf(const ivec3& origin, const IsActive& isActive, const Value& value) {
    leaves.push_back(origin);
    values.resize(values.size() + kVolumeLeafVoxels, 0.0f);
    float* to = &values[values.size() - kVolumeLeafVoxels];
    for (std::size_t k = 0; k < kVolumeLeafVoxels; ++k)
      if (isActive(k)) ++voxels, to[k] = density(value(k), 1);
  }
  /// Adds an active tile.
  void addTile(const ivec3& origin, std::int32_t edge, double value) {
    const std::uint64_t inside = std::uint64_t(edge) * std::uint64_t(edge) * std::uint64_t(edge);
    voxels += inside, tileVoxels += inside;
    if (const float kept = density(value, inside); kept > 0) tiles.push_back({origin, edge, kept});
  }

  /// |det linear| [scene units³].
  double voxelVolume() const;
  /// Σ value · volume over all voxels, in double.
  double integral() const;

 private:
  float density(double value, std::uint64_t inside) {
    const float kept = static_cast<float>(value);
    const bool isDensity = kept >= 0 && kept <= std::numeric_limits<float>::max();  // no NaN
    if (!isDensity) dropped += inside;
    if (isDensity && kept > 0) held += inside;
    return isDensity ? kept : 0;
  }
};

}  // namespace mote
