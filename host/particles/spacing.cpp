#include "host/particles/spacing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "host/core/parallel.h"
#include "host/core/random.h"

namespace mote {
namespace {

// Points a bucket: small enough to scan, large enough that the tree above stays in the cache.
constexpr std::size_t kBucketPoints = 512;
constexpr int kMaxDepth = 14;
// Points that place each split plane; with 32 a bucket's size varies by about a fifth.
constexpr std::size_t kSamplesPerBucket = 32;
constexpr std::size_t kGrain = 1 << 16;

/// A k-d tree over buckets: the planes come from a random sample, so that building it is one pass over the points.
class BucketTree {
 public:
  explicit BucketTree(std::span<const vec3> points) {
    while (depth_ < kMaxDepth && (points.size() >> depth_) > kBucketPoints) ++depth_;
    axis_.resize(buckets());
    plane_.resize(buckets());
    placePlanes(points);
    fillBuckets(points);
  }

  /// Mean distance from `query`, one of the points, to its nearest `k` others.
  double meanDistance(const vec3& query, int k) const {
    Nearest nearest(k + 1);  // the query itself is one of them, at distance 0
    visit(1, 0, query, nearest);
    double sum = 0;
    for (int i = 1; i <= k; ++i) sum += std::sqrt(nearest.squared[i]);
    return sum / k;
  }

 private:
  /// The least squared distances, ascending.
  struct Nearest {
    explicit Nearest(int n) : count(n) { std::fill_n(squared, n, std::numeric_limits<double>::infinity()); }
    double worst() const { return squared[count - 1]; }
    void add(double d) {
      int i = count - 1;
      for (; i > 0 && squared[i - 1] > d; --i) squared[i] = squared[i - 1];
      squared[i] = d;
    }
    int count;
    double squared[kSpacingNeighbours + 1];
  };

  std::size_t buckets() const { return std::size_t{1} << depth_; }

  void placePlanes(std::span<const vec3> points) {
    const std::size_t wanted = std::min(points.size(), buckets() * kSamplesPerBucket);
    std::vector<vec3> sample(wanted);
    for (std::size_t i = 0; i < wanted; ++i) {
      const std::size_t begin = i * points.size() / wanted, end = (i + 1) * points.size() / wanted;
      sample[i] = points[begin + hashBits(0x9aceu, i) % (end - begin)];
    }
    split(1, 0, sample);
  }

  void split(std::size_t node, int level, std::span<vec3> sample) {
    if (level == depth_) return;
    Bounds box;
    for (const vec3& p : sample) box.add(p);
    const dvec3 size = dvec3(box.hi) - dvec3(box.lo);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
    std::nth_element(sample.begin(), middle, sample.end(),
                     [axis](const vec3& a, const vec3& b) { return a[axis] < b[axis]; });
    axis_[node] = static_cast<std::uint8_t>(axis);
    plane_[node] = (*middle)[axis];
    split(2 * node, level + 1, {sample.begin(), middle});
    split(2 * node + 1, level + 1, {middle, sample.end()});
  }

  std::uint32_t bucketOf(const vec3& p) const {
    std::size_t node = 1;
    for (int level = 0; level < depth_; ++level) node = 2 * node + (p[axis_[node]] >= plane_[node]);
    return static_cast<std::uint32_t>(node - buckets());
  }

  /// Counting sort; the place of a point depends on its block's counts only, so it is the same for any thread count.
  void fillBuckets(std::span<const vec3> points) {
    const std::size_t grain = std::max(kGrain, points.size() / 64);  // bounds the table of counts
    const std::size_t blocks = (points.size() + grain - 1) / grain;
    std::vector<std::uint16_t> bucket(points.size());
    static_assert(kMaxDepth <= 16);
    std::vector<std::size_t> place(blocks * buckets(), 0);
    parallelBlocks(points.size(), grain, [&](std::size_t begin, std::size_t end) {
      std::size_t* counts = &place[begin / grain * buckets()];
      for (std::size_t i = begin; i < end; ++i) ++counts[bucket[i] = static_cast<std::uint16_t>(bucketOf(points[i]))];
    });
    begin_.resize(buckets() + 1);
    std::size_t sum = 0;
    for (std::size_t b = 0; b < buckets(); ++b) {
      begin_[b] = sum;
      for (std::size_t block = 0; block < blocks; ++block) sum += std::exchange(place[block * buckets() + b], sum);
    }
    begin_[buckets()] = sum;
    points_.resize(points.size());
    parallelBlocks(points.size(), grain, [&](std::size_t begin, std::size_t end) {
      std::size_t* next = &place[begin / grain * buckets()];
      for (std::size_t i = begin; i < end; ++i) points_[next[bucket[i]]++] = points[i];
    });
    boundNodes();
  }

  void boundNodes() {
    box_.resize(2 * buckets());
    parallelBlocks(buckets(), 16, [&](std::size_t first, std::size_t last) {
      for (std::size_t b = first; b < last; ++b)
        for (std::size_t i = begin_[b]; i < begin_[b + 1]; ++i) box_[buckets() + b].add(points_[i]);
    });
    for (std::size_t node = buckets(); node-- > 1;) box_[node].add(box_[2 * node]), box_[node].add(box_[2 * node + 1]);
  }

  double squaredDistance(std::size_t node, const vec3& query) const {
    if (box_[node].empty()) return std::numeric_limits<double>::infinity();
    const dvec3 q(query), gap = glm::max(glm::max(dvec3(box_[node].lo) - q, q - dvec3(box_[node].hi)), dvec3(0));
    return glm::dot(gap, gap);
  }

  void visit(std::size_t node, int level, const vec3& query, Nearest& nearest) const {
    if (level == depth_) return scan(node - buckets(), query, nearest);
    const std::size_t right = query[axis_[node]] >= plane_[node] ? 1 : 0;
    for (const std::size_t child : {2 * node + right, 2 * node + 1 - right})
      if (squaredDistance(child, query) < nearest.worst()) visit(child, level + 1, query, nearest);
  }

  void scan(std::size_t bucket, const vec3& query, Nearest& nearest) const {
    const dvec3 q(query);
    // A bucket of coinciding particles may be as large as the set: once all neighbours are at distance 0 none is
    // nearer.
    for (std::size_t i = begin_[bucket]; i < begin_[bucket + 1] && nearest.worst() > 0; ++i) {
      const dvec3 d = dvec3(points_[i]) - q;
      const double squared = glm::dot(d, d);
      if (squared < nearest.worst()) nearest.add(squared);
    }
  }

  int depth_ = 0;
  std::vector<std::uint8_t> axis_;  // by node, the root is 1, children 2n and 2n+1
  std::vector<float> plane_;
  std::vector<Bounds> box_;         // by node, tight
  std::vector<std::size_t> begin_;  // by bucket
  std::vector<vec3> points_;        // in bucket order
};

}  // namespace

double meanNeighbourDistance(std::span<const vec3> positions, std::size_t maxQueries, std::uint64_t seed) {
  const std::size_t count = positions.size();
  if (count < 2 || maxQueries == 0) return 0;
  const int neighbours = static_cast<int>(std::min<std::size_t>(kSpacingNeighbours, count - 1));
  const std::size_t queries = std::min(count, maxQueries);
  const BucketTree tree(positions);
  std::vector<double> mean(queries);
  parallelBlocks(queries, 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t lo = i * count / queries, hi = (i + 1) * count / queries;
      mean[i] = tree.meanDistance(positions[lo + hashBits(seed, i) % (hi - lo)], neighbours);
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
