#include "host/lighting/auto_subsample.h"

#include <cmath>

#include "host/core/random.h"

namespace mote {
namespace {

constexpr int kLadderSteps = 12;  // √2 each: from 1/64 to 1

/// The probes as receivers of one tree.
struct Probes {
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> self;
  Receivers receivers() const { return {x, y, z, self}; }
};

std::vector<std::uint32_t> probeIndices(std::size_t count, std::uint64_t seed) {
  std::vector<std::uint32_t> indices;
  for (std::size_t k = 0; k < std::min(count, kSubsampleProbes); ++k)
    indices.push_back(static_cast<std::uint32_t>(count <= kSubsampleProbes ? k : hashBits(seed, k, 0x9b0be) % count));
  return indices;
}

Probes probesIn(const DensityTree& density, const DensityInput& input, const std::vector<std::uint32_t>& indices) {
  std::vector<std::uint32_t> slotOf(input.position.size(), kNoSlot);
  const std::vector<std::uint32_t>& source = density.tree().source;
  for (std::size_t slot = 0; slot < source.size(); ++slot) slotOf[source[slot]] = static_cast<std::uint32_t>(slot);
  Probes probes;
  for (const std::uint32_t i : indices) {
    probes.x.push_back(input.position[i].x);
    probes.y.push_back(input.position[i].y);
    probes.z.push_back(input.position[i].z);
    probes.self.push_back(slotOf[i]);
  }
  return probes;
}

/// Transmittances of the probes toward every light, one after the other.
std::vector<std::vector<float>> light(const DensityTree& density, const Probes& probes,
                                      std::span<const layout::Light> lights, const LightingOptions& options) {
  std::vector<std::vector<float>> result;
  for (const layout::Light& l : lights)
    result.push_back(transmittances(opticalDepths(density.tree(), probes.receivers(), l, options), probes.x.size(), l,
                                    options.extinction));
  return result;
}

/// Mean |ΔT| of the light where it is greatest.
double difference(const std::vector<std::vector<float>>& a, const std::vector<std::vector<float>>& b) {
  double greatest = 0;
  for (std::size_t l = 0; l < a.size(); ++l) {
    double sum = 0;
    for (std::size_t i = 0; i < a[l].size(); ++i) sum += std::abs(double(a[l][i]) - double(b[l][i]));
    if (!a[l].empty()) greatest = std::max(greatest, sum / static_cast<double>(a[l].size()));
  }
  return greatest;
}

}  // namespace

SubsampleChoice autoSubsample(const DensityInput& input, const DensityRules& rules,
                              std::span<const layout::Light> lights, const LightingOptions& options, double error) {
  const std::vector<std::uint32_t> indices = probeIndices(input.position.size(), rules.seed);
  DensityRules candidate = rules;
  candidate.fraction = 1;
  const DensityTree whole(input, candidate);
  const auto exact = light(whole, probesIn(whole, input, indices), lights, options);
  for (int step = kLadderSteps; step > 0; --step) {
    candidate.fraction = static_cast<float>(std::pow(0.5, 0.5 * step));
    const DensityTree density(input, candidate);
    if (density.tree().particleCount() == 0) continue;
    const double measured = difference(exact, light(density, probesIn(density, input, indices), lights, options));
    if (measured <= error) return {candidate.fraction, measured};
  }
  return {1, 0};
}

}  // namespace mote
