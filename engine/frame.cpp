#include "engine/frame.h"

#include <cmath>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/sha256.h"
#include "host/core/timer.h"
#include "host/lighting/medium.h"
#include "host/particles/particle_loader.h"
#include "host/scene/fitting.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

layout::Light toLight(const LightSource& source) {
  const bool point = source.type == LightType::Point;
  return {.position = source.position,
          .type = point ? layout::kLightPoint : layout::kLightDirectional,
          .direction = source.direction,
          .decay = point ? source.decay : 0.0f,
          .power = source.strength * source.color,
          .shadowDensity = source.shadowDensity,
          .castsShadows = source.castsShadows ? 1u : 0u};
}

std::vector<FrameInput> hashInputs(const std::vector<std::string>& files) {
  std::vector<FrameInput> inputs;
  for (const std::string& file : files) inputs.push_back({file, sha256OfFile(file)});
  return inputs;
}

/// The scale on Density that gives lines through the particles of `tree`, built with scale 1, the mean optical depth
/// that the scene asks for.
double calibratedScale(const Octree& tree, double wanted, layout::uint falloff, const std::string& place) {
  const double mean = meanLineOpticalDepth(tree, falloff);
  if (!(mean > 0))
    throw InputError(place, "/medium/optical_depth", "particles with some density to calibrate",
                     "a mean optical depth of 0", "is the channel Density zero everywhere?");
  return wanted / mean;
}

/// Optical depths are proportional to the density, so a tree is built once and then scaled.
void scaleDensity(Octree& tree, double scale) {
  parallelBlocks(tree.peak.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      tree.peak[i] = static_cast<float>(std::min(tree.peak[i] * scale, double(std::numeric_limits<float>::max())));
  });
}

/// Camera, lights and density scale that the scene leaves open, from its first frame.
void settle(Scene& scene, const ParticleSet& particles, const Octree& tree, layout::uint falloff) {
  fitDefaults(scene, particles.supportBounds());
  if (!scene.medium.opticalDepth) return;
  const double scale = calibratedScale(tree, *scene.medium.opticalDepth, falloff, scene.path);
  logVerbose(fmt::format("optical_depth {} is density_scale {}", *scene.medium.opticalDepth, scale));
  scene.medium.densityScale = static_cast<float>(scale);
  scene.medium.opticalDepth.reset();
}

Octree buildTree(const ParticleSet& particles, const Scene& scene, layout::uint falloff) {
  const bool crossSection = scene.medium.densityMode == DensityMode::CrossSection;
  const std::uint32_t cell = scene.lighting.particlesPerCell;
  return buildOctree(particles.position, particles.radius,
                     peakOpticalDepths(particles.density, particles.radius, falloff, crossSection, 1.0),
                     cell > 0 ? cell : kDefaultParticlesPerCell);
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

Frame prepareFrame(Scene& scene, int number, FrameStats& stats) {
  Frame frame;
  frame.number = stats.frame = number;
  Timer timer;
  std::vector<std::string> files;
  frame.particles = loadParticles(scene.particles, number, scene.medium.densityMode, &files);
  stats.inputs = hashInputs(files);
  stats.seconds["load"] = timer.lap();

  frame.rules = {falloffCode(scene.medium.falloff), endpointCode(scene.lighting.endpoint), scene.lighting.cutoff};
  frame.tree = buildTree(frame.particles, scene, frame.rules.falloff);
  settle(scene, frame.particles, frame.tree, frame.rules.falloff);
  scaleDensity(frame.tree, scene.medium.densityScale);
  frame.view =
      makeSplatCamera(scene.camera.position, scene.camera.target, scene.camera.up, scene.camera.fov, scene.camera.near,
                      scene.camera.far, scene.output.size.x, scene.output.size.y, frame.rules.falloff);
  for (const LightSource& light : scene.lights) {
    frame.lights.push_back(toLight(light));
    frame.lightNames.push_back(light.name);
  }
  stats.densityScale = scene.medium.densityScale;
  stats.particles = frame.particles.size();
  stats.inOctree = frame.tree.particleCount();
  stats.lights = frame.lights.size();
  stats.radius = radiusRange(frame.particles);
  stats.seconds["octree"] = timer.lap();
  return frame;
}

OpticalDepthSource hostOpticalDepths(const Frame& frame) {
  return [&frame](const layout::Light& light, const RaysDone& done) {
    return opticalDepths(frame.tree, light, frame.rules, done);
  };
}

LitParticles lightParticles(const Frame& frame, const OpticalDepthSource& source, bool keepTransmittance) {
  const std::size_t count = frame.tree.particleCount();
  LitParticles lit;
  lit.radiance.assign(count, vec3(0));
  Progress progress("lighting", static_cast<double>(count) * static_cast<double>(frame.lights.size()));
  for (const layout::Light& light : frame.lights) {
    const std::vector<float> depths =
        source(light, [&](std::size_t rays) { progress.advance(static_cast<double>(rays)); });
    std::vector<float> transmittance = transmittances(depths, light);
    addInScattering(frame.tree, light, transmittance, lit.radiance);
    if (keepTransmittance) lit.transmittance.push_back(std::move(transmittance));
  }
  return lit;
}

std::vector<layout::SplatParticle> splatParticles(const Frame& frame, const Medium& medium, const LitParticles& lit) {
  const Octree& tree = frame.tree;
  const std::vector<vec3>& color = frame.particles.color;
  std::vector<layout::SplatParticle> splats(tree.particleCount());
  parallelBlocks(splats.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const vec3 own = color.empty() ? frame.particles.uniformColor : color[tree.source[slot]];
      splats[slot] = {.position = tree.position(slot),
                      .radius = tree.radius[slot],
                      .radiance = medium.albedo * own * lit.radiance[slot],
                      .peak = tree.peak[slot]};
    }
  });
  return splats;
}

}  // namespace mote
