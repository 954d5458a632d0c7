#include "engine/lighting.h"

#include <algorithm>
#include <atomic>

#include "host/core/parallel.h"
#include "host/core/progress.h"
#include "host/lighting/irradiance.h"
#include "host/solids/occlusion.h"

namespace mote {
namespace {

constexpr std::size_t kBlock = 1 << 14;

/// Support radii in the order of the receivers.
std::vector<float> receiverRadii(const Frame& frame) {
  const std::vector<std::uint32_t>& source = frame.density.source();
  std::vector<float> radii(source.size());
  for (std::size_t k = 0; k < radii.size(); ++k) radii[k] = frame.particles.radius[source[k]];
  return radii;
}

/// Which receivers a light can reach; empty: all.
std::vector<std::uint8_t> reachedBy(const layout::Light& light, const Receivers& receivers) {
  if (light.type != layout::kLightSpot) return {};
  std::vector<std::uint8_t> reached(receivers.size());
  parallelBlocks(reached.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) reached[k] = reaches(light, receivers.position(k)) ? 1 : 0;
  });
  return reached;
}

/// Rays of one light, as they are done. How many there will be is not known before: those that no light reaches are not
/// sent, and what an approximation left too far off is done again.
class RayCount {
 public:
  RayCount(Progress& progress, std::size_t perPass) : progress_(progress), perPass_(perPass), expected_(perPass) {}
  ~RayCount() { progress_.advance(static_cast<double>(expected_ - std::min<std::size_t>(done_, expected_))); }
  RayCount(const RayCount&) = delete;
  RayCount& operator=(const RayCount&) = delete;

  void advance(std::size_t rays) {
    const std::size_t done = done_ += rays;
    for (std::size_t expected = expected_; done > expected;)
      if (expected_.compare_exchange_weak(expected, expected + perPass_))
        progress_.expect(static_cast<double>(perPass_)), expected += perPass_;
    progress_.advance(static_cast<double>(rays));
  }

 private:
  Progress& progress_;
  const std::size_t perPass_;
  std::atomic<std::size_t> done_{0}, expected_;
};

/// Takes out of `reached` what solids keep in the dark.
void leaveOut(const std::vector<std::uint8_t>& blocked, std::vector<std::uint8_t>& reached) {
  if (reached.empty()) reached.assign(blocked.size(), 1);
  for (std::size_t k = 0; k < blocked.size(); ++k)
    if (blocked[k]) reached[k] = 0;
}

}  // namespace

OpticalDepthSource depthsWithin(const Frame& frame, const DepthSources& sources, std::vector<LightMethod>* methods) {
  return [&frame, &sources, methods](const Receivers& receivers, const layout::Light& light,
                                     std::span<const std::uint8_t> reached, const RaysDone& done) {
    LightMethod method{frame.lightNames[static_cast<std::size_t>(&light - frame.lights.data())], {}};
    std::vector<float> depths = approximateOpticalDepths(frame.density.tree(), receivers, light, frame.rules,
                                                         frame.error, method.how, reached, done, sources);
    if (methods) methods->push_back(std::move(method));
    return depths;
  };
}

ShadowSources hostShadows(const Frame& frame, std::vector<LightMethod>* methods) {
  return {
      .opticalDepths = depthsWithin(frame, hostDepths(), methods),
      .occluded = [&frame](const Receivers& receivers, std::span<const std::uint8_t> wanted,
                           const layout::Light& light) { return occluded(frame.solidTree, receivers, wanted, light); }};
}

std::vector<float> shadows(const Frame& frame, const Receivers& receivers, const layout::Light& light,
                           const ShadowSources& sources, const RaysDone& done) {
  const std::size_t count = receivers.size();
  std::vector<std::uint8_t> reached = reachedBy(light, receivers);
  std::vector<std::uint8_t> blocked;
  if (!frame.solidTree.empty() && frame.solidLight < 1 && light.castsShadows != 0) {
    blocked = sources.occluded(receivers, reached, light);
    if (frame.solidLight == 0) leaveOut(blocked, reached);
  }
  const std::vector<float> depths = sources.opticalDepths(receivers, light, reached, done);
  std::vector<float> result = transmittances(depths, count, light, frame.rules.extinction);
  if (!blocked.empty()) {
    parallelBlocks(result.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k)
        if (blocked[k % count]) result[k] *= frame.solidLight;
    });
  }
  return result;
}

LitParticles lightParticles(const Frame& frame, const ShadowSources& sources, LightWanted wanted) {
  const Receivers receivers = frame.density.receivers();
  const std::size_t count = receivers.size();
  const std::vector<float> radii = receiverRadii(frame);
  LitParticles lit;
  lit.radiance.assign(count, vec3(0));
  Progress progress("lighting", static_cast<double>(count) * static_cast<double>(frame.lights.size()), "rays");
  for (const layout::Light& light : frame.lights) {
    RayCount done(progress, count);
    std::vector<float> transmittance =
        shadows(frame, receivers, light, sources, [&done](std::size_t rays) { done.advance(rays); });
    if (wanted.byLight) {
      std::vector<vec3>& own = lit.byLight.emplace_back(count, vec3(0));
      addInScattering(receivers, radii, light, transmittance, frame.scattering, own);
      parallelBlocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) lit.radiance[k] += own[k];
      });
    } else {
      addInScattering(receivers, radii, light, transmittance, frame.scattering, lit.radiance);
    }
    if (wanted.transmittance) lit.transmittance.push_back(std::move(transmittance));
  }
  return lit;
}

}  // namespace mote
