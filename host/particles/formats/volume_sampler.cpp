#include "host/particles/formats/volume_sampler.h"

#include <algorithm>
#include <cmath>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/particles/spacing.h"

namespace mote {
namespace {

constexpr std::size_t kLeafGrain = 256;
constexpr std::size_t kGrain = 1 << 14;  // fixed, so that sums round alike for any number of threads

/// Dimensions of a particle's random numbers.
enum : std::uint64_t { kStratum, kPlaceX };

std::uint64_t voxelsOf(const Volume::Tile& tile) {
  const auto edge = static_cast<std::uint64_t>(tile.edge);
  return edge * edge * edge;
}

/// Σ over a volume's leaves, then its tiles, of `ofLeaf(values)` and `ofTile(tile)`, running.
template <class OfLeaf, class OfTile>
std::vector<double> runningSums(const Volume& volume, const OfLeaf& ofLeaf, const OfTile& ofTile) {
  std::vector<double> sums(volume.leaves.size() + volume.tiles.size() + 1, 0.0);
  parallelBlocks(volume.leaves.size(), kLeafGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t leaf = begin; leaf < end; ++leaf)
      sums[leaf + 1] = ofLeaf(std::span(volume.values).subspan(leaf * kVolumeLeafVoxels, kVolumeLeafVoxels));
  });
  for (std::size_t t = 0; t < volume.tiles.size(); ++t) sums[volume.leaves.size() + t + 1] = ofTile(volume.tiles[t]);
  for (std::size_t k = 1; k < sums.size(); ++k) sums[k] += sums[k - 1];
  return sums;
}

}  // namespace

double Volume::voxelVolume() const { return std::abs(glm::determinant(linear)); }

double Volume::integral() const {
  const auto ofLeaf = [](std::span<const float> voxelValues) {
    double sum = 0;
    for (const float v : voxelValues) sum += static_cast<double>(v);
    return sum;
  };
  const auto ofTile = [](const Tile& tile) {
    return static_cast<double>(tile.value) * static_cast<double>(voxelsOf(tile));
  };
  return runningSums(*this, ofLeaf, ofTile).back() * voxelVolume();
}

/// What is chosen for a particle.
struct VolumeSampler::Pick {
  ivec3 origin;       ///< least coordinates of the voxel, or of the tile
  std::int32_t edge;  ///< 1, or the tile's
  double root;        ///< √value
  double around;      ///< mean √value of the leaf's voxels that have one
};

VolumeSampler::VolumeSampler(const Volume& volume, std::uint64_t count, std::uint64_t seed)
    : volume_(volume), count_(count), seed_(seed), integral_(volume.integral()), voxelVolume_(volume.voxelVolume()) {
  const auto ofLeaf = [](std::span<const float> values) {
    double sum = 0;
    for (const float v : values) sum += std::sqrt(static_cast<double>(v));
    return sum;
  };
  const auto ofTile = [](const Volume::Tile& tile) {
    return std::sqrt(static_cast<double>(tile.value)) * static_cast<double>(voxelsOf(tile));
  };
  sums_ = runningSums(volume, ofLeaf, ofTile);
  // A particle's share is value · volume / (count · √value / Σ√value), that is √value times what is equal for all.
  std::vector<double> parts((count + kGrain - 1) / kGrain, 0.0);
  parallelBlocks(count, kGrain, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    pick(begin, end, [&](std::uint64_t, const Pick& chosen) { sum += chosen.root; });
    parts[begin / kGrain] = sum;
  });
  double roots = 0;
  for (const double part : parts) roots += part;
  factor_ = integral_ / roots;
}

template <class Take>
void VolumeSampler::pick(std::uint64_t first, std::uint64_t last, const Take& take) const {
  const std::size_t leaves = volume_.leaves.size(), cells = sums_.size() - 1;
  const auto at = [&](std::uint64_t i) {
    const double stratum = static_cast<double>(i) + uniformDouble(hashBits(seed_, i, kStratum));
    return stratum / static_cast<double>(count_) * sums_.back();
  };
  std::size_t cell = cells, voxel = 0;  // of the particle before
  double sum = 0;                       // of √value up to and with the voxel
  Pick chosen{};
  for (std::uint64_t i = first; i < last; ++i) {
    const double here = at(i);
    if (cell == cells || here >= sums_[cell + 1]) {
      const auto above = std::upper_bound(sums_.begin() + 1, sums_.end(), here) - sums_.begin() - 1;
      cell = static_cast<std::size_t>(above);
      // Rounding may take the last of all to the end itself: the last cell that holds anything.
      if (cell == cells)
        cell = static_cast<std::size_t>(std::lower_bound(sums_.begin(), sums_.end(), sums_.back()) - sums_.begin()) - 1;
      if (cell < leaves) {
        const float* values = &volume_.values[cell * kVolumeLeafVoxels];
        const auto held = std::count_if(values, values + kVolumeLeafVoxels, [](float v) { return v > 0; });
        chosen.around = (sums_[cell + 1] - sums_[cell]) / static_cast<double>(held);
        chosen.edge = 1;
        voxel = static_cast<std::size_t>(
            std::find_if(values, values + kVolumeLeafVoxels, [](float v) { return v > 0; }) - values);
        chosen.root = std::sqrt(static_cast<double>(values[voxel]));
        sum = sums_[cell] + chosen.root;
      } else {
        const Volume::Tile& tile = volume_.tiles[cell - leaves];
        chosen.origin = tile.origin, chosen.edge = tile.edge;
        chosen.root = chosen.around = std::sqrt(static_cast<double>(tile.value));
      }
    }
    if (cell < leaves) {
      const float* values = &volume_.values[cell * kVolumeLeafVoxels];
      // On to the voxel whose stretch it is; rounding may leave it behind the last one, which then gets it.
      for (std::size_t next = voxel + 1; here >= sum && next < kVolumeLeafVoxels; ++next)
        if (values[next] > 0) {
          voxel = next;
          chosen.root = std::sqrt(static_cast<double>(values[next]));
          sum += chosen.root;
        }
      chosen.origin = volume_.leaves[cell] + ivec3(voxel >> 6, (voxel >> 3) & 7, voxel & 7);
    }
    take(i, chosen);
  }
}

void VolumeSampler::draw(std::uint64_t first, std::span<VolumeSample> samples) const {
  const double particlesPerRoot = static_cast<double>(count_) / (sums_.back() * voxelVolume_);  // per unit³
  const double leastRadius = std::cbrt(voxelVolume_);
  const double unitRadius = kAutoRadiusFactor * poissonNeighbourDistance(particlesPerRoot);  // where √value is 1
  parallelBlocks(samples.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    pick(first + begin, first + end, [&](std::uint64_t i, const Pick& chosen) {
      VolumeSample& sample = samples[static_cast<std::size_t>(i - first)];
      dvec3 index(0);
      for (int axis = 0; axis < 3; ++axis) {
        const double share = uniformDouble(hashBits(seed_, i, kPlaceX + static_cast<std::uint64_t>(axis)));
        index[axis] = static_cast<double>(chosen.origin[axis]) - 0.5 + share * static_cast<double>(chosen.edge);
      }
      sample.position = volume_.linear * index + volume_.translate;
      sample.density = static_cast<float>(chosen.root * factor_);
      sample.radius =
          static_cast<float>(std::max(leastRadius, unitRadius / std::cbrt(std::max(chosen.root, chosen.around))));
    });
  });
}

}  // namespace mote
