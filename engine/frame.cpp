#include "engine/frame.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/splats.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/progress.h"
#include "host/core/sampling.h"
#include "host/core/timer.h"
#include "host/lighting/auto_subsample.h"
#include "host/lighting/medium.h"
#include "host/scene/fitting.h"
#include "host/scene/frame_path.h"
#include "host/scene/origin.h"
#include "host/solids/mesh.h"

namespace mote {
namespace {

layout::Light toLight(const LightSource& source) {
  const bool directional = source.type == LightType::Directional;
  return {.position = vec3(source.position),
          .type = directional                      ? layout::kLightDirectional
                  : source.type == LightType::Spot ? layout::kLightSpot
                                                   : layout::kLightPoint,
          .direction = source.direction,
          .decay = directional ? 0.0f : source.decay,
          .power = source.strength * source.color,
          .shadowDensity = source.shadowDensity,
          .castsShadows = source.castsShadows ? 1u : 0u,
          .cosInner = static_cast<float>(std::cos(source.innerAngle * kPi / 180)),
          .cosOuter = static_cast<float>(std::cos(source.outerAngle * kPi / 180))};
}

/// The arrays that the density tree is made of, and their owner.
struct DensityArrays {
  const Frame& frame;
  std::vector<float> channels[3];  ///< with different extinction in each colour; else empty, and frame.peak serves

  explicit DensityArrays(const Frame& from) : frame(from) {
    const std::vector<vec3>& factor = from.extinction.factor;
    if (factor.empty()) return;
    for (int c = 0; c < 3; ++c) {
      channels[c].resize(factor.size());
      for (std::size_t i = 0; i < factor.size(); ++i) channels[c][i] = from.peak[i] * factor[i][c];
    }
  }
  DensityInput input() const {
    const ParticleSet& particles = frame.particles;
    std::span<const std::uint64_t> id;
    if (frame.sampleById) id = particles.id;
    if (channels[0].empty()) return {particles.position, particles.radius, frame.peak, {}, {}, id};
    return {particles.position, particles.radius, channels[0], channels[1], channels[2], id};
  }
};

DensityRules densityRules(const Scene& scene) {
  const LightingSettings& lighting = scene.lighting;
  return {.crossSection = scene.medium.densityMode == DensityMode::CrossSection,
          .radiusScale = lighting.radiusScale,
          .fraction = lighting.subsample,
          .seed = lighting.subsampleSeed,
          .compensate = lighting.compensate,
          .particlesPerCell = lighting.particlesPerCell > 0 ? lighting.particlesPerCell : kDefaultParticlesPerCell};
}

/// The scale on Density that gives lines through the particles the mean optical depth that the scene asks for: of all
/// particles at their own size, as they are drawn, whatever share of them casts shadows.
double calibratedScale(const Octree& all, const Frame& frame, double wanted, const std::string& place) {
  const vec3& uniform = frame.rules.extinction;
  const double mean = meanLineOpticalDepth(all, frame.rules.falloff) * (uniform.x + uniform.y + uniform.z) / 3;
  if (!(mean > 0))
    throw InputError(place, "/medium/optical_depth", "particles with some density to calibrate",
                     "a mean optical depth of 0", "is the channel Density, or medium.extinction, zero everywhere?");
  return wanted / mean;
}

void scale(std::vector<float>& peaks, double factor) {
  parallelBlocks(peaks.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      peaks[i] = static_cast<float>(std::min(peaks[i] * factor, double(std::numeric_limits<float>::max())));
  });
}

/// Whether the channel ID can choose the particles that cast shadows; says so where it cannot.
bool idsServe(const Scene& scene, const ParticleSet& particles) {
  const bool sampled = scene.lighting.autoSubsample || scene.lighting.subsample < 1;
  if (!sampled || particles.id.empty()) return true;
  const double share = meanIdShare(particles.id);
  if (share <= kMostIdShare) return true;
  logWarning(
      fmt::format("ID is no name of a particle: {:.0f} of them share one in the mean; lighting.subsample goes by "
                  "the index instead, which is steady only where the order of the particles is",
                  share));
  return false;
}

bool castsAsDrawn(const Scene& scene, const Frame& frame) {
  const LightingSettings& lighting = scene.lighting;
  return !lighting.autoSubsample && lighting.subsample >= 1 && lighting.radiusScale == 1 &&
         frame.extinction.factor.empty();
}

/// Density scale and sub-sampling that the scene leaves open, from its first frame; `stats` gets what is measured.
void settleDensity(Scene& scene, Frame& frame, FrameStats& stats) {
  if (scene.medium.opticalDepth) {
    const DensityArrays arrays(frame);
    // Where all particles cast shadows at their own size this tree is also the frame's; only its densities change.
    const bool keep = castsAsDrawn(scene, frame);
    DensityTree all(arrays.input(), keep ? densityRules(scene) : DensityRules{});
    const double density = calibratedScale(all.tree(), frame, *scene.medium.opticalDepth, scene.path);
    logVerbose(fmt::format("optical_depth {} is density_scale {}", *scene.medium.opticalDepth, density));
    scene.medium.densityScale = static_cast<float>(density);
    scene.medium.opticalDepth.reset();
    if (keep) {
      all.scaleDensity(scene.medium.densityScale);
      frame.density = std::move(all);
    }
  }
  scale(frame.peak, scene.medium.densityScale);
  if (!scene.lighting.autoSubsample) return;
  const DensityArrays arrays(frame);
  const SubsampleChoice choice =
      autoSubsample(arrays.input(), densityRules(scene), frame.lights, frame.rules, scene.lighting.error);
  logVerbose(fmt::format("subsample \"auto\" is {:.4g}: mean |dT| {:.2g}, allowed {:.2g}", choice.fraction,
                         choice.error, scene.lighting.error));
  scene.lighting.subsample = choice.fraction;
  scene.lighting.autoSubsample = false;
  stats.subsampleError = choice.error;
  if (choice.fraction < 1) scene.lighting.error = 0;  // the sample has spent it: its light is exact
}

/// True where this frame is one of many: of the shot, or of a sequence that other runs do the rest of.
bool isAnimated(const Scene& scene) {
  const Frames& shot = scene.wholeShot();
  if (shot.first != shot.last || scene.camera.keys.size() > 1) return true;
  return std::any_of(scene.particles.begin(), scene.particles.end(),
                     [](const ParticleSource& source) { return hasFramePattern(source.file); });
}

void prepareMedium(const Scene& scene, Frame& frame) {
  const ParticleSet& particles = frame.particles;
  const Medium& medium = scene.medium;
  frame.rules.falloff = falloffCode(medium.falloff);
  frame.rules.endpoint = endpointCode(scene.lighting.endpoint);
  frame.rules.cutoff = scene.lighting.cutoff;
  frame.extinction =
      colorExtinction(particles.color, particles.uniformColor, particles.absorption, medium.albedo, medium.extinction);
  if (frame.extinction.factor.empty()) frame.rules.extinction = frame.extinction.uniform;
  frame.peak = peakOpticalDepths(particles.density, particles.radius, frame.rules.falloff,
                                 medium.densityMode == DensityMode::CrossSection, 1.0);
}

Viewer viewerOf(const layout::SplatCamera& camera) {
  return {.eye = camera.position, .parallel = camera.orthographic != 0, .toCamera = -camera.forward};
}

/// The tree of the meshes that cast shadows.
void prepareSolids(const Scene& scene, Frame& frame) {
  frame.solidTree = buildSolidTree(shadowTriangles(scene.solids, frame.meshes));
  frame.solidLight = 1 - scene.lighting.solidShadowIntensity;
}

PhaseFunction phaseOf(const Phase& phase) {
  switch (phase.type) {
    case PhaseType::HenyeyGreenstein: return {PhaseKind::HenyeyGreenstein, phase.g};
    case PhaseType::Rayleigh: return {PhaseKind::Rayleigh, 0};
    case PhaseType::Isotropic: break;
  }
  return {};
}

}  // namespace

layout::uint falloffCode(Falloff falloff) {
  switch (falloff) {
    case Falloff::Linear: return layout::kFalloffLinear;
    case Falloff::Sphere: return layout::kFalloffSphere;
    default: return layout::kFalloffSmooth;
  }
}

layout::uint endpointCode(Endpoint endpoint) {
  return endpoint == Endpoint::Clamp ? layout::kEndpointClamp : layout::kEndpointSoft;
}

Frame prepareFrame(Scene& scene, int number, FrameStats& stats, FramePurpose purpose) {
  FrameFiles files;
  {
    const Progress progress("load");
    files = loadFrame(scene, number, purpose);
  }
  return prepareFrame(scene, std::move(files), stats);
}

Frame prepareFrame(Scene& unsettled, FrameFiles files, FrameStats& stats) {
  Scene scene = unsettled;  // a frame that fails settles nothing
  Frame frame;
  const int number = files.number;
  frame.number = stats.frame = number;
  for (const std::string& warning : files.warnings) logWarning(warning);
  frame.particles = std::move(files.particles);
  moveOrigin(scene, frame.particles.origin);
  frame.meshes = std::move(files.meshes);
  frame.blank = std::move(files.sprites);
  stats.inputs = std::move(files.inputs);
  stats.seconds["load"] = files.seconds;
  Timer timer;

  {
    std::optional<Progress> progress;
    if (!scene.solids.empty()) progress.emplace("solids");
    prepareSolids(scene, frame);
  }
  if (!scene.solids.empty()) stats.seconds["solids"] = timer.lap();
  const Progress progress("octree");

  fitDefaults(scene, frame.particles.supportBounds());
  for (const LightSource& light : scene.lights) {
    frame.lights.push_back(toLight(light));
    frame.lightNames.push_back(light.name);
  }
  prepareMedium(scene, frame);
  frame.sampleById = idsServe(scene, frame.particles);
  settleDensity(scene, frame, stats);
  frame.error = {scene.lighting.error, isAnimated(scene)};
  if (frame.density.source().empty()) frame.density = DensityTree(DensityArrays(frame).input(), densityRules(scene));
  setCameras(scene, number, frame.rules.falloff, frame.blank);
  frame.view = frame.blank.camera();
  frame.scattering = {phaseOf(scene.medium.phase), viewerOf(frame.view)};

  stats.densityScale = scene.medium.densityScale;
  stats.particles = frame.particles.size();
  stats.inOctree = frame.density.tree().particleCount();
  stats.subsample = scene.lighting.subsample;
  if (stats.subsample >= 1) stats.subsampleError = 0;
  if (stats.inOctree == 0 && stats.particles > 0)
    logWarning(fmt::format("lighting.subsample {:g} leaves none of the {} particles in the octree: none casts a shadow",
                           stats.subsample, stats.particles));
  stats.lights = frame.lights.size();
  stats.radius = radiusRange(frame.particles);
  stats.origin = frame.particles.origin;
  stats.seconds["octree"] = timer.lap();
  unsettled = std::move(scene);
  return frame;
}

}  // namespace mote
