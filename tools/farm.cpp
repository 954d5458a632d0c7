// mote farm: a shot as jobs of a cluster, and whether all of it is there.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/settling.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/image/exr.h"
#include "host/image/png.h"
#include "host/scene/frame_path.h"
#include "tools/info.h"
#include "tools/preflight.h"
#include "tools/resume.h"
#include "tools/shot_options.h"
#include "tools/slurm_scripts.h"

namespace mote {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct CheckOptions {
  ShotOptions shot;
  std::string previews, exposure = "auto";
};

/// Every picture with the same number of stops: the median of what each by itself would have.
float commonExposure(const std::vector<std::string>& pictures) {
  std::vector<float> stops;
  for (const std::string& path : pictures) stops.push_back(autoExposure(readExr(path)));
  std::nth_element(stops.begin(), stops.begin() + static_cast<std::ptrdiff_t>(stops.size() / 2), stops.end());
  return stops[stops.size() / 2];
}

/// 0, or 1 where a frame's picture is not there, not whole, or not what the scene and its files would give now.
int check(const CheckOptions& options) {
  Scene scene = openShot(options.shot);
  const std::optional<float> wanted = parseExposure(options.exposure);
  RunStats run;
  run.settings = settingsOf(scene);
  run.settledBy = settleByShot(scene);
  std::vector<std::string> pictures;
  std::vector<int> missing, frames;
  for (int number = scene.frames.first; number <= scene.frames.last; number += scene.frames.step) {
    const std::string path = framePath(scene.output.file, number);
    std::error_code ignored;
    if (isRendered(path, scene, number, run)) {
      pictures.push_back(path), frames.push_back(number);
      continue;
    }
    missing.push_back(number);
    fmt::print("frame {}: {} {}\n", number, path,
               fs::exists(path, ignored) ? "is damaged, or of other files or settings" : "is missing");
  }
  if (!options.previews.empty() && !pictures.empty()) {
    const float stops = wanted ? *wanted : commonExposure(pictures);
    for (std::size_t k = 0; k < pictures.size(); ++k)
      writePng(framePath(options.previews, frames[k]), readExr(pictures[k]), stops);
    logInfo(fmt::format("previews: {} with an exposure of {:.2f} stops", pictures.size(), stops));
  }
  fmt::print("{} of {} frames are there\n", pictures.size(), pictures.size() + missing.size());
  return missing.empty() ? 0 : 1;
}

struct SlurmOptions {
  ShotOptions shot;
  int perTask = 1, minutes = 0;
  unsigned cpus = 0;
  std::string jobs, partition, account, memory, contactSheet, movie, exposure = "auto";
  bool submit = false;
};

/// Minutes that a task may take: three times what a sample says, and what a queue's node needs to begin.
int minutesOf(const Json& estimate, const SlurmOptions& options, unsigned cpus) {
  const Json& seconds = estimate["seconds"];
  const double slower = std::max(1.0, static_cast<double>(estimate["threads"].get<unsigned>()) / cpus);
  const double task = seconds["frame"].get<double>() * options.perTask + 2 * seconds["load"].get<double>() +
                      seconds["octree"].get<double>();  // the frame that settles the scene
  return 5 + static_cast<int>(std::ceil(3 * task * slower / 60));
}

/// MiB that a task may take: a quarter more than the estimate, which a test holds to a third, and what it leaves out.
std::uint64_t memoryOf(const Json& estimate) {
  const bool software = estimate["device"].get<std::string>().find("llvmpipe") != std::string::npos;
  const double bytes = estimate["host_bytes"].get<double>() + (software ? estimate["device_bytes"].get<double>() : 0);
  return 512 + static_cast<std::uint64_t>(std::ceil(1.34 * bytes / (1 << 20)));
}

void slurm(const SlurmOptions& options, const CommonOptions& common) {
  const Scene scene = openShot(options.shot);
  parseExposure(options.exposure);
  requireFramePattern(scene.output.file);
  Json found = preflight(scene, common);
  requireNothingMissing(found);
  for (const Json& sentence : found["suspicious"]) logWarning(sentence.get<std::string>());
  const Json& estimate = found["estimate"];
  SlurmJob job;
  job.program = fs::read_symlink("/proc/self/exe").string();
  job.arguments = argumentsOf(options.shot);
  if (!scene.shot)  // tasks must agree on what the shot is
    for (const auto& [key, frame] : {std::pair("first", scene.frames.first), std::pair("last", scene.frames.last)})
      job.arguments.insert(job.arguments.end(), {"--set", fmt::format("/frames/{}={}", key, frame)});
  job.first = scene.frames.first, job.last = scene.frames.last, job.step = scene.frames.step;
  job.perTask = options.perTask;
  job.fps = static_cast<double>(scene.frames.fps);
  job.name = "mote-" + fs::path(scene.path).stem().string();
  job.partition = options.partition, job.account = options.account;
  job.cpus = options.cpus > 0 ? options.cpus : threadCount();
  const std::optional<std::uint64_t> memory = parseMemoryLimit("--memory", options.memory);
  job.memoryMiB = memory ? (*memory + (1 << 20) - 1) >> 20 : memoryOf(estimate);
  job.minutes = options.minutes > 0 ? options.minutes : minutesOf(estimate, options, job.cpus);
  const auto absolute = [](const std::string& path) { return path.empty() ? path : fs::absolute(path).string(); };
  job.contactSheet = absolute(options.contactSheet), job.movie = absolute(options.movie);
  job.exposure = options.exposure;
  job.folder =
      options.jobs.empty() ? fs::absolute(fs::path(scene.path).replace_extension(".farm")) : fs::absolute(options.jobs);
  if (job.tasks() > kMostSlurmTasks)
    throw InputError("--per-task", "", fmt::format("at most {} tasks", kMostSlurmTasks), fmt::format("{}", job.tasks()),
                     "more frames a task make fewer of them");
  writeSlurmScripts(job);
  fmt::print("{} tasks of {} frames, each with {} CPUs, {} MiB and {} minutes: {}\n", job.tasks(), job.perTask,
             job.cpus, job.memoryMiB, job.minutes, (job.folder / "submit.sh").string());
  if (options.submit) submitSlurmJob(job);
}

}  // namespace

void addFarmCommand(CLI::App& app, const CommonOptions& common, int& exitCode) {
  CLI::App* farm = app.add_subcommand("farm", "Render a shot on a cluster");
  farm->require_subcommand(1);

  auto slurmOptions = std::make_shared<SlurmOptions>();
  CLI::App* command = farm->add_subcommand("slurm", "Write the shot as an array job of Slurm, and submit it");
  addShotOptions(*command, slurmOptions->shot);
  command->add_option("--per-task", slurmOptions->perTask, "Frames a task")
      ->type_name("N")
      ->check(CLI::Range(1, 1 << 20));
  command->add_option("--jobs", slurmOptions->jobs, "Folder for scripts and logs; SCENE.farm by default")
      ->type_name("DIR");
  command->add_option("--partition", slurmOptions->partition, "Slurm's partition")->type_name("NAME");
  command->add_option("--account", slurmOptions->account, "Slurm's account")->type_name("NAME");
  command->add_option("--cpus", slurmOptions->cpus, "CPUs a task; as many as here by default")
      ->type_name("N")
      ->check(CLI::Range(1, 4096));
  command->add_option("--memory", slurmOptions->memory, "Memory a task, 4G; by what a frame needs by default")
      ->type_name("SIZE");
  command->add_option("--minutes", slurmOptions->minutes, "Minutes a task may take; by a measured sample by default")
      ->type_name("N")
      ->check(CLI::Range(1, 1 << 20));
  command->add_option("--contact-sheet", slurmOptions->contactSheet, "Picture of all frames, made in the end")
      ->type_name("OUT.png");
  command->add_option("--movie", slurmOptions->movie, "Movie of all frames, made in the end")->type_name("OUT.mp4");
  command->add_option("--exposure", slurmOptions->exposure, "Stops for both, or auto: one for all frames")
      ->type_name("EV");
  command->add_flag("--submit", slurmOptions->submit, "Submit the job");
  command->callback([slurmOptions, &common] { slurm(*slurmOptions, common); });

  auto checkOptions = std::make_shared<CheckOptions>();
  command = farm->add_subcommand("check", "Say which frames of the shot are not there, or not what they should be");
  addShotOptions(*command, checkOptions->shot);
  command->add_option("--previews", checkOptions->previews, "Also write an sRGB preview of each frame that is there")
      ->type_name("OUT.####.png");
  command->add_option("--exposure", checkOptions->exposure, "Stops for the previews, or auto: one for all frames")
      ->type_name("EV");
  command->callback([checkOptions, &exitCode] { exitCode = check(*checkOptions); });
}

}  // namespace mote
