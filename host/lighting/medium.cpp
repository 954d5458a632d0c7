#include "host/lighting/medium.h"

#include <algorithm>
#include <limits>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/lighting/lighting.h"

namespace mote {

double kernelPeak(layout::uint falloff, double radius) {
  const double area = kPi * radius * radius;
  return (falloff == layout::kFalloffSphere ? 1.5 : 3.0) / area;
}

std::vector<float> peakOpticalDepths(std::span<const float> density, std::span<const float> radius,
                                     layout::uint falloff, bool crossSection, double scale) {
  MOTE_CHECK(density.size(), ==, radius.size());
  std::vector<float> peaks(density.size());
  parallelBlocks(peaks.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double peak = density[i] * scale * (crossSection ? kernelPeak(falloff, radius[i]) : 1.0);
      peaks[i] = static_cast<float>(std::min(peak, double(std::numeric_limits<float>::max())));
    }
  });
  return peaks;
}

ColorExtinction colorExtinction(std::span<const vec3> color, const vec3& uniformColor, std::span<const vec3> absorption,
                                const vec3& albedo, const vec3& extinction) {
  ColorExtinction result{extinction, {}};
  if (absorption.empty()) return result;
  std::vector<vec3> factor(absorption.size());
  parallelBlocks(factor.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      factor[i] = ((color.empty() ? uniformColor : color[i]) * albedo + absorption[i]) * extinction;
  });
  if (std::all_of(factor.begin(), factor.end(), [&](const vec3& f) { return f == factor.front(); }))
    result.uniform = factor.front();
  else
    result.factor = std::move(factor);
  return result;
}

vec3 singleScatteringAlbedo(const vec3& scattering, const vec3* absorption) {
  if (!absorption) return scattering;
  vec3 albedo(0);
  for (int c = 0; c < 3; ++c) {
    const float sum = scattering[c] + (*absorption)[c];
    if (sum > 0) albedo[c] = scattering[c] / sum;
  }
  return albedo;
}

double meanLineOpticalDepth(const Octree& tree, layout::uint falloff, std::uint64_t seed) {
  if (tree.particleCount() == 0) return 0;
  std::vector<vec3> points, directions;
  for (std::size_t line = 0; line < kCalibrationLines; ++line) {
    Random random(seed, line);
    points.push_back(tree.position(random.bits() % tree.particleCount()));
    directions.emplace_back(random.direction());
  }
  double sum = 0;
  for (const float depth : lineOpticalDepths(tree, points, directions, falloff)) sum += depth;
  return sum / static_cast<double>(kCalibrationLines);
}

}  // namespace mote
