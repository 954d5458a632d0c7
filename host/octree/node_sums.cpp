#include "host/octree/node_sums.h"

#include <algorithm>
#include <limits>

#include "host/core/parallel.h"

namespace mote {
namespace {

/// Leaves a task: a few thousand particles.
constexpr std::size_t kGrain = 128;

/// Weighted means of parts, whatever the parts are. The first pass finds the means, the second what lies about them.
class Moments {
 public:
  void addMean(double mass, const dvec3& centre, double area, double least) {
    mass_ += mass;
    centroid_ += mass * centre, area_ += mass * area;
    least_ = std::min(least_, least);
  }
  /// False where nothing has any mass.
  bool divide() {
    if (!(mass_ > 0)) return false;
    centroid_ /= mass_, area_ /= mass_;
    return true;
  }
  void addSpread(double mass, const dvec3& centre, double area, double spread, double areaSpread) {
    const dvec3 offset = centre - centroid_;
    spread_ += mass * (spread + glm::dot(offset, offset));
    areaSpread_ += mass * (areaSpread + (area - area_) * (area - area_));
  }
  NodeSums result() const {
    return {static_cast<float>(mass_),           vec3(centroid_),
            static_cast<float>(spread_ / mass_), static_cast<float>(area_),
            static_cast<float>(least_),          static_cast<float>(areaSpread_ / mass_)};
  }

 private:
  double mass_ = 0, area_ = 0, spread_ = 0, areaSpread_ = 0, least_ = std::numeric_limits<double>::infinity();
  dvec3 centroid_{0};
};

/// Of an inner node, out of its children's.
NodeSums sumsOfChildren(const Octree& tree, const std::vector<NodeSums>& sums, std::uint32_t node) {
  const auto eachChild = [&](const auto& body) {
    for (std::uint32_t child = node + 1; child < tree.nodes[node].skip; child = tree.nodes[child].skip)
      if (sums[child].mass > 0) body(sums[child]);
  };
  Moments moments;
  eachChild([&](const NodeSums& s) { moments.addMean(s.mass, dvec3(s.centroid), s.area, s.leastArea); });
  if (!moments.divide()) return {};
  eachChild([&](const NodeSums& s) { moments.addSpread(s.mass, dvec3(s.centroid), s.area, s.spread, s.areaSpread); });
  return moments.result();
}

}  // namespace

NodeSums sumsOf(const Octree& tree, std::size_t channel, std::size_t begin, std::size_t end) {
  const std::vector<float>& peak = channel == 0 ? tree.peak : channel == 1 ? tree.peakGreen : tree.peakBlue;
  const auto each = [&](const auto& body) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const double area = double(tree.radius[slot]) * double(tree.radius[slot]), mass = peak[slot] * area;
      if (mass > 0) body(mass, dvec3(tree.position(slot)), area);
    }
  };
  Moments moments;
  each([&](double mass, const dvec3& centre, double area) { moments.addMean(mass, centre, area, area); });
  if (!moments.divide()) return {};
  each([&](double mass, const dvec3& centre, double area) { moments.addSpread(mass, centre, area, 0, 0); });
  return moments.result();
}

TreeSums nodeSums(const Octree& tree) {
  TreeSums sums;
  const std::size_t nodes = tree.nodeCount();
  const auto isLeaf = [&](std::size_t node) { return tree.nodes[node].skip == node + 1; };
  for (std::size_t channel = 0; channel < tree.channels(); ++channel) {
    std::vector<NodeSums>& of = sums[channel];
    of.resize(nodes);
    parallelBlocks(nodes, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t node = begin; node < end; ++node)
        if (isLeaf(node)) of[node] = sumsOf(tree, channel, tree.nodes[node].first, tree.nodes[node + 1].first);
    });
    // Children stand behind their parents. Inner nodes are few.
    for (std::size_t node = nodes; node-- > 0;)
      if (!isLeaf(node)) of[node] = sumsOfChildren(tree, of, static_cast<std::uint32_t>(node));
  }
  return sums;
}

}  // namespace mote
