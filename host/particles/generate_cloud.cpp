// A cumulus: equal particles, their number density after fractal noise in an ellipsoid with a flattened base, like the
// Perlin cloud of the thesis (figure 27; Ebert et al. 2002, "Texturing and Modeling"). Low octaves make its holes and
// towers, high ones are billows: |noise|, whose creases point inwards.
#include <cmath>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/particles/generate.h"
#include "host/particles/noise.h"
#include "host/particles/spacing.h"

namespace mote {
namespace {

constexpr float kLoEdge = 0.0f, kHiEdge = 0.22f;  // the soft edge: density 0 and 1
constexpr int kShapeOctaves = 2, kBillowOctaves = 4;
// Mean optical depth of lines along z through the cloud, whose silhouette is about 1.5 unit²; seeds 1 to 8 come out at
// 5.4 to 6.0.
constexpr double kMeanOpticalDepth = 6, kSilhouette = 1.5;
// Where density is low the spacing is wide; radii beyond this multiple of the densest part's would only blur the edge.
constexpr float kMaxRadiusFactor = 2.5f;

/// Relative number density, 0 to 1, inside [-1, 1]³.
class CloudShape {
 public:
  explicit CloudShape(std::uint64_t seed) {
    for (std::uint64_t k = 0; k < kShapeOctaves + kBillowOctaves; ++k)
      seed_[k] = static_cast<std::uint32_t>(hashBits(seed, k, 0xc10d));
  }

  float density(const vec3& p) const {
    const float y = p.y + 0.28f;
    const vec3 q(p.x / 0.8f, y / (y < 0 ? 0.32f : 0.8f), p.z / 0.72f);
    float s = 0.78f - glm::dot(q, q);
    // What the octaves can still add at most; far outside the rest is not evaluated.
    float left = kShapeGain * 1.5f + kBillowGain * 1.94f * kBillowPeak;
    float frequency = 1.9f, gain = kShapeGain;
    for (int k = 0; k < kShapeOctaves; ++k, frequency *= 2.1f, gain *= 0.5f) {
      if (s + left <= kLoEdge) return 0;
      s += gain * gradientNoise(p * frequency, seed_[k]);
      left -= gain;
    }
    frequency = 4.7f, gain = kBillowGain;
    for (int k = kShapeOctaves; k < kShapeOctaves + kBillowOctaves; ++k, frequency *= 2.07f, gain *= 0.52f) {
      if (s + left <= kLoEdge) return 0;
      s += gain * ((kBillowPeak + kBillowMean) * std::abs(gradientNoise(p * frequency, seed_[k])) - kBillowMean);
      left -= gain * kBillowPeak;
    }
    return smoothStep(kLoEdge, kHiEdge, s);
  }

 private:
  static constexpr float kShapeGain = 0.95f, kBillowGain = 0.42f;
  // An octave of billows adds −mean … peak times its gain; the mean is what keeps the cloud's size.
  static constexpr float kBillowPeak = 1.65f, kBillowMean = 0.55f;
  std::uint32_t seed_[kShapeOctaves + kBillowOctaves];
};

/// Cells of [-1, 1]³ with an estimate of the greatest density in each, and their running sum to draw cells from.
class CellTable {
 public:
  static constexpr int kCells = 64;

  explicit CellTable(const CloudShape& shape)
      : most_(kCells * kCells * kCells), sum_(most_.size() + 1, 0), mean_(kCells, 0) {
    parallelBlocks(kCells, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t z = begin; z < end; ++z) fillSlice(shape, static_cast<int>(z));
    });
    for (std::size_t i = 0; i < most_.size(); ++i) sum_[i + 1] = sum_[i] + static_cast<double>(most_[i]);
    for (const double m : mean_) integral_ += m;
  }

  /// ∫ density over space.
  double integral() const { return integral_; }

  /// A point with density after `most`: cell by its share, place in it uniform. `bound`: the cell's density.
  vec3 draw(Random& random, float& bound) const {
    const double at = random.uniform() * sum_.back();
    std::size_t cell = static_cast<std::size_t>(std::upper_bound(sum_.begin(), sum_.end(), at) - sum_.begin()) - 1;
    cell = std::min(cell, most_.size() - 1);
    bound = most_[cell];
    const std::size_t x = cell % kCells, y = cell / kCells % kCells, z = cell / (kCells * kCells);
    const double px = static_cast<double>(x) + random.uniform(), py = static_cast<double>(y) + random.uniform(),
                 pz = static_cast<double>(z) + random.uniform();
    return vec3(dvec3(px, py, pz) * (2.0 / kCells) - 1.0);
  }

 private:
  void fillSlice(const CloudShape& shape, int z) {
    constexpr float kSize = 2.0f / kCells;
    double sum = 0;
    for (int y = 0; y < kCells; ++y)
      for (int x = 0; x < kCells; ++x) {
        const vec3 lo = vec3(x, y, z) * kSize - 1.0f;
        float most = 0;
        for (int k = 0; k < 9; ++k) {  // centre, then the points half-way to the corners
          const vec3 offset =
              k == 0 ? vec3(0.5f) : vec3(k & 1 ? 0.75f : 0.25f, k & 2 ? 0.75f : 0.25f, k & 4 ? 0.75f : 0.25f);
          const float d = shape.density(lo + offset * kSize);
          most = std::max(most, d);
          sum += static_cast<double>(d) / 9;
        }
        // The density moves by less than this within a quarter of a cell; what exceeds it all the same is cut, unseen.
        most_[(static_cast<std::size_t>(z) * kCells + y) * kCells + x] = most > 0 ? std::min(1.0f, most + 0.3f) : 0;
      }
    mean_[static_cast<std::size_t>(z)] =
        sum * static_cast<double>(kSize) * static_cast<double>(kSize) * static_cast<double>(kSize);
  }

  std::vector<float> most_;
  std::vector<double> sum_, mean_;
  double integral_ = 0;
};

}  // namespace

ParticleSet generateCloud(std::uint64_t count, std::uint64_t seed) {
  const CloudShape shape(seed);
  const CellTable cells(shape);
  ParticleSet set;
  set.position.resize(count);
  set.radius.resize(count);
  set.id.resize(count);
  const double densest = static_cast<double>(count) / cells.integral();  // particles per unit³ where the density is 1
  const auto leastRadius = static_cast<float>(kAutoRadiusFactor * poissonNeighbourDistance(densest));
  parallelBlocks(count, 1 << 12, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Random random(seed, i);
      vec3 p;
      float bound = 0, density = 0;
      do {  // every cell with a bound holds density, so this ends; about 1.6 tries
        p = cells.draw(random, bound);
        density = shape.density(p);
      } while (density <= random.uniform() * static_cast<double>(bound));
      set.position[i] = p;
      set.radius[i] = leastRadius * std::min(kMaxRadiusFactor, 1 / std::cbrt(density));
      set.id[i] = i;
    }
  });
  set.density.assign(count, static_cast<float>(kMeanOpticalDepth * kSilhouette / static_cast<double>(count)));
  return set;
}

}  // namespace mote
