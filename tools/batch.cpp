#include "tools/batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <new>

#include "engine/settling.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/log_event.h"
#include "host/core/progress.h"
#include "host/core/timer.h"
#include "host/image/png.h"
#include "host/scene/frame_path.h"
#include "tools/render.h"
#include "tools/resume.h"

namespace mote {
namespace {

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

/// Frames in their order; one that fails is noted, and the others go on.
class Batch {
 public:
  Batch(Scene& scene, const BatchOptions& options, Renderer& renderer, RunStats& run)
      : scene_(scene), options_(options), renderer_(renderer), run_(run), loader_(scene) {}

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
    const int first = scene_.wholeShot().first;
    if (settled_ || scene_.origin || here.particles.origin == dvec3(0) || number == first) return here;
    scene_.origin = loadFrame(scene_, first, FramePurpose::Light).particles.origin;
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
    if (next && options_.ahead) loader_.prefetch(*next);
    const Image image = renderer_.draw(frame, scene_, renderer_.light(frame, lightWanted(scene_), stats), stats);
    Timer write;
    stats.warnings = takeWarnings();
    {
      const Progress progress("write");
      writeFrameExr(path, image, frame, scene_, run_, stats);
      if (!options_.preview.empty())
        writePng(framePath(options_.preview, number), image,
                 options_.exposure ? *options_.exposure : autoExposure(image));
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
  const BatchOptions& options_;
  Renderer& renderer_;
  RunStats& run_;
  FrameLoader loader_;
  bool goOn_ = false;
  bool settled_ = false;  ///< by a frame of the shot, one of this run or before it
  int exitCode_ = 0;
};

}  // namespace

int renderBatch(Scene& scene, const BatchOptions& options, Renderer& renderer, RunStats& run) {
  return Batch(scene, options, renderer, run).render();
}

}  // namespace mote
