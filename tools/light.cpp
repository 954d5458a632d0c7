// mote light: every particle with the light that reaches it, as a particle file that anybody can check.
#include <CLI/CLI.hpp>

#include "engine/settling.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/progress.h"
#include "host/particles/formats/prt_writer.h"
#include "host/scene/frame_path.h"
#include "tools/outputs.h"
#include "tools/render.h"

namespace mote {
namespace {

struct LightOptions {
  SceneOptions scene;
  std::string output, lighting;
  int frame = 0;
  bool frameGiven = false;
};

/// From the receivers' order back to that of the input.
template <class T, class Get>
std::vector<T> inInputOrder(const Frame& frame, const Get& get) {
  const std::vector<std::uint32_t>& source = frame.density.source();
  std::vector<T> result(source.size());
  parallelBlocks(source.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) result[source[k]] = get(k);
  });
  return result;
}

void writeLit(const std::string& path, const Frame& frame, const LitParticles& lit) {
  const std::size_t count = lit.radiance.size();
  const std::vector<vec3> lighting = inInputOrder<vec3>(frame, [&](std::size_t k) { return lit.radiance[k]; });
  std::vector<std::vector<float>> grey(lit.transmittance.size());  // one of the two for each light
  std::vector<std::vector<vec3>> colored(lit.transmittance.size());
  std::vector<PrtColumn> columns = columnsOf(frame.particles);
  columns.push_back(PrtColumn::of("Lighting", std::span<const vec3>(lighting)));
  for (std::size_t l = 0; l < lit.transmittance.size(); ++l) {
    const std::vector<float>& t = lit.transmittance[l];
    const std::string name = "Transmittance_" + frame.lightNames[l];
    if (t.size() == count) {
      grey[l] = inInputOrder<float>(frame, [&](std::size_t k) { return t[k]; });
      columns.push_back(PrtColumn::of(name, std::span<const float>(grey[l])));
    } else {
      colored[l] = inInputOrder<vec3>(frame, [&](std::size_t k) { return vec3(t[k], t[count + k], t[2 * count + k]); });
      columns.push_back(PrtColumn::of(name, std::span<const vec3>(colored[l])));
    }
  }
  // Positions are float32, measured from here.
  const dvec3 origin = frame.particles.origin;
  std::vector<Metadata> metadata;
  if (origin != dvec3(0)) metadata.push_back(Metadata::float64s("", "Origin", {origin.x, origin.y, origin.z}));
  writePrt(path, columns, metadata);
}

void light(const LightOptions& options, const CommonOptions& common) {
  Scene scene = openScene(options.scene);
  const int number = options.frameGiven ? options.frame : scene.frames.first;
  const std::string path = framePath(options.output, number);
  prepareOutput(path);
  std::unique_ptr<Gpu> gpu;
  const Backends backends = chooseBackends(parseBackend("--lighting", options.lighting, scene.lighting.backend),
                                           Backend::Cpu, deviceOptions(common), gpu);
  Renderer renderer(backends, gpu.get());
  FrameStats stats;
  settleByShot(scene, number);
  const Frame frame = prepareFrame(scene, number, stats, FramePurpose::Light);
  const LitParticles lit = renderer.light(frame, {.transmittance = true}, stats);
  requireNoValidationMessages(gpu.get());
  {
    const Progress progress("write");
    writeLit(path, frame, lit);
  }
  logInfo(fmt::format("frame {}: {} particles, {} lights, lighting {:.1f} s -> {}", number, stats.particles,
                      stats.lights, stats.seconds["lighting"], path));
}

}  // namespace

void addLightCommand(CLI::App& app, const CommonOptions& common, int&) {
  auto options = std::make_shared<LightOptions>();
  CLI::App* command = app.add_subcommand("light",
                                         "Write every particle with Lighting (RGB, W/(m² sr) before the albedo) and "
                                         "Transmittance_<light>");
  addSceneOptions(*command, options->scene);
  command->add_option("-o,--output", options->output, "Particle file to write")->required()->type_name("LIT.prt");
  command->add_option("--lighting", options->lighting, "Where lighting runs: cpu, gpu or auto")->type_name("WHERE");
  CLI::Option* frame = command->add_option("--frame", options->frame, "Frame; the scene's first by default");
  command->callback([options, frame, &common] {
    options->frameGiven = frame->count() > 0;
    light(*options, common);
  });
}

}  // namespace mote
