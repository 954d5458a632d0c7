// mote render: a scene's frames to EXR pictures and PNG previews.
#include "tools/render.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <new>
#include <nlohmann/json.hpp>

#include "engine/settling.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/log_event.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/core/progress.h"
#include "host/core/timer.h"
#include "host/image/png.h"
#include "host/scene/frame_path.h"
#include "host/scene/sequence.h"
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
  std::string preview, exposure = "auto", stats, memoryLimit;
  bool stopOnError = false, resume = false, dryRun = false, json = false;
};

/// Every place that will be written is tried before any work: an artist must not learn of a typo after an hour.
void checkOutputs(const RenderOptions& options, const Scene& scene) {
  const bool several = scene.frames.first + scene.frames.step <= scene.frames.last;
  for (const std::string& pattern : {scene.output.file, options.preview}) {
    if (pattern.empty()) continue;
    if (several && !hasFramePattern(pattern))
      throw InputError(pattern, "", "#### in the name, since there are several frames", "the same name for all of them",
                       "frame.####.exr, for example");
    prepareOutputs(pattern, scene.frames.first);
  }
  if (!options.stats.empty()) prepareOutput(options.stats);
}

/// The stages in the order of the work, those that there were.
std::string stageSeconds(const FrameStats& stats) {
  std::string text;
  for (const char* stage : {"load", "octree", "lighting", "sort", "splat", "solids", "write"})
    if (const auto found = stats.seconds.find(stage); found != stats.seconds.end())
      text += fmt::format("{}{} {:.1f}", text.empty() ? "" : ", ", stage, found->second);
  return text;
}

/// What became of a run's frames, "1-4" a line where neighbours fared alike.
std::string frameTable(const RunStats& run, int step) {
  struct Row {
    int first, last;
    std::string result;
  };
  std::map<int, std::string> results;
  for (const FrameStats& done : run.frames) results[done.frame] = "written";
  for (const FailedFrame& failed : run.failed) results[failed.frame] = failed.error;
  for (const int frame : run.skipped) results[frame] = "there already";
  std::vector<Row> rows;
  for (const auto& [frame, result] : results) {
    if (!rows.empty() && rows.back().result == result && rows.back().last + step == frame)
      rows.back().last = frame;
    else
      rows.push_back({frame, frame, result});
  }
  std::string text;
  for (const Row& row : rows) {
    const std::string frames =
        row.first == row.last ? fmt::format("{}", row.first) : fmt::format("{}-{}", row.first, row.last);
    text += fmt::format("\n  {:>11}  {}", frames, row.result);
  }
  return text;
}

/// Whether the next frame may load while one is drawn, so that the run stays within `limit` [bytes]. Throws MachineError
/// where it cannot: before any work, by what the files' headers say. `device`, a device whose memory is the host's.
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
        worst.frame, worst.particles, scene.output.size.x, scene.output.size.y, bytesText(worst.alone),
        bytesText(most), scene.path));
  logInfo(fmt::format("memory: frames load one by one, as loading ahead takes about {} and --memory-limit is {}",
                      bytesText(worst.ahead), bytesText(most)));
  return false;
}

/// Frames in their order; one that fails is noted, and the others go on.
class Batch {
 public:
  /// `ahead`: a frame's files load while the one before is drawn.
  Batch(Scene& scene, const RenderOptions& options, Renderer& renderer, RunStats& run, bool ahead)
      : scene_(scene), options_(options), renderer_(renderer), run_(run), ahead_(ahead), loader_(scene) {}

  /// 0, or the exit code of the worst.
  int render() {
    const std::vector<int> frames = framesToDraw();
    goOn_ = frames.size() + run_.skipped.size() > 1 && !options_.stopOnError;
    BatchProgress progress(frames.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
      progress.begin(frames[k]);
      const bool written = draw(frames[k], k + 1 < frames.size() ? std::optional(frames[k + 1]) : std::nullopt);
      progress.end(written);
    }
    logSummary(run_.failed.size());
    if (!run_.failed.empty() && logFormat() == LogFormat::Text)
      logFailure("", {},
                 fmt::format("mote: {} of {} frames failed:{}", run_.failed.size(),
                             run_.failed.size() + run_.frames.size() + run_.skipped.size(),
                             frameTable(run_, scene_.frames.step)));
    return exitCode_;
  }

 private:
  /// With --resume, those whose pictures are there are noted as skipped.
  std::vector<int> framesToDraw() {
    std::vector<int> frames;
    if (options_.resume) settle({});
    std::optional<Progress> progress;
    if (options_.resume)
      progress.emplace("resume", 1 + (scene_.frames.last - scene_.frames.first) / scene_.frames.step, "frames");
    for (int number = scene_.frames.first; number <= scene_.frames.last; number += scene_.frames.step) {
      const bool there = options_.resume && isRendered(framePath(scene_.output.file, number), scene_, number, run_) &&
                         (options_.preview.empty() || std::filesystem::exists(framePath(options_.preview, number)));
      (there ? run_.skipped : frames).push_back(number);
      if (there) logEvent("frame_skipped", {{"frame", number}, {"file", framePath(scene_.output.file, number)}});
      if (progress) progress->advance(1);
    }
    if (options_.resume)
      logInfo(fmt::format("resume: {} of {} frames are there already", run_.skipped.size(),
                          run_.skipped.size() + frames.size()));
    return frames;
  }
  /// Whatever part of the shot this run draws, what the scene leaves open is as it is for all of it.
  void settle(std::optional<int> before) {
    run_.settledBy = settleByShot(scene_, before);
    settled_ = run_.settledBy.has_value();
  }
  void logSummary(std::size_t failed) const {
    logEvent("summary", {{"written", run_.frames.size()}, {"failed", failed}, {"skipped", run_.skipped.size()}});
  }
  /// True where the frame was written.
  bool draw(int number, std::optional<int> next) {
    const auto fail = [&](int code, const std::string& error) {
      logFailure("frame_failed", {{"error", error}, {"exit_code", code}},
                 goOn_ ? fmt::format("mote: frame {}: {}", number, error) : "");
      if (!goOn_) {
        setEventFrame(std::nullopt);
        logSummary(1);
        throw;  // the error of the run
      }
      run_.failed.push_back({number, error});
      takeWarnings();  // they are not the next frame's
      exitCode_ = std::max(exitCode_, code);
    };
    try {
      drawFrame(number, next);
      return true;
    } catch (const InputError& error) {
      fail(kBadInput, error.what());
    } catch (const MachineError& error) {
      fail(kMachine, error.what());
    } catch (const std::bad_alloc&) {
      fail(kMachine, "memory ran out");
    }
    return false;
  }
  /// The frame's files; where they are far from 0 and the scene gives no origin, measured from that of the shot.
  FrameFiles files(int number) {
    if (!settled_) settle(number);
    FrameFiles here = loader_.take(number);
    const Frames& shot = scene_.shot ? *scene_.shot : scene_.frames;
    if (settled_ || scene_.origin || here.particles.origin == dvec3(0) || number == shot.first) return here;
    scene_.origin = loadFrame(scene_, shot.first, FramePurpose::Light).particles.origin;
    return loadFrame(scene_, number, FramePurpose::Picture);
  }
  /// `next` begins to load as soon as the scene is settled.
  void drawFrame(int number, std::optional<int> next) {
    FrameStats stats;
    Timer total;
    const std::string path = framePath(scene_.output.file, number);
    FrameFiles loaded = files(number);
    const bool open = leavesOpen(scene_);
    const Frame frame = prepareFrame(scene_, std::move(loaded), stats);
    if (open) run_.settledBy = number;
    stats.settledBy = run_.settledBy;
    settled_ = true;
    if (next && ahead_) loader_.prefetch(*next);
    const Image image = renderer_.draw(frame, scene_, renderer_.light(frame, lightWanted(scene_), stats), stats);
    Timer write;
    stats.warnings = takeWarnings();
    {
      const Progress progress("write");
      writeFrameExr(path, image, frame, scene_, run_, stats);
      if (!options_.preview.empty())
        writePng(framePath(options_.preview, number), image,
                 parseExposure(options_.exposure).value_or(autoExposure(image)));
    }
    stats.seconds["write"] = write.seconds();
    stats.seconds["total"] = total.seconds();
    logEvent("frame_done",
             {{"file", path}, {"seconds", stats.seconds}, {"particles", stats.particles}, {"lights", stats.lights}},
             fmt::format("frame {}: {} particles, {} lights, {:.1f} s ({}) -> {}", number, stats.particles,
                         stats.lights, stats.seconds["total"], stageSeconds(stats), path));
    run_.frames.push_back(std::move(stats));
  }

  Scene& scene_;
  const RenderOptions& options_;
  Renderer& renderer_;
  RunStats& run_;
  bool ahead_;
  FrameLoader loader_;
  bool goOn_ = false;
  bool settled_ = false;  ///< by a frame of the shot, one of this run or before it
  int exitCode_ = 0;
};

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
  parseExposure(options.exposure);
  const std::optional<std::uint64_t> limit = parseMemoryLimit("--memory-limit", options.memoryLimit);
  checkOutputs(options, scene);
  if (options.dryRun) return dryRun(scene, options, common), 0;
  checkSequences(scene);

  std::unique_ptr<Gpu> gpu;
  const Backends backends = chooseBackends(scene.lighting.backend, scene.view.backend, deviceOptions(common), gpu);
  const bool ahead = !limit || mayLoadAhead(scene, *limit, gpu && gpu->device().isCpu());
  RunStats run = runOf(scene, backends, gpu.get());
  Renderer renderer(backends, gpu.get());
  const int exitCode = Batch(scene, options, renderer, run, ahead).render();
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
  command->add_option("--preview", options->preview, "Also write an sRGB preview")->type_name("OUT.png");
  command->add_option("--exposure", options->exposure, "Stops for the preview, or auto")->type_name("EV");
  command->add_option("--stats", options->stats, "Write counts, seconds and memory as JSON")->type_name("OUT.json");
  command
      ->add_option("--memory-limit", options->memoryLimit,
                   "Memory that the run may take on the host: bytes, 512M or 1.5G; frames that need more are refused "
                   "before any work")
      ->type_name("SIZE");
  command->add_flag("--resume", options->resume,
                    "Leave out frames whose picture is whole and was made from the same files and settings");
  CLI::Option* dryRun = command->add_flag(
      "--dry-run", options->dryRun, "Say what the run will take, what is missing and what looks wrong; write nothing");
  command->add_flag("--json", options->json, "With --dry-run: as one JSON object")->needs(dryRun);
  command->add_flag("--stop-on-error", options->stopOnError,
                    "End with the first frame that fails, instead of going on with the others");
  command->callback([options, &common, &exitCode] { exitCode = render(*options, common); });
}

}  // namespace mote
