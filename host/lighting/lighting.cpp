#include "host/lighting/lighting.h"

#include <cmath>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/lighting/exact/beam_kernel.h"
#include "host/lighting/exact/beams.h"
#include "host/lighting/exact/ray.h"
#include "host/lighting/irradiance.h"

namespace mote {
namespace {

/// What one thread needs for the column and the beam at hand, kept from one to the next.
struct Workspace {
  Column column;
  Beam beam;
};
Workspace& workspace() {
  static thread_local Workspace ofThisThread;
  return ofThisThread;
}

SumOptions sumOptions(const layout::Light& light, const LightingOptions& options) {
  return {options.falloff, options.endpoint, opticalDepthLimit(light, options)};
}

/// Finds what lies in the way of a column that has been set.
void fillColumn(const Octree& tree, const BeamKernel& kernel, Column& column) {
  kernel.gather(tree, column);
  kernel.place(column);
  column.sort(tree.channels());
}

/// Calls done(packet, sums) for each packet of a beam that has been set.
template <class Done>
void sumBeam(const Octree& tree, const BeamKernel& kernel, const SumOptions& options, Workspace& work,
             const Done& done) {
  kernel.choose(work.column, tree.channels(), work.beam);
  PacketSums sums;
  for (std::size_t packet = 0; packet < work.beam.rays.packets(); ++packet) {
    kernel.sum(work.column, work.beam, packet, tree.channels(), options, sums);
    done(packet, sums);
  }
}

/// Calls put(receiver, channel, sum) for all rays of one beam.
template <class Put>
void sumBeamRays(const Octree& tree, const BeamKernel& kernel, const SumOptions& options, Workspace& work,
                 const Put& put) {
  const std::vector<std::uint32_t>& rays = work.beam.rays.receiver;
  sumBeam(tree, kernel, options, work, [&](std::size_t packet, const PacketSums& sums) {
    const std::size_t first = packet * kPacketRays, count = std::min<std::size_t>(kPacketRays, rays.size() - first);
    for (std::size_t channel = 0; channel < tree.channels(); ++channel)
      for (std::size_t lane = 0; lane < count; ++lane) put(rays[first + lane], channel, sums.of[channel][lane]);
  });
}

std::vector<float> sumAll(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                          const LightingOptions& options, std::span<const std::uint8_t> reached, const RaysDone& done,
                          const BeamKernel& kernel) {
  if (!reached.empty()) MOTE_CHECK(reached.size(), ==, receivers.size());
  std::vector<float> depths(tree.channels() * receivers.size(), 0.0f);
  if (shadowless(light) || tree.particleCount() == 0) return depths;
  const SumOptions rules = sumOptions(light, options);
  const ColumnRules shape = columnRules(tree, light, receivers.bounds());
  const Beams beams = planBeams(receivers, light, reached, tree.meanRadius);
  parallelBlocks(beams.columns(), 1, [&](std::size_t c, std::size_t) {
    Workspace& work = workspace();
    work.column.setRays(receivers, light, beams.ofColumn(c), shape);
    fillColumn(tree, kernel, work.column);
    for (std::size_t b = beams.column[c]; b < beams.column[c + 1]; ++b) {
      work.beam.setRays(work.column, receivers, beams.ofBeam(b));
      sumBeamRays(tree, kernel, rules, work, [&](std::uint32_t receiver, std::size_t channel, float sum) {
        depths[channel * receivers.size() + receiver] = sum;
      });
    }
    if (done) done(beams.ofColumn(c).size());
  });
  return depths;
}

}  // namespace

Bounds Receivers::bounds() const {
  constexpr std::size_t kGrain = 1 << 14;
  std::vector<Bounds> parts((size() + kGrain - 1) / kGrain);
  parallelBlocks(size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) parts[begin / kGrain].add(position(k));
  });
  Bounds bounds;
  for (const Bounds& part : parts) bounds.add(part);
  return bounds;
}

bool shadowless(const layout::Light& light) { return light.castsShadows == 0 || light.shadowDensity == 0; }

float opticalDepthLimit(const layout::Light& light, const LightingOptions& options) {
  const vec3& e = options.extinction;
  const float least = light.shadowDensity * std::min({e.x, e.y, e.z});
  if (options.cutoff <= 0 || least <= 0) return std::numeric_limits<float>::infinity();
  return -std::log(options.cutoff) / least;
}

std::vector<float> opticalDepths(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                 const LightingOptions& options, std::span<const std::uint8_t> reached,
                                 const RaysDone& done) {
  return sumAll(tree, receivers, light, options, reached, done, simdBeamKernel());
}

std::vector<float> opticalDepths(const Octree& tree, const layout::Light& light, const LightingOptions& options,
                                 const RaysDone& done) {
  return sumAll(tree, slotsOf(tree), light, options, {}, done, simdBeamKernel());
}

std::vector<float> opticalDepthsOfFew(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                      const LightingOptions& options) {
  std::vector<float> depths(tree.channels() * receivers.size(), 0.0f);
  if (shadowless(light) || tree.particleCount() == 0) return depths;
  const float slack = columnRules(tree, light, receivers.bounds()).slack;
  // Neighbours go together.
  const Beams beams = planBeams(receivers, light, {}, tree.meanRadius, {kPacketRays, kPacketRays});
  parallelBlocks(beams.receiver.size(), kPacketRays, [&](std::size_t begin, std::size_t end) {
    const auto members = std::span(beams.receiver).subspan(begin, end - begin);
    std::vector<Ray> rays;
    for (const std::uint32_t receiver : members) rays.push_back(rayToLight(receivers, receiver, light));
    float sums[3][kPacketRays];
    sumRays(tree, rays, options.falloff, options.endpoint, slack, sums);
    for (std::size_t channel = 0; channel < tree.channels(); ++channel)
      for (std::size_t k = 0; k < members.size(); ++k)
        depths[channel * receivers.size() + members[k]] = sums[channel][k];
  });
  return depths;
}

std::vector<float> opticalDepthsScalar(const Octree& tree, const Receivers& receivers, const layout::Light& light,
                                       const LightingOptions& options, std::span<const std::uint8_t> reached) {
  return sumAll(tree, receivers, light, options, reached, {}, scalarBeamKernel());
}

std::vector<float> opticalDepthsScalar(const Octree& tree, const layout::Light& light, const LightingOptions& options) {
  return opticalDepthsScalar(tree, slotsOf(tree), light, options);
}

std::vector<float> transmittances(const std::vector<float>& opticalDepths, std::size_t receivers,
                                  const layout::Light& light, const vec3& extinction) {
  const bool grey = opticalDepths.size() == receivers;
  if (!grey) MOTE_CHECK(opticalDepths.size(), ==, 3 * receivers);
  const bool oneChannel = grey && extinction.x == extinction.y && extinction.y == extinction.z;
  // Without shadows T is 1 even where the optical depth is not known.
  const float density = light.castsShadows != 0 ? light.shadowDensity : 0;
  std::vector<float> result((oneChannel ? 1 : 3) * receivers);
  parallelBlocks(result.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float factor = -density * extinction[static_cast<int>(i / receivers)];
      result[i] = std::exp(factor * opticalDepths[grey ? i % receivers : i]);
    }
  });
  return result;
}

std::vector<float> transmittances(const std::vector<float>& opticalDepths, const layout::Light& light) {
  return transmittances(opticalDepths, opticalDepths.size(), light, vec3(1));
}

std::vector<float> lineOpticalDepths(const Octree& tree, std::span<const vec3> points, std::span<const vec3> directions,
                                     layout::uint falloff) {
  MOTE_CHECK(points.size(), ==, directions.size());
  std::vector<float> depths(points.size(), 0.0f);
  if (tree.particleCount() == 0) return depths;
  layout::Light endless{};
  endless.type = layout::kLightDirectional;
  const ColumnRules shape = columnRules(tree, endless, {});
  parallelBlocks(points.size(), 16, [&](std::size_t begin, std::size_t end) {
    Workspace& work = workspace();
    for (std::size_t i = begin; i < end; ++i) {
      work.column.setLine(points[i], directions[i], shape);
      fillColumn(tree, simdBeamKernel(), work.column);
      work.beam.setLine();
      sumBeam(tree, simdBeamKernel(), {falloff}, work, [&](std::size_t, const PacketSums& sums) {
        depths[i] = tree.channels() == 1 ? sums.of[0][0] : (sums.of[0][0] + sums.of[1][0] + sums.of[2][0]) / 3;
      });
    }
  });
  return depths;
}

void addInScattering(const Receivers& receivers, std::span<const float> radius, const layout::Light& light,
                     std::span<const float> transmittance, const Scattering& scattering, std::vector<vec3>& radiance) {
  const std::size_t count = receivers.size();
  MOTE_CHECK(radius.size(), ==, count);
  MOTE_CHECK(radiance.size(), ==, count);
  const bool grey = transmittance.size() == count;
  if (!grey) MOTE_CHECK(transmittance.size(), ==, 3 * count);
  parallelBlocks(count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const vec3 point = receivers.position(k);
      const float cosine = scattering.phase.kind == PhaseKind::Isotropic
                               ? 0.0f
                               : glm::dot(travelDirection(light, point), scattering.viewer.directionFrom(point));
      const vec3 passes = grey ? vec3(transmittance[k])
                               : vec3(transmittance[k], transmittance[count + k], transmittance[2 * count + k]);
      radiance[k] += scattering.phase(cosine) * passes * irradiance(light, point, radius[k]);
    }
  });
}

}  // namespace mote
