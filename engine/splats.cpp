#include "engine/splats.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/image/exr.h"
#include "host/image/png.h"
#include "host/scene/camera_path.h"
#include "host/scene/missing_file.h"
#include "host/splat/full_footprint.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

constexpr std::size_t kBlock = 1 << 14;

layout::SplatCamera cameraAtFrame(const Scene& scene, double frame, layout::uint falloff) {
  const Camera camera = cameraAt(scene.camera, frame);
  const Output& output = scene.output;
  layout::SplatCamera result = makeSplatCamera(vec3(camera.position), vec3(camera.target), camera.up, camera.fov,
                                               camera.near, camera.far, output.size.x, output.size.y, falloff);
  if (camera.projection == Projection::Orthographic) makeOrthographic(result, camera.height);
  setPixelAspect(result, output.pixelAspect);
  result.apertureRadius = camera.apertureRadius;
  result.focusDistance = focusDistanceOf(camera);
  return result;
}

std::string lowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// `least`: of R, G and B; an EXR holds any number.
void checkNumbers(const std::string& path, const Image& map, float least) {
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    const vec4& p = map.pixels[i];
    const bool finite = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(p.w);
    if (finite && std::min({p.x, p.y, p.z}) >= least) continue;
    const std::size_t width = static_cast<std::size_t>(map.width);
    throw InputError(path, fmt::format("pixel {}, {}", i % width, i / width),
                     std::isfinite(least) ? "finite colours ≥ 0" : "finite numbers",
                     fmt::format("{}, {}, {}, alpha {}", p.x, p.y, p.z, p.w));
  }
}

Image readSprite(const Scene& scene, const char* key, const std::string& path, PngValues values,
                 std::vector<std::string>& files) {
  if (!std::filesystem::exists(path))
    throw InputError(scene.path, fmt::format("/view/{}", key), "a PNG or EXR picture",
                     fmt::format("{}, which does not exist", path), nearestNames(path, path));
  const bool exr = lowerCase(std::filesystem::path(path).extension().string()) == ".exr";
  Image map = exr ? readExr(path) : readPng(path, values);
  checkNumbers(path, map, values == PngValues::Color ? 0 : -std::numeric_limits<float>::infinity());
  files.push_back(path);
  return map;
}

/// A cross-section spread over a disc s times as wide is 1/s² of it in the middle; in mode peak the peak stays.
float spread(const Scene& scene) {
  const float s = scene.view.radiusScale;
  return scene.medium.densityMode == DensityMode::CrossSection ? 1 / (s * s) : 1.0f;
}

vec3 albedoOf(const ParticleSet& particles, const Medium& medium, std::size_t i) {
  const vec3 own = particles.color.empty() ? particles.uniformColor : particles.color[i];
  return singleScatteringAlbedo(medium.albedo * own, particles.absorption.empty() ? nullptr : &particles.absorption[i]);
}

/// One of a set's arrays: get(i) for the particle i of the input, in the order of the set's particles.
template <class Get>
std::vector<vec3> inSetOrder(const Frame& frame, const SplatSet& set, const Get& get) {
  const std::vector<std::uint32_t>& source = frame.density.source();
  std::vector<vec3> result(set.particles.size());
  parallelBlocks(result.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) result[k] = get(source[set.receiverOf(k)]);
  });
  return result;
}

/// Where a particle is drawn, and how it moves while the shutter is open.
struct Drawn {
  vec3 position, velocity;
};
Drawn drawn(const ParticleSet& particles, const vec3& position, std::size_t i) {
  if (!particles.shutterVelocity.empty()) return {position + particles.shutterShift[i], particles.shutterVelocity[i]};
  return {position, particles.velocity.empty() ? vec3(0) : particles.velocity[i]};
}

/// The receivers that can be seen, ascending; empty, with `all` set, where it is all of them.
std::vector<std::uint32_t> seenReceivers(const Frame& frame, const View& view, const layout::SplatScene& scene,
                                         bool& all) {
  const Receivers receivers = frame.density.receivers();
  const std::vector<std::uint32_t>& source = frame.density.source();
  const ParticleSet& particles = frame.particles;
  std::vector<std::vector<std::uint32_t>> parts((receivers.size() + kBlock - 1) / kBlock);
  parallelBlocks(receivers.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& seen = parts[begin / kBlock];
    for (std::size_t k = begin; k < end; ++k) {
      layout::SplatParticle particle{};
      const Drawn at = drawn(particles, receivers.position(k), source[k]);
      particle.position = at.position, particle.radius = particles.radius[source[k]] * view.radiusScale;
      if (maybeSeen(particle, at.velocity, scene)) seen.push_back(static_cast<std::uint32_t>(k));
    }
  });
  std::size_t count = 0;
  for (const auto& part : parts) count += part.size();
  all = count == receivers.size();
  std::vector<std::uint32_t> result;
  if (all) return result;
  result.reserve(count);
  for (auto& part : parts) {
    result.insert(result.end(), part.begin(), part.end());
    part = {};
  }
  return result;
}

}  // namespace

SplatSet readSprites(const Scene& scene, std::vector<std::string>& files) {
  const View& view = scene.view;
  SplatSet set;
  if (!view.spriteColor.empty()) {
    Image map = readSprite(scene, "sprite_color", view.spriteColor, PngValues::Color, files);
    set.scene.spriteColorWidth = static_cast<layout::uint>(map.width);
    set.scene.spriteColorHeight = static_cast<layout::uint>(map.height);
    set.spriteColor = std::move(map.pixels);
  }
  if (!view.spriteOpacity.empty()) {
    const Image map = readSprite(scene, "sprite_opacity", view.spriteOpacity, PngValues::Data, files);
    set.scene.spriteOpacityWidth = static_cast<layout::uint>(map.width);
    set.scene.spriteOpacityHeight = static_cast<layout::uint>(map.height);
    const bool hasAlpha = std::any_of(map.pixels.begin(), map.pixels.end(), [](const vec4& p) { return p.w < 1; });
    for (const vec4& p : map.pixels)
      set.spriteOpacity.push_back(std::clamp(hasAlpha ? p.w : (p.x + p.y + p.z) / 3, 0.0f, 1.0f));
  }
  return set;
}

void setCameras(const Scene& scene, int number, layout::uint falloff, SplatSet& set) {
  layout::SplatScene& s = set.scene;
  const Camera& camera = scene.camera;
  const double fps = scene.frames.fps;
  s.camera = cameraAtFrame(scene, number, falloff);
  s.openTime = camera.shutter.x, s.closeTime = camera.shutter.y;
  s.halfFrame = static_cast<float>(0.5 / fps);
  s.open = cameraAtFrame(scene, number + camera.shutter.x * fps, falloff);
  s.close = cameraAtFrame(scene, number + camera.shutter.y * fps, falloff);
  s.before = cameraAtFrame(scene, number - 0.5, falloff);
  s.after = cameraAtFrame(scene, number + 0.5, falloff);
}

SplatSet splatSet(const Frame& frame, const Scene& scene, const std::vector<vec3>& inScattered) {
  const ParticleSet& particles = frame.particles;
  const bool grey = frame.extinction.grey();
  const float peakScale = spread(scene) * (grey ? frame.extinction.uniform.x : 1.0f);
  const Receivers receivers = frame.density.receivers();
  const std::vector<std::uint32_t>& source = frame.density.source();
  SplatSet set = frame.blank;
  const bool open = set.scene.openTime != set.scene.closeTime;
  set.scene.moving = open && (!particles.velocity.empty() || !scene.camera.keys.empty()) ? 1 : 0;
  bool allSeen = true;
  set.receiver = seenReceivers(frame, scene.view, set.scene, allSeen);
  set.particles.resize(allSeen ? receivers.size() : set.receiver.size());
  parallelBlocks(set.particles.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t receiver = set.receiverOf(k), i = source[receiver];
      set.particles[k] = {.position = drawn(particles, receivers.position(receiver), i).position,
                          .radius = particles.radius[i] * scene.view.radiusScale,
                          .radiance = albedoOf(particles, scene.medium, i) * inScattered[receiver],
                          .peak = std::min(frame.peak[i] * peakScale, std::numeric_limits<float>::max())};
    }
  });
  if (!grey) set.extinction = inSetOrder(frame, set, [&](std::size_t i) { return frame.extinction.of(i); });
  const float emissionScale = scene.medium.emissionScale * spread(scene);
  if (!particles.emission.empty() && emissionScale > 0)
    set.emission = inSetOrder(frame, set, [&](std::size_t i) { return particles.emission[i] * emissionScale; });
  if (!particles.velocity.empty() && (open || scene.output.velocity))
    set.velocity = inSetOrder(frame, set, [&](std::size_t i) { return drawn(particles, vec3(0), i).velocity; });
  return set;
}

std::vector<layout::SplatParticle> relit(const SplatSet& set, const Frame& frame, const Scene& scene,
                                         const std::vector<vec3>& inScattered) {
  const std::vector<std::uint32_t>& source = frame.density.source();
  std::vector<layout::SplatParticle> particles = set.particles;
  parallelBlocks(particles.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t receiver = set.receiverOf(k);
      particles[k].radiance = albedoOf(frame.particles, scene.medium, source[receiver]) * inScattered[receiver];
    }
  });
  return particles;
}

}  // namespace mote
