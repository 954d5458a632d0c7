// A frame's light: what reaches its particles, through the medium and past the solids, on the host or on a device.
#pragma once
#include <functional>
#include <vector>

#include "engine/frame.h"

namespace mote {

/// A function that gives optical depths toward a light, as mote::opticalDepths.
using OpticalDepthSource = std::function<std::vector<float>(const Receivers&, const layout::Light&,
                                                            std::span<const std::uint8_t> reached, const RaysDone&)>;
/// A function that says which receivers solids keep from a light, as mote::occluded.
using OcclusionSource = std::function<std::vector<std::uint8_t>(const Receivers&, std::span<const std::uint8_t> wanted,
                                                                const layout::Light&)>;

/// What computes the two halves of every shadow.
struct ShadowSources {
  OpticalDepthSource opticalDepths;
  OcclusionSource occluded;
};
/// From `depths`, within the frame's error. How each light of the particles was computed is added to `methods` where it
/// is given. `frame` and `depths` must outlive them.
OpticalDepthSource depthsWithin(const Frame& frame, const DepthSources& depths, std::vector<LightMethod>* methods);
/// On the host.
ShadowSources hostShadows(const Frame& frame, std::vector<LightMethod>* methods = nullptr);

/// T · S of one light at any receivers, [channel][receiver] (one channel or three): the medium's transmittance times
/// the share that solids let pass. What the light does not reach (outside a spot's cone) has 1. No ray goes through the
/// medium where a solid takes all.
std::vector<float> shadows(const Frame& frame, const Receivers& receivers, const layout::Light& light,
                           const ShadowSources& sources, const RaysDone& done = {});

/// What is to be kept beside the sum over the lights.
struct LightWanted {
  bool transmittance = false, byLight = false;
};

/// What the lights do to the particles, in the order of the receivers.
struct LitParticles {
  std::vector<vec3> radiance;  ///< in-scattered radiance Σ p·E·T·S [W/(m² sr)], before the albedo
  std::vector<std::vector<float>> transmittance;  ///< T·S, one a light, [channel][receiver]; empty unless wanted
  std::vector<std::vector<vec3>> byLight;         ///< one a light, the summands of `radiance`; empty unless wanted
};

/// Lights every particle with every light of the frame; the cost is linear in lights. Shows progress.
LitParticles lightParticles(const Frame& frame, const ShadowSources& sources, LightWanted wanted);

}  // namespace mote
