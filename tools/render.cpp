// mote render: what its flags ask for, tried and limited before any work; the frames are tools/batch.h's.
#include "tools/render.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/scene/frame_path.h"
#include "host/scene/sequence.h"
#include "tools/batch.h"
#include "tools/info.h"
#include "tools/outputs.h"
#include "tools/preflight.h"
#include "tools/resume.h"
#include "tools/scene_facts.h"
#include "tools/shot_options.h"

namespace mote {
namespace {

struct RenderOptions {
  ShotOptions shot;
  BatchOptions batch;
  std::string exposure = "auto", stats, memoryLimit;
  bool dryRun = false, json = false;
};

/// Every place that will be written is tried before any work: an artist must not learn of a typo after an hour.
void checkOutputs(const RenderOptions& options, const Scene& scene) {
  const bool several = scene.frames.first + scene.frames.step <= scene.frames.last;
  for (const std::string& pattern : {scene.output.file, options.batch.preview}) {
    if (pattern.empty()) continue;
    if (several) requireFramePattern(pattern);
    prepareOutputs(pattern, scene.frames.first);
  }
  if (!options.stats.empty()) prepareOutput(options.stats);
}

/// Whether the next frame may load while one is drawn, so that the run stays within `limit` [bytes]. Throws
/// MachineError where it cannot: before any work, by what the files' headers say. `device`, a device whose memory is
/// the host's.
bool mayLoadAhead(const Scene& scene, std::uint64_t limit, bool device) {
  struct Worst {
    int frame = 0;
    std::uint64_t particles = 0;
    double ahead = 0, alone = 0;
  } worst;
  for (int number = scene.frames.first; number <= scene.frames.last; number += scene.frames.step) {
    const std::vector<SourceFacts> facts = factsOf(scene, number);
    const auto need = [&](bool ahead) {
      const MemoryNeed bytes = memoryNeed(scene, facts, ahead);
      return bytes.host + (device ? bytes.device : 0);
    };
    if (const double alone = need(false); alone > worst.alone)
      worst = {number, particlesOf(facts), need(loadsAhead(scene)), alone};
  }
  const auto most = static_cast<double>(limit);
  if (worst.ahead <= most) return true;
  if (worst.alone > most)
    throw MachineError(fmt::format(
        "frame {}: {} particles and a picture of {} × {} take about {} of memory, and --memory-limit is {}: a smaller "
        "picture, fewer layers or fewer particles take less (mote info {})",
        worst.frame, worst.particles, scene.output.size.x, scene.output.size.y, bytesText(worst.alone), bytesText(most),
        scene.path));
  logInfo(fmt::format("memory: frames load one by one, as loading ahead takes about {} and --memory-limit is {}",
                      bytesText(worst.ahead), bytesText(most)));
  return false;
}

void dryRun(const Scene& scene, const RenderOptions& options, const CommonOptions& common) {
  const nlohmann::ordered_json found = preflight(scene, common);
  if (options.json)
    fmt::print("{}\n", found.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  else
    printPreflight(found);
  std::fflush(stdout);
  requireNothingMissing(found);
}

int render(const RenderOptions& options, const CommonOptions& common) {
  Scene scene = openShot(options.shot);
  BatchOptions batch = options.batch;
  batch.exposure = parseExposure(options.exposure);
  const std::optional<std::uint64_t> limit = parseMemoryLimit("--memory-limit", options.memoryLimit);
  checkOutputs(options, scene);
  if (options.dryRun) return dryRun(scene, options, common), 0;
  checkSequences(scene);

  std::unique_ptr<Gpu> gpu;
  const Backends backends = chooseBackends(scene.lighting.backend, scene.view.backend, deviceOptions(common), gpu);
  batch.ahead = !limit || mayLoadAhead(scene, *limit, gpu && gpu->device().isCpu());
  RunStats run = runOf(scene, backends, gpu.get());
  Renderer renderer(backends, gpu.get());
  const int exitCode = renderBatch(scene, batch, renderer, run);
  requireNoValidationMessages(gpu.get());
  if (!options.stats.empty()) writeWholeFile(options.stats, statsJson(run));
  return exitCode;
}

}  // namespace

RunStats runOf(const Scene& scene, const Backends& backends, const Gpu* gpu) {
  RunStats run;
  run.device = gpu ? gpu->device().name() : "none";
  run.lighting = backends.gpuLighting ? "gpu" : "cpu";
  run.raster = backends.gpuRaster ? "gpu" : "cpu";
  run.threads = threadCount();
  run.settings = settingsOf(scene);
  return run;
}

void addRenderCommand(CLI::App& app, const CommonOptions& common, int& exitCode) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* command = app.add_subcommand("render", "Render a scene to OpenEXR");
  addShotOptions(*command, options->shot);
  command->add_option("--preview", options->batch.preview, "Also write an sRGB preview")->type_name("OUT.png");
  command->add_option("--exposure", options->exposure, "Stops for the preview, or auto")->type_name("EV");
  command->add_option("--stats", options->stats, "Write counts, seconds and memory as JSON")->type_name("OUT.json");
  command
      ->add_option("--memory-limit", options->memoryLimit,
                   "Memory that the run may take on the host: bytes, 512M or 1.5G; frames that need more are refused "
                   "before any work")
      ->type_name("SIZE");
  command->add_flag("--resume", options->batch.resume,
                    "Leave out frames whose picture is whole and was made from the same files and settings");
  CLI::Option* dryRun = command->add_flag(
      "--dry-run", options->dryRun, "Say what the run will take, what is missing and what looks wrong; write nothing");
  command->add_flag("--json", options->json, "With --dry-run: as one JSON object")->needs(dryRun);
  command->add_flag("--stop-on-error", options->batch.stopOnError,
                    "End with the first frame that fails, instead of going on with the others");
  command->callback([options, &common, &exitCode] { exitCode = render(*options, common); });
}

}  // namespace mote
