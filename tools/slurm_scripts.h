// The scripts that render a shot as an array job of Slurm: one task for some frames each, and a last one that looks
// whether all is there. Needs Slurm 20.11 or later.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace mote {

/// Slurm's MaxArraySize is 1001 unless a site says otherwise.
constexpr int kMostSlurmTasks = 1000;

struct SlurmJob {
  std::filesystem::path folder;        ///< for scripts, logs and previews; absolute
  std::string program, name;           ///< mote, absolute; the job's name
  std::vector<std::string> arguments;  ///< the scene and flags, without --frames; paths absolute
  int first = 1, last = 1, step = 1, perTask = 1;
  double fps = 24;
  std::string partition, account;  ///< empty: the site's own
  unsigned cpus = 1;
  std::uint64_t memoryMiB = 1024;
  int minutes = 60;
  std::string contactSheet, movie, exposure;  ///< absolute; empty: none

  int frames() const { return (last - first) / step + 1; }
  int tasks() const { return (frames() + perTask - 1) / perTask; }
};

/// Writes frames.sbatch, finish.sbatch and submit.sh into the folder, which is made. Throws MachineError.
///   frames.sbatch   renders the frames of its array index with --resume; where mote is ended by a signal (memory,
///                   preemption, time, a node that fails) the task goes back into the queue, three times
///   finish.sbatch   runs when all tasks have ended, however: mote farm check, then contact sheet (ImageMagick) and
///                   movie (ffmpeg) where asked for. It fails where a frame is not there
///   submit.sh       submits both, and prints "frames ID" and "finish ID"
void writeSlurmScripts(const SlurmJob& job);

/// Runs submit.sh. Throws MachineError where it fails.
void submitSlurmJob(const SlurmJob& job);

}  // namespace mote
