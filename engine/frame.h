// One frame of a scene made ready to be lit and drawn: particles loaded, density calibrated, octree built, camera and
// lights complete. No Vulkan is needed for any of it.
#pragma once
#include <string>
#include <vector>

#include "engine/stats.h"
#include "host/lighting/lighting.h"
#include "host/octree/octree.h"
#include "host/particles/particle_set.h"
#include "host/scene/scene.h"
#include "shaders/glsl/layout/splat.h"

namespace mote {

struct Frame {
  int number = 1;
  ParticleSet particles;  ///< in input order; tree.source maps slots to it
  Octree tree;
  std::vector<layout::Light> lights;
  std::vector<std::string> lightNames;
  layout::SplatCamera view;  ///< the camera as the splats take it
  LightingOptions rules;     ///< falloff, endpoint, cutoff
};

/// Loads and builds; fills `stats` (counts, radius, density scale, inputs, seconds of load and octree).
/// What the scene leaves open (a fitted camera, the default light, a density calibrated by optical depth) is settled by
/// the first frame that is prepared and written into `scene`, so that a sequence neither jitters nor flickers.
/// Throws InputError as readers and loaders do.
Frame prepareFrame(Scene& scene, int number, FrameStats& stats);

/// What the lights do to the particles, in slot order.
struct LitParticles {
  std::vector<vec3> radiance;                     ///< in-scattered radiance Σ p·E·T [W/(m² sr)], before the albedo
  std::vector<std::vector<float>> transmittance;  ///< one array a light; empty unless asked for
};

/// A function that gives the optical depths of every slot toward a light: on the host or on a device.
using OpticalDepthSource = std::function<std::vector<float>(const layout::Light&, const RaysDone&)>;
OpticalDepthSource hostOpticalDepths(const Frame& frame);

/// Lights every particle with every light of the frame; the cost is linear in lights. Shows progress.
LitParticles lightParticles(const Frame& frame, const OpticalDepthSource& source, bool keepTransmittance);

/// What the splat stage draws, in slot order: radiance is albedo · Color · in-scattered radiance.
std::vector<layout::SplatParticle> splatParticles(const Frame& frame, const Medium& medium, const LitParticles& lit);

/// Shader codes of the scene's choices.
layout::uint falloffCode(Falloff falloff);
layout::uint endpointCode(Endpoint endpoint);

}  // namespace mote
