// One frame of a scene made ready to be lit and drawn: particles loaded, density calibrated, octree built, camera and
// lights complete. No Vulkan is needed for any of it.
#pragma once
#include <string>
#include <vector>

#include "engine/frame_files.h"
#include "engine/stats.h"
#include "host/lighting/approximate.h"
#include "host/lighting/density_tree.h"
#include "host/lighting/lighting.h"
#include "host/lighting/medium.h"
#include "host/particles/particle_set.h"
#include "host/scene/scene.h"
#include "host/solids/solid_tree.h"
#include "host/splat/splat_set.h"

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
  ErrorWanted error;      ///< what lights may be off
  Scattering scattering;
  std::vector<Mesh> meshes;  ///< of scene.solids, in their order
  SolidTree solidTree;       ///< of the triangles that cast shadows
  float solidLight = 0;      ///< share of the light that passes a solid: 1 − solid_shadow_intensity
  layout::SplatCamera view;  ///< the camera as the splats take it
  SplatSet blank;            ///< … at every moment that counts, and sprites; no particles
  bool sampleById = true;    ///< false: too many particles share their ID, the index says which of them cast shadows
};

/// Loads and builds; fills `stats` (counts, radius, density scale, inputs; seconds of load, of octree with calibration
/// and "auto" sub-sampling, and of solids for their tree).
/// What the scene leaves open (a fitted camera, the default light, a density calibrated by optical depth, the origin)
/// is settled by the first frame that is prepared and written into `scene`, so that a sequence neither jitters nor
/// flickers. Throws InputError as readers and loaders do; `scene` is then as it was.
Frame prepareFrame(Scene& scene, int number, FrameStats& stats, FramePurpose purpose = FramePurpose::Picture);
/// … of files that are loaded.
Frame prepareFrame(Scene& scene, FrameFiles files, FrameStats& stats);

/// Shader codes of the scene's choices.
layout::uint falloffCode(Falloff falloff);
layout::uint endpointCode(Endpoint endpoint);

}  // namespace mote
