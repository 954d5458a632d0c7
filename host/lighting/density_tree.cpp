#include "host/lighting/density_tree.h"

#include <cmath>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/sampling.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 14;
/// The particles that go into the tree, as arrays of their own.
struct Chosen {
  std::vector<std::uint32_t> index;  ///< in the input, ascending
  std::vector<vec3> position;
  std::vector<float> radius, peaks[3];
};

std::vector<std::uint32_t> chosenIndices(const DensityInput& input, const DensityRules& rules) {
  std::vector<std::uint32_t> chosen;
  for (std::size_t i = 0; i < input.position.size(); ++i)
    if (isSampled(input.id.empty() ? i : input.id[i], rules.seed, rules.fraction))
      chosen.push_back(static_cast<std::uint32_t>(i));
  return chosen;
}

/// Total cross-section up to the falloff's constant: Σ peak · r². In order, in double: the same on any machine.
double totalCrossSection(std::span<const float> peak, std::span<const float> radius) {
  double sum = 0;
  for (std::size_t i = 0; i < peak.size(); ++i) sum += double(peak[i]) * radius[i] * radius[i];
  return sum;
}

void multiply(std::vector<float>& values, double factor) {
  constexpr double kGreatest = std::numeric_limits<float>::max();
  parallelBlocks(values.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) values[i] = static_cast<float>(std::min(values[i] * factor, kGreatest));
  });
}

Chosen gather(const DensityInput& input, const DensityRules& rules) {
  Chosen chosen;
  chosen.index = chosenIndices(input, rules);
  const std::span<const float> peaks[] = {input.peak, input.peakGreen, input.peakBlue};
  for (const std::uint32_t i : chosen.index) {
    chosen.position.push_back(input.position[i]);
    chosen.radius.push_back(input.radius[i]);
    for (int c = 0; c < 3; ++c)
      if (!peaks[c].empty()) chosen.peaks[c].push_back(peaks[c][i]);
  }
  if (!rules.compensate) return chosen;
  for (int c = 0; c < 3; ++c) {
    const double kept = totalCrossSection(chosen.peaks[c], chosen.radius);
    if (kept > 0) multiply(chosen.peaks[c], totalCrossSection(peaks[c], input.radius) / kept);
  }
  return chosen;
}

}  // namespace

DensityTree::DensityTree(const DensityInput& input, const DensityRules& rules) {
  MOTE_CHECK(rules.fraction, >, 0.0f);
  MOTE_CHECK(rules.radiusScale, >, 0.0f);
  const bool whole = rules.fraction >= 1;
  if (whole && rules.radiusScale == 1) {
    tree_ = buildOctree({input.position, input.radius, input.peak, input.peakGreen, input.peakBlue},
                        rules.particlesPerCell);
    return;
  }
  Chosen chosen = gather(input, rules);
  // Fewer particles stand farther apart, by 1/∛fraction: what overlaps as before is as smooth as before.
  const double widening = rules.compensate ? std::cbrt(1 / double(rules.fraction)) : 1.0;
  const double radiusScale = rules.radiusScale * widening;
  for (float& radius : chosen.radius) radius = static_cast<float>(radius * radiusScale);
  // A cross-section spread over a disc s times as wide is 1/s² of it in the middle.
  const double peakScale = rules.crossSection ? radiusScale : widening;
  for (auto& peaks : chosen.peaks) multiply(peaks, 1 / (peakScale * peakScale));
  tree_ = buildOctree({chosen.position, chosen.radius, chosen.peaks[0], chosen.peaks[1], chosen.peaks[2]},
                      rules.particlesPerCell);
  std::vector<std::uint32_t> slotOf(input.position.size(), kNoSlot);
  for (std::size_t slot = 0; slot < tree_.source.size(); ++slot) {
    tree_.source[slot] = chosen.index[tree_.source[slot]];
    slotOf[tree_.source[slot]] = static_cast<std::uint32_t>(slot);
  }
  if (whole) return;
  source_ = mortonOrder(input.position);
  const std::size_t count = source_.size();
  x_.resize(count), y_.resize(count), z_.resize(count), self_.resize(count);
  parallelBlocks(count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const vec3& p = input.position[source_[k]];
      x_[k] = p.x, y_[k] = p.y, z_[k] = p.z;
      self_[k] = slotOf[source_[k]];
    }
  });
}

Receivers DensityTree::receivers() const {
  if (source_.empty()) return slotsOf(tree_);
  return {x_, y_, z_, self_};
}

void DensityTree::scaleDensity(double scale) {
  for (auto* peaks : {&tree_.peak, &tree_.peakGreen, &tree_.peakBlue}) multiply(*peaks, scale);
}

}  // namespace mote
