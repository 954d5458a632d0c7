#include "host/lighting/level_of_detail.h"

#include <algorithm>
#include <cmath>

#include "host/core/cap.h"
#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/lighting/grid/plan.h"

namespace mote {
namespace {

/// Nodes and leaves that one task looks at.
constexpr std::size_t kGrain = 64;
/// Particles or receivers a task where each is a few operations.
constexpr std::size_t kParticleGrain = 1 << 14;
/// Longer ranges of one leaf are halved unseen: so many lie in one finest cell only at one place.
constexpr std::size_t kLongestSearch = 256;

/// v = scale · xᵖ / (1 + saturation · xᵖ). By quadrature (300² points, two halves of the mass h radii to both sides in
/// five directions, nine places of the start, both endpoint rules) the greatest v is
///     h          0.05    0.1     0.2     0.4    0.8    1.6    and for h → 0
///     smooth     0.0078  0.030   0.113   0.35   0.79   1.14   3.25 h²
///     linear     0.0131  0.037   0.098   0.28   0.66   1.00   1.2 h^1.5: its tip
///     sphere     0.049   0.096   0.172   0.30   0.61   0.89   h √(log 1/h): its rim
struct ErrorLaw {
  double scale, power, saturation;
};
ErrorLaw errorLaw(layout::uint falloff) {
  switch (falloff) {
    case layout::kFalloffLinear: return {1.25, 0.75, 0.3};
    case layout::kFalloffSphere: return {0.85, 0.45, 0.15};
    default: return {3.4, 1, 1.5};
  }
}
/// What a spread of r² weighs against one of places, by the same quadrature for r² · (1 ± d), d = 0.05 to 0.8.
constexpr double kRadiiWeight = 0.7;

using ChannelSums = std::array<NodeSums, 3>;

const std::vector<float>& peaksOf(const Octree& tree, std::size_t channel) {
  return channel == 0 ? tree.peak : channel == 1 ? tree.peakGreen : tree.peakBlue;
}

ChannelSums sumsAt(const TreeSums& sums, std::size_t channels, std::size_t node) {
  ChannelSums at{};
  for (std::size_t c = 0; c < channels; ++c) at[c] = sums[c][node];
  return at;
}

/// Condition (1) of the header, in every channel.
class Fit {
 public:
  Fit(const DetailRules& rules)
      : falloff_(rules.falloff),
        factor_(rules.density * kernelMoments(rules.falloff).mass),
        allowed_(2 * std::exp(1.0) * rules.tolerance * rules.tolerance) {}

  bool operator()(const ChannelSums& sums) const {
    for (const NodeSums& s : sums) {
      if (!(s.mass > 0)) continue;
      const double error = standInError(s, falloff_);
      if (factor_ * s.mass / s.leastArea * error * error > allowed_) return false;
    }
    return true;
  }

 private:
  layout::uint falloff_;
  double factor_, allowed_;
};

/// Calls body(node, whole) for the highest nodes that fit (whole), and the leaves above which none does.
template <class Body>
void eachPart(const Octree& tree, const TreeSums& sums, const Fit& fit, const Body& body) {
  const auto nodes = static_cast<std::uint32_t>(tree.nodeCount());
  for (std::uint32_t node = 0; node < nodes;) {
    const bool whole = fit(sumsAt(sums, tree.channels(), node));
    if (whole || tree.nodes[node].skip == node + 1) body(node, whole);
    node = whole ? tree.nodes[node].skip : node + 1;
  }
}

/// Particles of a coarser tree.
struct Stock {
  std::vector<vec3> position;
  std::vector<float> radius, peak[3];
  std::vector<std::uint32_t> slot;  ///< of the exact tree; kNoSlot: a stand-in
  std::size_t standIns = 0;
  float greatestPeak = 0;

  void add(const vec3& at, float r, std::uint32_t from) {
    position.push_back(at), radius.push_back(r), slot.push_back(from);
  }
};

/// Divides parts of the tree into stand-ins and particles.
class Divider {
 public:
  Divider(const Octree& tree, const TreeSums& sums, const DetailRules& rules)
      : tree_(tree), sums_(sums), fit_(rules), falloff_(rules.falloff), channels_(tree.channels()) {}

  Stock run() const {
    struct Part {
      std::uint32_t node;
      bool whole;
    };
    std::vector<Part> parts;
    eachPart(tree_, sums_, fit_, [&](std::uint32_t node, bool whole) { parts.push_back({node, whole}); });
    std::vector<Stock> stocks((parts.size() + kGrain - 1) / kGrain);
    parallelBlocks(parts.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) divide(parts[i].node, parts[i].whole, stocks[begin / kGrain]);
    });
    return joined(stocks);
  }

 private:
  void divide(std::uint32_t index, bool whole, Stock& stock) const {
    const layout::Node& node = tree_.nodes[index];
    const std::size_t begin = node.first, end = tree_.nodes[node.skip].first;
    if (whole && end - begin > channels_)
      addStandIn(begin, end, sumsAt(sums_, channels_, index), stock);
    else
      divide(begin, end, stock);
  }

  void divide(std::size_t begin, std::size_t end, Stock& stock) const {
    if (end - begin <= channels_) {  // a stand-in for each colour would be no less
      for (std::size_t slot = begin; slot < end; ++slot) addParticle(slot, stock);
      return;
    }
    ChannelSums sums{};
    for (std::size_t c = 0; c < channels_; ++c) sums[c] = sumsOf(tree_, c, begin, end);
    if (fit_(sums)) return addStandIn(begin, end, sums, stock);
    const std::size_t middle = cut(begin, end);
    divide(begin, middle, stock), divide(middle, end, stock);
  }

  /// Where the two parts are as compact as any cut of the slots' order makes them: two groups about their own means
  /// spread less than one about its own by n₁n₂/n · |difference of the means|².
  std::size_t cut(std::size_t begin, std::size_t end) const {
    const std::size_t count = end - begin;
    if (count == 2 || count > kLongestSearch) return begin + count / 2;
    const dvec3 origin(tree_.position(begin));
    dvec3 all(0), before(0);
    for (std::size_t slot = begin; slot < end; ++slot) all += dvec3(tree_.position(slot)) - origin;
    std::size_t best = begin + 1;
    double most = -1;
    for (std::size_t slot = begin; slot + 1 < end; ++slot) {
      before += dvec3(tree_.position(slot)) - origin;
      const auto first = static_cast<double>(slot + 1 - begin), second = static_cast<double>(end - slot - 1);
      const dvec3 difference = second * before - first * (all - before);  // of the means, times n₁n₂
      const double gain = glm::dot(difference, difference) / (first * second);
      if (gain > most) most = gain, best = slot + 1;
    }
    return best;
  }

  void addParticle(std::size_t slot, Stock& stock) const {
    stock.add(tree_.position(slot), tree_.radius[slot], static_cast<std::uint32_t>(slot));
    for (std::size_t c = 0; c < channels_; ++c) stock.peak[c].push_back(peaksOf(tree_, c)[slot]);
  }

  void addStandIn(std::size_t begin, std::size_t end, const ChannelSums& sums, Stock& stock) const {
    ++stock.standIns;
    for (std::size_t c = 0; c < channels_; ++c) {
      const float* peaks = peaksOf(tree_, c).data();
      stock.greatestPeak = std::max(stock.greatestPeak, *std::max_element(peaks + begin, peaks + end));
      if (!(sums[c].mass > 0)) continue;
      const double radius = standInRadius(sums[c], falloff_);
      stock.add(sums[c].centroid, static_cast<float>(radius), kNoSlot);
      for (std::size_t other = 0; other < channels_; ++other)
        stock.peak[other].push_back(other == c ? static_cast<float>(sums[c].mass / (radius * radius)) : 0.0f);
    }
  }

  Stock joined(const std::vector<Stock>& stocks) const {
    std::vector<std::size_t> start{0};
    for (const Stock& stock : stocks) start.push_back(start.back() + stock.slot.size());
    Stock all;
    all.position.resize(start.back()), all.radius.resize(start.back()), all.slot.resize(start.back());
    for (std::size_t c = 0; c < channels_; ++c) all.peak[c].resize(start.back());
    parallelBlocks(stocks.size(), 1, [&](std::size_t s, std::size_t) {
      const Stock& from = stocks[s];
      const auto at = static_cast<std::ptrdiff_t>(start[s]);
      std::copy(from.position.begin(), from.position.end(), all.position.begin() + at);
      std::copy(from.radius.begin(), from.radius.end(), all.radius.begin() + at);
      std::copy(from.slot.begin(), from.slot.end(), all.slot.begin() + at);
      for (std::size_t c = 0; c < channels_; ++c)
        std::copy(from.peak[c].begin(), from.peak[c].end(), all.peak[c].begin() + at);
    });
    for (const Stock& from : stocks) {
      all.standIns += from.standIns;
      all.greatestPeak = std::max(all.greatestPeak, from.greatestPeak);
    }
    return all;
  }

  const Octree& tree_;
  const TreeSums& sums_;
  Fit fit_;
  layout::uint falloff_;
  std::size_t channels_;
};

}  // namespace

DetailRules detailRules(const layout::Light& light, const LightingOptions& options, double tolerance) {
  const vec3& e = options.extinction;
  return {tolerance, double(light.shadowDensity) * std::max({e.x, e.y, e.z}), options.falloff};
}

double standInError(const NodeSums& s, layout::uint falloff) {
  const double area = s.leastArea;
  const double root = std::sqrt(s.spread / area) + kRadiiWeight * std::sqrt(double(s.areaSpread)) / area;
  const ErrorLaw law = errorLaw(falloff);
  const double grown = law.power == 1 ? root * root : std::pow(root, 2 * law.power);
  return law.scale * grown / (1 + law.saturation * grown);
}

double standInRadius(const NodeSums& s, layout::uint falloff) {
  return std::sqrt(s.area + s.spread / (3 * kernelMoments(falloff).variance));
}

/// The figures are fitted to clouds and plumes of 0.25 to 1 M particles, radii of 1.5, 4 and 8 spacings: what a ray
/// costs whatever lies in its way, what finding costs, and what lies in its way: the discs on the cross-section.
DetailCost detailCost(const Octree& tree, const TreeSums& sums, const DetailRules& rules) {
  const Fit fit(rules);
  DetailCost cost;
  double discs = 0;  // Σ R²
  eachPart(tree, sums, fit, [&](std::uint32_t node, bool whole) {
    const layout::Node& part = tree.nodes[node];
    const double count = tree.nodes[part.skip].first - part.first;
    const ChannelSums all = sumsAt(sums, tree.channels(), node);
    ChannelSums piece = all;
    double pieces = 1;
    // n pieces have a mass of 1/n each and an edge of 1/∛n.
    while (!whole && pieces < count && !fit(piece)) {
      pieces = std::min(2 * pieces, count);
      for (NodeSums& s : piece) s.spread /= std::exp2(2.0f / 3), s.mass /= 2;
    }
    if (pieces >= count)
      for (NodeSums& s : piece) s.spread = 0;
    for (const NodeSums& s : piece) {
      if (!(s.mass > 0)) continue;
      const double radius = standInRadius(s, rules.falloff);
      discs += pieces * radius * radius;
      cost.particles += pieces;
    }
  });
  const auto exact = static_cast<double>(std::max<std::size_t>(tree.particleCount(), 1));
  const dvec3 size(tree.bounds().size());
  const double section = std::max((size.x * size.y + size.y * size.z + size.z * size.x) / 3, 1e-300);
  const double share = cost.particles / exact;
  cost.build = 0.015 + 0.22 * std::min(share, 1.0);
  cost.light = 0.17 + 0.15 * share + 0.0011 * kPi * discs / section;
  return cost;
}

DetailTree::DetailTree(const Octree& tree, const TreeSums& sums, const DetailRules& rules) : exact_(&tree) {
  if (!(rules.tolerance > 0) || !(rules.density > 0) || tree.particleCount() == 0) return;
  const Stock stock = Divider(tree, sums, rules).run();
  if (stock.standIns == 0) return;
  standIns_ = stock.standIns, greatestPeak_ = stock.greatestPeak;
  coarse_ = buildOctree({stock.position, stock.radius, stock.peak[0], stock.peak[1], stock.peak[2]});
  slot_.assign(tree.particleCount(), kNoSlot);
  parallelBlocks(coarse_.particleCount(), kParticleGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const std::uint32_t from = stock.slot[coarse_.source[slot]];
      if (from != kNoSlot) slot_[from] = static_cast<std::uint32_t>(slot);
    }
  });
}

std::vector<std::uint32_t> DetailTree::selves(const Receivers& receivers) const {
  std::vector<std::uint32_t> self(receivers.size());
  parallelBlocks(self.size(), kParticleGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::uint32_t own = receivers.selfOf(k);
      self[k] = own == kNoSlot || slot_.empty() ? own : slot_[own];
    }
  });
  return self;
}

LightingOptions DetailTree::optionsFor(const layout::Light& light, const LightingOptions& options) const {
  const vec3& e = options.extinction;
  LightingOptions lower = options;
  lower.cutoff *= std::exp(-light.shadowDensity * std::min({e.x, e.y, e.z}) * greatestPeak_);
  return lower;
}

void DetailTree::takeOwn(const Receivers& receivers, const layout::Light& light, const LightingOptions& options,
                         std::span<const std::uint8_t> reached, std::vector<float>& depths) const {
  const std::size_t count = receivers.size();
  MOTE_CHECK(depths.size(), ==, exact_->channels() * count);
  if (standIns_ == 0) return;
  parallelBlocks(count, kParticleGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::uint32_t own = receivers.selfOf(k);
      if (own == kNoSlot || slot_[own] != kNoSlot || (!reached.empty() && reached[k] == 0)) continue;
      const float radius = exact_->radius[own];
      if (!(radius > 0)) continue;
      float share = 1;
      if (options.endpoint == layout::kEndpointSoft) {
        share = 0.5f;  // cap(0)
        if (light.type != layout::kLightDirectional)
          share *= cap(glm::length(receivers.position(k) - light.position), radius);
      }
      for (std::size_t c = 0; c < exact_->channels(); ++c) {
        float& depth = depths[c * count + k];
        depth = std::max(depth - peaksOf(*exact_, c)[own] * share, 0.0f);
      }
    }
  });
}

std::vector<float> lodOpticalDepths(const DetailTree& detail, const Receivers& receivers, const layout::Light& light,
                                    const LightingOptions& options, const DetailSums& sums,
                                    std::span<const std::uint8_t> reached, const RaysDone& done) {
  if (detail.standIns() == 0 || shadowless(light)) return sums(detail.tree(), receivers, light, options, reached, done);
  const std::vector<std::uint32_t> self = detail.selves(receivers);
  std::vector<float> depths = sums(detail.tree(), {receivers.x, receivers.y, receivers.z, self}, light,
                                   detail.optionsFor(light, options), reached, done);
  detail.takeOwn(receivers, light, options, reached, depths);
  return depths;
}

std::vector<float> lodOpticalDepths(const DetailTree& detail, const Receivers& receivers, const layout::Light& light,
                                    const LightingOptions& options, std::span<const std::uint8_t> reached,
                                    const RaysDone& done) {
  const auto exactly = [](const Octree& tree, const Receivers& from, const layout::Light& toward,
                          const LightingOptions& rules, std::span<const std::uint8_t> wanted,
                          const RaysDone& report) { return opticalDepths(tree, from, toward, rules, wanted, report); };
  return lodOpticalDepths(detail, receivers, light, options, exactly, reached, done);
}

}  // namespace mote
