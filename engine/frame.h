// One frame of a scene made ready to be lit and drawn: particles loaded, density calibrated, octree built, camera and
// lights complete. No Vulkan is needed for any of it.
#pragma once
#include <string>
#include <vector>

#include "engine/stats.h"
#include "host/lighting/density_tree.h"
#include "host/lighting/lighting.h"
#include "host/lighting/medium.h"
#include "host/particles/particle_set.h"
#include "host/scene/scene.h"
#include "shaders/glsl/layout/splat.h"

namespace mote {

struct Frame {
  int number = 1;
  ParticleSet particles;       ///< in input order; density.source() maps receivers to it
  std::vector<float> peak;     ///< grey optical depth through each particle's centre at its own radius, input order
  ColorExtinction extinction;  ///< what it is in each colour
  DensityTree density;         ///< the particles that cast shadows, and all of them as receivers in Morton order
  std::vector<layout::Light> lights;
  std::vector<std::string> lightNames;
  LightingOptions rules;  ///< falloff, endpoint, cutoff, extinction where it is uniform
  Scattering scattering;
  layout::SplatCamera view;  ///< the camera as the splats take it
};

/// Loads and builds; fills `stats` (counts, radius, density scale, inputs, seconds of load and octree).
/// What the scene leaves open (a fitted camera, the default light, a density calibrated by optical depth) is settled by
/// the first frame that is prepared and written into `scene`, so that a sequence neither jitters nor flickers.
/// Throws InputError as readers and loaders do.
Frame prepareFrame(Scene& scene, int number, FrameStats& stats);

/// What the lights do to the particles, in the order of the receivers.
struct LitParticles {
  std::vector<vec3> radiance;                     ///< in-scattered radiance Σ p·E·T [W/(m² sr)], before the albedo
  std::vector<std::vector<float>> transmittance;  ///< one a light, [channel][receiver]; empty unless asked for
};

/// A function that gives optical depths toward a light, as mote::opticalDepths: on the host or on a device.
using OpticalDepthSource = std::function<std::vector<float>(const Receivers&, const layout::Light&,
                                                            std::span<const std::uint8_t> reached, const RaysDone&)>;
OpticalDepthSource hostOpticalDepths(const Frame& frame);

/// Lights every particle with every light of the frame; the cost is linear in lights. Shows progress.
LitParticles lightParticles(const Frame& frame, const OpticalDepthSource& source, bool keepTransmittance);

/// What the splat stage draws, in the order of the receivers: radiance is albedo · Color · in-scattered radiance.
std::vector<layout::SplatParticle> splatParticles(const Frame& frame, const Medium& medium, const View& view,
                                                  const LitParticles& lit);

/// Shader codes of the scene's choices.
layout::uint falloffCode(Falloff falloff);
layout::uint endpointCode(Endpoint endpoint);

}  // namespace mote
