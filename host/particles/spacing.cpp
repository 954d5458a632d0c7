#include "host/particles/spacing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nanoflann.hpp>
#include <vector>

#include "host/core/parallel.h"
#include "host/core/random.h"

namespace mote {
namespace {

// nanoflann builds a tree on one thread; several smaller ones are built at once and each fits the cache better. Every
// query asks all of them, which costs the less the nearer the neighbours are that it already has.
constexpr std::size_t kTreePoints = 1 << 18;
constexpr std::size_t kLeafPoints = 32;

/// Points as nanoflann takes them, in double: differences of floats then round nowhere.
struct PointCloud {
  std::span<const vec3> points;

  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::uint32_t i, std::size_t axis) const {
    return static_cast<double>(points[i][static_cast<int>(axis)]);
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;  // it finds the box itself
  }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointCloud>, PointCloud, 3, std::uint32_t>;

/// A part of the points and its tree.
struct Part {
  PointCloud cloud;
  Tree tree;

  explicit Part(std::span<const vec3> points)
      : cloud{points}, tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafPoints)) {}
};

/// The least squared distances, ascending: what nanoflann's searches fill.
class Nearest {
 public:
  explicit Nearest(int count) : count_(count) { std::fill_n(squared_, count, kNone); }

  bool full() const { return worstDist() < kNone; }
  double worstDist() const { return squared_[count_ - 1]; }
  /// Returns whether the search shall go on: coinciding particles may be as many as there are, and once all neighbours
  /// are at distance 0 none is nearer.
  bool addPoint(double squared, std::uint32_t) {
    if (squared < worstDist()) {
      int i = count_ - 1;
      for (; i > 0 && squared_[i - 1] > squared; --i) squared_[i] = squared_[i - 1];
      squared_[i] = squared;
    }
    return worstDist() > 0;
  }
  /// Of all but the first, which is the query itself, at distance 0.
  double mean() const {
    double sum = 0;
    for (int i = 1; i < count_; ++i) sum += std::sqrt(squared_[i]);
    return sum / (count_ - 1);
  }

 private:
  static constexpr double kNone = std::numeric_limits<double>::max();
  int count_;
  double squared_[kSpacingNeighbours + 1];
};

std::vector<std::unique_ptr<Part>> partsOf(std::span<const vec3> positions) {
  std::vector<std::unique_ptr<Part>> parts((positions.size() + kTreePoints - 1) / kTreePoints);
  parallelBlocks(positions.size(), kTreePoints, [&](std::size_t begin, std::size_t end) {
    parts[begin / kTreePoints] = std::make_unique<Part>(positions.subspan(begin, end - begin));
  });
  return parts;
}

/// Mean distance from the particle to its nearest `neighbours` others. Its own part is asked first: files often have
/// neighbours near each other.
double meanDistance(const std::vector<std::unique_ptr<Part>>& parts, std::span<const vec3> positions,
                    std::size_t particle, int neighbours) {
  const dvec3 query(positions[particle]);
  const std::size_t own = particle / kTreePoints;
  Nearest nearest(neighbours + 1);
  for (std::size_t k = 0; k < parts.size() && nearest.worstDist() > 0; ++k)
    parts[(own + k) % parts.size()]->tree.findNeighbors(nearest, &query.x, nanoflann::SearchParams());
  return nearest.mean();
}

}  // namespace

double meanNeighbourDistance(std::span<const vec3> positions, std::size_t maxQueries, std::uint64_t seed) {
  const std::size_t count = positions.size();
  if (count < 2 || maxQueries == 0) return 0;
  const int neighbours = static_cast<int>(std::min<std::size_t>(kSpacingNeighbours, count - 1));
  const std::size_t queries = std::min(count, maxQueries);
  const std::vector<std::unique_ptr<Part>> parts = partsOf(positions);
  std::vector<double> mean(queries);
  parallelBlocks(queries, 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t lo = i * count / queries, hi = (i + 1) * count / queries;
      mean[i] = meanDistance(parts, positions, lo + hashBits(seed, i) % (hi - lo), neighbours);
    }
  });
  double sum = 0;
  for (const double m : mean) sum += m;
  return sum / static_cast<double>(queries);
}

double poissonNeighbourDistance(double numberDensity) {
  constexpr int k = kSpacingNeighbours;
  // Σ Γ(j+1/3)/Γ(j), j = 1 … k, telescopes to Γ(k+4/3) / (4/3 · Γ(k)).
  const double meanFactor = std::tgamma(k + 4.0 / 3) / (4.0 / 3 * std::tgamma(k)) / k;
  return meanFactor * std::cbrt(3 / (4 * kPi * numberDensity));
}

}  // namespace mote
