#include "host/lighting/error_probes.h"

#include <algorithm>
#include <cmath>

#include "host/core/random.h"

namespace mote {
namespace {

/// One-sided 99 % quantile of the normal distribution, which a mean of 2,048 follows.
constexpr double kQuantile = 2.326;
/// Sets the probes apart from everything else that an index decides.
constexpr std::uint64_t kProbeStream = 0xe4405;
/// Probes that have rays beside them, in a line across the light's way: at so many mean radii.
constexpr std::size_t kBesides = 192;
constexpr double kLine[] = {-0.5, -0.25, 0.25, 0.5};

/// Points that are receivers of their own.
struct Points {
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> self;
  Receivers receivers() const { return {x, y, z, self}; }
  void add(const vec3& position, std::uint32_t slot) {
    x.push_back(position.x), y.push_back(position.y), z.push_back(position.z), self.push_back(slot);
  }
};

}  // namespace

double Roughness::slope() const {
  return quarter > 0 && half > 0 ? std::clamp(std::log2(half / quarter), 0.5, 2.0) : 2;
}

ErrorProbes::ErrorProbes(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                         const LightingOptions& options, std::span<const std::uint8_t> reached)
    : tree_(tree), receivers_(receivers), light_(light), options_(options) {
  std::vector<std::uint32_t> eligible;
  if (!reached.empty())
    for (std::size_t k = 0; k < receivers.size(); ++k)
      if (reached[k] != 0) eligible.push_back(static_cast<std::uint32_t>(k));
  const std::size_t all = reached.empty() ? receivers.size() : eligible.size();
  for (std::size_t i = 0; i < std::min(kErrorProbes, all); ++i) {
    const std::size_t drawn = all <= kErrorProbes ? i : hashBits(0, i, kProbeStream) % all;
    index_.push_back(reached.empty() ? static_cast<std::uint32_t>(drawn) : eligible[drawn]);
  }
}

std::size_t ErrorProbes::besides() const { return std::min(kBesides, count()); }

void ErrorProbes::lightExactly(double radius) {
  Points points;
  for (const std::uint32_t k : index_) points.add(receivers_.position(k), receivers_.selfOf(k));
  for (const double place : kLine)
    for (std::size_t i = 0; i < besides(); ++i) {
      const dvec3 start(receivers_.position(index_[i]));
      const dvec3 way =
          light_.type == layout::kLightDirectional ? dvec3(light_.direction) : start - dvec3(light_.position);
      const dvec3 across = glm::cross(way, Random(kProbeStream, i).direction());
      const dvec3 beside = start + (glm::length(across) > 0 ? glm::normalize(across) * (place * radius) : dvec3(0));
      points.add(vec3(beside), receivers_.selfOf(index_[i]));
    }
  const std::vector<float> found = transmittances(opticalDepthsOfFew(tree_, points.receivers(), light_, options_),
                                                  rays(), light_, options_.extinction);
  const std::size_t channels = found.size() / rays();
  exact_.resize(channels * count());
  roughness_ = {};
  for (std::size_t c = 0; c < channels; ++c) {
    const float* own = found.data() + c * rays();
    std::copy_n(own, count(), exact_.data() + c * count());
    const float* line[] = {own + count(), own + count() + besides(), own, own + count() + 2 * besides(),
                           own + count() + 3 * besides()};
    const auto meanBend = [&](int middle, int apart) {
      double sum = 0;
      for (std::size_t i = 0; i < besides(); ++i)
        sum += std::abs(double(line[middle][i]) - 0.5 * (double(line[middle - apart][i]) + line[middle + apart][i]));
      return sum / static_cast<double>(besides() * channels);
    };
    roughness_.quarter += (meanBend(1, 1) + meanBend(2, 1) + meanBend(3, 1)) / 3, roughness_.half += meanBend(2, 2);
  }
}

MeasuredError ErrorProbes::measure(const std::vector<float>& depths) const {
  const std::size_t channelsOfDepths = depths.size() / receivers_.size();
  std::vector<float> own(channelsOfDepths * count());
  for (std::size_t c = 0; c < channelsOfDepths; ++c)
    for (std::size_t i = 0; i < count(); ++i) own[c * count() + i] = depths[c * receivers_.size() + index_[i]];
  const std::vector<float> found = transmittances(own, count(), light_, options_.extinction);
  const std::size_t channels = found.size() / count();
  std::vector<double> errors(count(), 0.0);
  for (std::size_t i = 0; i < found.size(); ++i)
    errors[i % count()] += std::abs(double(exact_[i]) - double(found[i])) / static_cast<double>(channels);
  double sum = 0, squares = 0;
  for (const double e : errors) sum += e, squares += e * e;
  const auto number = static_cast<double>(count());
  MeasuredError result{.probes = count()};
  result.mean = sum / number;
  const double variance = std::max(squares / number - result.mean * result.mean, 0.0);
  result.upper = result.mean + kQuantile * std::sqrt(variance / std::max(number - 1, 1.0));
  std::sort(errors.begin(), errors.end());
  result.p99 = errors[std::min(count() - 1, count() * 99 / 100)];
  result.greatest = errors.back();
  return result;
}

double ErrorProbes::cellScale() const {
  if (light_.type == layout::kLightDirectional) return 1;
  double sum = 0;
  for (const std::uint32_t k : index_) {
    const dvec3 offset = glm::abs(dvec3(receivers_.position(k)) - dvec3(light_.position));
    const double z = std::max({offset.x, offset.y, offset.z}), distance = glm::length(offset);
    sum += distance > 0 ? z * std::sqrt(z / distance) : 0;
  }
  return sum / static_cast<double>(count());
}

}  // namespace mote
