#include "engine/frame.h"

#include <cmath>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/sha256.h"
#include "host/core/timer.h"
#include "host/lighting/auto_subsample.h"
#include "host/lighting/irradiance.h"
#include "host/lighting/medium.h"
#include "host/particles/particle_loader.h"
#include "host/scene/camera_path.h"
#include "host/scene/fitting.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

layout::Light toLight(const LightSource& source) {
  const bool directional = source.type == LightType::Directional;
  return {.position = source.position,
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

std::vector<FrameInput> hashInputs(const std::vector<std::string>& files) {
  std::vector<FrameInput> inputs;
  for (const std::string& file : files) inputs.push_back({file, sha256OfFile(file)});
  return inputs;
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
    if (channels[0].empty()) return {particles.position, particles.radius, frame.peak, {}, {}, particles.id};
    return {particles.position, particles.radius, channels[0], channels[1], channels[2], particles.id};
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
double calibratedScale(const Frame& frame, double wanted, const std::string& place) {
  const DensityArrays arrays(frame);
  const DensityTree all(arrays.input(), {});
  const vec3& uniform = frame.rules.extinction;
  const double mean = meanLineOpticalDepth(all.tree(), frame.rules.falloff) * (uniform.x + uniform.y + uniform.z) / 3;
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

/// Density scale and sub-sampling that the scene leaves open, from its first frame.
void settleDensity(Scene& scene, Frame& frame) {
  if (scene.medium.opticalDepth) {
    const double density = calibratedScale(frame, *scene.medium.opticalDepth, scene.path);
    logVerbose(fmt::format("optical_depth {} is density_scale {}", *scene.medium.opticalDepth, density));
    scene.medium.densityScale = static_cast<float>(density);
    scene.medium.opticalDepth.reset();
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
  scene.lighting.subsampleError = choice.error;
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

/// The scene format has words that no stage acts on yet. A picture without them would be wrong without a word.
void refuseUnsupported(const Scene& scene, const Frame& frame) {
  const auto refuse = [&](const char* pointer, const char* what) {
    throw InputError(scene.path, pointer, fmt::format("a scene without {}", what), what,
                     fmt::format("this version (Mote {}) reads but does not support it yet", MOTE_VERSION));
  };
  const Camera& camera = scene.camera;
  if (!scene.solids.empty()) refuse("/solids", "solids");
  if (camera.projection == Projection::Orthographic) refuse("/camera/type", "an orthographic camera");
  if (camera.shutter.x != camera.shutter.y) refuse("/camera/shutter", "motion blur");
  if (camera.apertureRadius > 0) refuse("/camera/aperture_radius", "depth of field");
  if (!scene.view.spriteColor.empty() || !scene.view.spriteOpacity.empty()) refuse("/view", "sprites");
  if (scene.output.pixelAspect != 1) refuse("/output/pixel_aspect", "pixels that are not square");
  const Output& output = scene.output;
  if (output.shadow || output.lights || output.velocity || output.opticalDepth)
    refuse("/output/aovs", "layers other than Z");
  if (!frame.extinction.grey()) refuse("/medium/extinction", "extinction that differs from colour to colour");
  if (!frame.particles.emission.empty() && scene.medium.emissionScale > 0)
    refuse("/medium/emission_scale", "particles that emit; 0 leaves the channel Emission out");
}

Frame prepareFrame(Scene& scene, int number, FrameStats& stats) {
  Frame frame;
  frame.number = stats.frame = number;
  Timer timer;
  std::vector<std::string> files;
  frame.particles = loadParticles(scene.particles, number, scene.medium.densityMode, &files);
  stats.inputs = hashInputs(files);
  stats.seconds["load"] = timer.lap();

  fitDefaults(scene, frame.particles.supportBounds());
  for (const LightSource& light : scene.lights) {
    frame.lights.push_back(toLight(light));
    frame.lightNames.push_back(light.name);
  }
  prepareMedium(scene, frame);
  refuseUnsupported(scene, frame);
  settleDensity(scene, frame);
  frame.density = DensityTree(DensityArrays(frame).input(), densityRules(scene));
  const Camera camera = cameraAt(scene.camera, number);
  frame.view = makeSplatCamera(camera.position, camera.target, camera.up, camera.fov, camera.near, camera.far,
                               scene.output.size.x, scene.output.size.y, frame.rules.falloff);
  frame.scattering = {phaseOf(scene.medium.phase), viewerOf(frame.view)};

  stats.densityScale = scene.medium.densityScale;
  stats.particles = frame.particles.size();
  stats.inOctree = frame.density.tree().particleCount();
  stats.subsample = scene.lighting.subsample;
  stats.subsampleError = scene.lighting.subsampleError;
  stats.lights = frame.lights.size();
  stats.radius = radiusRange(frame.particles);
  stats.seconds["octree"] = timer.lap();
  return frame;
}

OpticalDepthSource hostOpticalDepths(const Frame& frame) {
  return [&frame](const Receivers& receivers, const layout::Light& light, std::span<const std::uint8_t> reached,
                  const RaysDone& done) {
    return opticalDepths(frame.density.tree(), receivers, light, frame.rules, reached, done);
  };
}

namespace {

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
  parallelBlocks(reached.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) reached[k] = reaches(light, receivers.position(k)) ? 1 : 0;
  });
  return reached;
}

}  // namespace

LitParticles lightParticles(const Frame& frame, const OpticalDepthSource& source, bool keepTransmittance) {
  const Receivers receivers = frame.density.receivers();
  const std::size_t count = receivers.size();
  const std::vector<float> radii = receiverRadii(frame);
  LitParticles lit;
  lit.radiance.assign(count, vec3(0));
  Progress progress("lighting", static_cast<double>(count) * static_cast<double>(frame.lights.size()));
  for (const layout::Light& light : frame.lights) {
    const std::vector<std::uint8_t> reached = reachedBy(light, receivers);
    const std::vector<float> depths =
        source(receivers, light, reached, [&](std::size_t rays) { progress.advance(static_cast<double>(rays)); });
    std::vector<float> transmittance = transmittances(depths, count, light, frame.rules.extinction);
    addInScattering(receivers, radii, light, transmittance, {}, frame.scattering, lit.radiance);
    if (keepTransmittance) lit.transmittance.push_back(std::move(transmittance));
  }
  return lit;
}

std::vector<layout::SplatParticle> splatParticles(const Frame& frame, const Medium& medium, const View& view,
                                                  const LitParticles& lit) {
  // A cross-section spread over a disc s times as wide is 1/s² of it in the middle; in mode peak the peak stays.
  const float spread =
      medium.densityMode == DensityMode::CrossSection ? 1 / (view.radiusScale * view.radiusScale) : 1.0f;
  const float peakScale = spread * frame.extinction.uniform.x;  // grey, see refuseUnsupported
  const Receivers receivers = frame.density.receivers();
  const std::vector<std::uint32_t>& source = frame.density.source();
  const ParticleSet& particles = frame.particles;
  std::vector<layout::SplatParticle> splats(receivers.size());
  parallelBlocks(splats.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = source[k];
      const vec3 own = particles.color.empty() ? particles.uniformColor : particles.color[i];
      const vec3 albedo = singleScatteringAlbedo(medium.albedo * own,
                                                 particles.absorption.empty() ? nullptr : &particles.absorption[i]);
      splats[k] = {.position = receivers.position(k),
                   .radius = particles.radius[i] * view.radiusScale,
                   .radiance = albedo * lit.radiance[k],
                   .peak = std::min(frame.peak[i] * peakScale, std::numeric_limits<float>::max())};
    }
  });
  return splats;
}

}  // namespace mote
