#include "tools/scene_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/octree/octree.h"
#include "host/particles/our_channels.h"
#include "host/scene/frame_path.h"
#include "host/scene/missing_file.h"
#include "host/scene/sequence.h"
#include "host/solids/surfaces.h"
#include "shaders/glsl/layout/node.h"
#include "shaders/glsl/layout/sort.h"
#include "shaders/glsl/layout/splat.h"

namespace mote {
namespace {

const char* nameOf(Generator generator) {
  switch (generator) {
    case Generator::Ball: return "ball";
    case Generator::Cloud: return "cloud";
    case Generator::Plume: return "plume";
    case Generator::None: break;
  }
  return "none";
}

std::string radiusText(const ParticleSource& source, bool hasChannel) {
  const RadiusRule& rule = source.radius;
  if (rule.kind == RadiusRule::Kind::Number) return fmt::format("{:g}", rule.value);
  if (rule.kind == RadiusRule::Kind::Channel) return fmt::format("channel {} × {:g}", rule.channel, rule.scale);
  return hasChannel ? "channel Radius" : "auto: 1.5 × the mean distance to the nearest 8";
}

SourceFacts fileFacts(const ParticleSource& source, int frame) {
  const std::string path = framePath(source.file, frame);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    throw InputError(path, "", "a particle file", "no such file", nearestNames(source.file, path));
  const std::unique_ptr<ParticleFile> file = openParticleFile(path, samplingOf(source));
  const auto has = [&](const std::string& ours) {
    return file->channel(nameInFile(source, *file, ours).theirs) != nullptr;
  };
  return {.count = file->count(),
          .from = path,
          .radius = radiusText(source, has("Radius")),
          .color = has("Color"),
          .absorption = has("Absorption"),
          .emission = has("Emission"),
          .velocity = has("Velocity"),
          .id = has("ID")};
}

/// What of a scene decides about its memory.
struct MemoryFacts {
  double particles, pixels, lights;
  double share;      ///< of the particles in the octree; "auto" may take all
  double cellNodes;  ///< bytes of nodes a particle in the tree
  bool color, absorption, emission, velocity, id;
  bool moving;       ///< velocities are drawn
  bool curved;       ///< paths in the shutter beside them
  bool rgb, solids;  ///< extinction that is not grey; solids that are seen
  bool ahead;        ///< the next frame's particles load meanwhile

  MemoryFacts(const std::vector<SourceFacts>& sources, const Scene& scene, bool loadedAhead) : ahead(loadedAhead) {
    const auto any = [&](bool SourceFacts::*has) {
      return std::any_of(sources.begin(), sources.end(), [&](const SourceFacts& s) { return s.*has; });
    };
    particles = static_cast<double>(particlesOf(sources));
    pixels = double(scene.output.size.x) * scene.output.size.y;
    lights = scene.defaultLights ? 1 : static_cast<double>(scene.lights.size());
    share = scene.lighting.autoSubsample ? 1 : scene.lighting.subsample;
    // Particles a cell × nodes a particle: between 2 and 7, by how the particles fall into the cells; measured for the
    // three generators, 10⁴ to 10⁶ particles, 8 to 128 a cell.
    const double perCell =
        scene.lighting.particlesPerCell > 0 ? scene.lighting.particlesPerCell : kDefaultParticlesPerCell;
    cellNodes = std::min(2.0, 4 / perCell) * sizeof(layout::Node);
    color = any(&SourceFacts::color), absorption = any(&SourceFacts::absorption);
    emission = any(&SourceFacts::emission), velocity = any(&SourceFacts::velocity), id = any(&SourceFacts::id);
    moving = velocity && (scene.output.velocity || scene.camera.shutter.x != scene.camera.shutter.y);
    curved = scene.camera.shutter.x != scene.camera.shutter.y &&
             std::any_of(scene.particles.begin(), scene.particles.end(),
                         [](const ParticleSource& source) { return source.interpolate == Interpolation::Hermite; });
    const vec3& e = scene.medium.extinction;
    rgb = absorption || e.x != e.y || e.y != e.z;
    solids = std::any_of(scene.solids.begin(), scene.solids.end(),
                         [](const Solid& solid) { return solid.mode != SolidMode::Hidden; });
  }
  /// Receivers of their own beside those in the tree.
  bool sampled() const { return share < 1; }
  /// The splat of a particle with what full splats have: colours, emission, velocity.
  double splat() const { return sizeof(layout::SplatParticle) + 12.0 * (rgb + emission + moving); }
};

/// Bytes a particle on the host while the picture is drawn, which is when most is held.
double particleBytes(const MemoryFacts& f, const Output& output) {
  const double loaded =
      12 + 4 + 4 + 12.0 * (f.color + f.absorption + f.emission + f.velocity) + 8.0 * f.id + 24.0 * f.curved;
  const double set = loaded * (f.ahead ? 2 : 1) + 4;  // and the optical depth through each
  const double tree = f.share * (6 * 4 + 8 * f.absorption + f.cellNodes) + (f.sampled() ? 5 * 4 : 0);
  const double sort = 8 + 4;                                                                 // (key, index) and order
  const double splats = f.splat() + 12.0 * f.absorption;                                     // and factors of colours
  const double byLight = output.lights ? 12 * f.lights + sizeof(layout::SplatParticle) : 0;  // and one light's splats
  return set + tree + sort + splats + byLight;
}

/// Bytes a pixel of one drawing.
double drawnBytes(const MemoryFacts& f, const Output& output) {
  return 16 + 4.0 * output.depth + 4.0 * output.opticalDepth + 8.0 * output.velocity + 12.0 * f.rgb;
}

/// Bytes a pixel on the host, as if surfaces were all over the picture: while it is drawn, or while they are gathered.
double pixelBytes(const MemoryFacts& f, const Output& output) {
  const double lightLayers = output.lights ? f.lights + f.emission : 0;
  const double layers = 4 * (output.shadow ? f.lights : 0) + 12 * lightLayers;
  const double one = lightLayers > 0 ? 16 + 12.0 * (f.rgb && f.solids) : 0;  // the picture by one light
  const double drawn = drawnBytes(f, output) + layers + one;
  if (!f.solids) return drawn + (output.precision == Precision::Half ? 2 * (4 + 3.0 * f.rgb + 3 * lightLayers) : 0);
  const double surfaces = sizeof(Surface) + 4 + 12 + 16 * f.lights;  // and where a pixel's begin, and their light
  // Two drawings at once, and four depths for the rasteriser; what is written as half comes when all that is gone.
  return std::max(2.0 * sizeof(Surface) + 4, drawn + drawnBytes(f, output) + one + 4 * 4 + surfaces);
}

}  // namespace

SourceFacts factsOf(const ParticleSource& source, int frame) {
  if (!source.file.empty()) return fileFacts(source, frame);
  return {.count = source.count,
          .from = nameOf(source.generate),
          .radius = radiusText(source, true),
          .velocity = source.generate == Generator::Plume,
          .id = true};
}

std::vector<SourceFacts> factsOf(const Scene& scene, int frame) {
  std::vector<SourceFacts> facts;
  for (const ParticleSource& source : scene.particles)
    facts.push_back(
        factsOf(source, source.file.empty() ? frame : fileFrame(source.file, frame, scene.inputs.missing)));
  return facts;
}

std::uint64_t particlesOf(const std::vector<SourceFacts>& facts) {
  std::uint64_t count = 0;
  for (const SourceFacts& source : facts) count += source.count;
  return count;
}

bool loadsAhead(const Scene& scene) {
  return scene.frames.first + scene.frames.step <= scene.frames.last && threadCount() > 1;
}

MemoryNeed memoryNeed(const Scene& scene, const std::vector<SourceFacts>& facts, bool ahead) {
  const MemoryFacts f(facts, scene, ahead);
  constexpr double kProgram = 50e6;  // code, libraries (30 MB are OpenVDB's tables), threads
  const double channels = f.absorption ? 3 : 1;
  const double lighting = f.share * (f.cellNodes + 16 + 4 * channels) + 4 + 4 * channels +  // tree, order, result
                          (f.sampled() ? 16 + 4 : 0);
  const double drawing = f.splat() + sizeof(layout::SortPair) + 4;
  const bool layers = scene.output.depth || scene.output.opticalDepth || scene.output.velocity || f.rgb;
  return {.host = kProgram + f.particles * particleBytes(f, scene.output) + f.pixels * pixelBytes(f, scene.output),
          .device = std::max(f.particles * lighting,
                             f.particles * drawing + f.pixels * ((layers ? 40 : 16) + 4.0 * f.solids))};
}

}  // namespace mote
