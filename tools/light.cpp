// mote light: every particle with the light that reaches it, as a particle file that anybody can check.
#include <CLI/CLI.hpp>

#include "host/core/log.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/particles/prt_writer.h"
#include "host/scene/frame_path.h"
#include "host/scene/scene_reader.h"
#include "tools/render.h"

namespace mote {
namespace {

struct LightOptions {
  SceneOptions scene;
  std::string output, lighting;
  int frame = 0;
  bool frameGiven = false;
};

/// From slot order back to the order of the input.
template <class T>
std::vector<T> inInputOrder(const Octree& tree, const std::vector<T>& slots) {
  std::vector<T> result(slots.size());
  parallelBlocks(slots.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) result[tree.source[slot]] = slots[slot];
  });
  return result;
}

void writeLit(const std::string& path, const Frame& frame, const LitParticles& lit) {
  const std::vector<vec3> lighting = inInputOrder(frame.tree, lit.radiance);
  std::vector<std::vector<float>> transmittance;
  for (const std::vector<float>& slots : lit.transmittance) transmittance.push_back(inInputOrder(frame.tree, slots));

  std::vector<PrtColumn> columns = columnsOf(frame.particles);
  columns.push_back(PrtColumn::of("Lighting", std::span<const vec3>(lighting)));
  for (std::size_t l = 0; l < transmittance.size(); ++l)
    columns.push_back(PrtColumn::of("Transmittance_" + frame.lightNames[l], std::span<const float>(transmittance[l])));
  writePrt(path, columns);
}

void light(const LightOptions& options, const CommonOptions& common) {
  Scene scene = readScene(options.scene.scene, options.scene.overrides);
  const int number = options.frameGiven ? options.frame : scene.frames.first;
  const std::string path = framePath(options.output, number);
  { const OutputFile probe(path); }  // before any work
  std::unique_ptr<Gpu> gpu;
  const Backends backends = chooseBackends(parseBackend("--lighting", options.lighting, scene.lighting.backend),
                                           Backend::Cpu, deviceOptions(common), gpu);
  Renderer renderer(backends, gpu.get());
  FrameStats stats;
  const Frame frame = prepareFrame(scene, number, stats);
  const LitParticles lit = renderer.light(frame, true, stats);
  requireNoValidationMessages(gpu.get());
  writeLit(path, frame, lit);
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
