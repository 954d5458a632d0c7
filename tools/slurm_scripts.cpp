#include "tools/slurm_scripts.h"

#include <fmt/format.h>

#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string_view>

#include "host/core/error.h"
#include "host/core/output_file.h"

namespace mote {
namespace {

namespace fs = std::filesystem;

// What stands between @ is filled in.
constexpr std::string_view kFrames = R"sh(#!/bin/bash
# Frames @FIRST@ to @LAST@, every @STEP@, @PER_TASK@ a task. Written by mote farm slurm; submit.sh submits it.
#SBATCH --job-name=@NAME@
#SBATCH --array=1-@TASKS@
#SBATCH --cpus-per-task=@CPUS@
#SBATCH --nodes=1 --ntasks=1
#SBATCH --mem=@MEMORY@M
#SBATCH --time=@MINUTES@
#SBATCH --requeue
#SBATCH --open-mode=append
@SITE@set -u
mote=@MOTE@
first=$((@FIRST@ + (SLURM_ARRAY_TASK_ID - 1) * @PER_TASK@ * @STEP@))
last=$((first + (@PER_TASK@ - 1) * @STEP@))
if ((last > @LAST@)); then last=@LAST@; fi
task=${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID
restarts=${SLURM_RESTART_COUNT:-0}

printf '== %s task %s, start %d: frames %d-%d on %s\n' \
  "$(date '+%F %T')" "$task" "$((restarts + 1))" "$first" "$last" "${SLURMD_NODENAME:-$(uname -n)}"
"$mote" render @SCENE@ --frames="$first-${last}x@STEP@" --resume \
  --threads "$SLURM_CPUS_PER_TASK" --memory-limit @MEMORY@M
code=$?
printf '== %s task %s: mote ended with %d\n' "$(date '+%F %T')" "$task" "$code"
# Above 128 a signal has ended it: memory ran out, a crash, somebody's kill. 129, 130 and 143 are its own answers to
# SIGHUP, SIGINT and SIGTERM: then somebody wants it to end. --requeue alone covers failed nodes and preemption.
# By ARRAY_TASK: SLURM_JOB_ID of one task of every array is the array's own, and would put all of it back.
if ((code > 128 && code != 129 && code != 130 && code != 143 && restarts < 3)); then
  printf '== back into the queue\n'
  scontrol requeue "$task" # Slurm ends this script here
fi
exit "$code"
)sh";

constexpr std::string_view kFinish = R"sh(#!/bin/bash
# When all tasks have ended, whatever became of them: are the frames whole? Then contact sheet and movie. Written by mote
# farm slurm.
#SBATCH --job-name=@NAME@-finish
#SBATCH --cpus-per-task=1
#SBATCH --nodes=1 --ntasks=1
#SBATCH --mem=@MEMORY@M
#SBATCH --time=@FINISH_MINUTES@
#SBATCH --requeue
#SBATCH --open-mode=append
@SITE@set -eu
mote=@MOTE@
sheet=@SHEET@
movie=@MOVIE@

printf '== %s job %s on %s\n' "$(date '+%F %T')" "$SLURM_JOB_ID" "${SLURMD_NODENAME:-$(uname -n)}"
work=$(mktemp -d)
trap 'rm -rf -- "$work"' EXIT
previews=()
if [[ -n "$sheet$movie" ]]; then previews=(--previews "$work/@PREVIEW@" --exposure @EXPOSURE@); fi
# Ends this script where frames are missing.
"$mote" farm check @SCENE@ --frames=@FIRST@-@LAST@x@STEP@ --threads "$SLURM_CPUS_PER_TASK" "${previews[@]}"
if [[ -z "$sheet$movie" ]]; then exit 0; fi

cd -- "$work"
# Numbered without gaps, for ffmpeg; frame numbers under the pictures where this machine has a font.
font=$(convert -list font | awk '$1 == "Font:" && !first {first = $2} $2 == "DejaVu-Sans" {first = $2} END {print first}')
count=0 tiles=()
for ((frame = @FIRST@; frame <= @LAST@; frame += @STEP@)); do
  name=$(printf '%06d' "$count").png
  ln -s -- "$(printf '@PREVIEW_PRINTF@' "$frame")" "$name"
  # A sheet of a hundred at most.
  if ((count % ((@FRAMES@ + 99) / 100) == 0)); then
    if [[ -n "$font" ]]; then tiles+=(-label "$frame"); fi
    tiles+=("$name")
  fi
  count=$((count + 1))
done
# Whole or not at all, as Mote's own pictures.
put() { cp -- "$1" "$2.part" && mv -- "$2.part" "$2"; }
if [[ -n "$sheet" ]]; then
  montage ${font:+-font "$font"} -background '#202020' -fill '#c0c0c0' "${tiles[@]}" -depth 8 -geometry '320x>+4+4' sheet.png
  put sheet.png "$sheet"
fi
if [[ -n "$movie" ]]; then
  # Previews are sRGB; said in the file, or players take other colours. Even sizes, as 4:2:0 wants them.
  ffmpeg -nostdin -hide_banner -loglevel error -y -framerate @FPS@ -i %06d.png \
    -vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p' \
    -color_primaries bt709 -color_trc iec61966-2-1 -colorspace bt709 -color_range tv \
    -c:v libx264 -crf 16 -movflags +faststart movie.mp4
  put movie.mp4 "$movie"
fi
printf '== %s all %d frames are there\n' "$(date '+%F %T')" "$count"
)sh";

constexpr std::string_view kSubmit = R"sh(#!/bin/bash
# Submits the frames and, behind them, the check. Once more later: frames that are there are left out. Written by mote
# farm slurm.
set -eu
cd -- "$(dirname -- "${BASH_SOURCE[0]}")"
mkdir -p logs
logs=${PWD//%/%%}/logs # Slurm reads %a and the like in paths, in the folder's as well
frames=$(sbatch --parsable --output="$logs/frames-%a.log" frames.sbatch)
frames=${frames%%;*} # "ID;CLUSTER" where Slurm has several clusters
printf 'frames %s\n' "$frames"
finish=$(sbatch --parsable --output="$logs/finish.log" --dependency="afterany:$frames" finish.sbatch)
printf 'finish %s\n' "${finish%%;*}"
)sh";

/// As one word of a shell.
std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\"'\"'") : std::string(1, c);
  return text + "'";
}

/// The job's name in a line of #SBATCH, where nothing can be quoted.
std::string plain(const std::string& name) {
  std::string text = name;
  for (char& c : text)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_' && c != '.') c = '_';
  return text;
}

std::string filledIn(std::string_view text, const std::map<std::string, std::string>& values) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t open = text.find('@', at), close = open == text.npos ? open : text.find('@', open + 1);
    const auto value = close == text.npos ? values.end()
                                          : values.find(std::string(text.substr(open + 1, close - open - 1)));
    if (close == text.npos) return result + std::string(text.substr(at));
    if (value == values.end()) {
      result += text.substr(at, close - at);  // another one, "${tiles[@]}"
      at = close;
      continue;
    }
    result += text.substr(at, open - at);
    result += value->second;
    at = close + 1;
  }
  return result;
}

void writeScript(const fs::path& path, const std::string& text) {
  writeWholeFile(path.string(), text);
  fs::permissions(path, fs::perms::owner_exec | fs::perms::group_exec, fs::perm_options::add);
}

}  // namespace

void writeSlurmScripts(const SlurmJob& job) {
  std::string scene, site;
  for (const std::string& argument : job.arguments) scene += (scene.empty() ? "" : " ") + quoted(argument);
  if (!job.partition.empty()) site += "#SBATCH --partition=" + job.partition + "\n";
  if (!job.account.empty()) site += "#SBATCH --account=" + job.account + "\n";
  const auto number = [](auto value) { return fmt::format("{}", value); };
  const std::map<std::string, std::string> values{
      {"FIRST", number(job.first)},
      {"LAST", number(job.first + (job.frames() - 1) * job.step)},
      {"STEP", number(job.step)},
      {"PER_TASK", number(job.perTask)},
      {"TASKS", number(job.tasks())},
      {"FRAMES", number(job.frames())},
      {"NAME", plain(job.name)},
      {"CPUS", number(job.cpus)},
      {"MEMORY", number(job.memoryMiB)},
      {"MINUTES", number(job.minutes)},
      {"FINISH_MINUTES", number(30 + job.frames() / 10)},
      {"SITE", site},
      {"MOTE", quoted(job.program)},
      {"SCENE", scene},
      {"SHEET", quoted(job.contactSheet)},
      {"MOVIE", quoted(job.movie)},
      {"EXPOSURE", quoted(job.exposure)},
      {"FPS", number(job.fps)},
      {"PREVIEW", "frame.#######.png"},
      {"PREVIEW_PRINTF", "frame.%07d.png"}};
  std::error_code error;
  fs::create_directories(job.folder / "logs", error);
  if (error) throw MachineError(fmt::format("{}: the folder cannot be made: {}", job.folder.string(), error.message()));
  writeScript(job.folder / "frames.sbatch", filledIn(kFrames, values));
  writeScript(job.folder / "finish.sbatch", filledIn(kFinish, values));
  writeScript(job.folder / "submit.sh", filledIn(kSubmit, values));
}

void submitSlurmJob(const SlurmJob& job) {
  const fs::path script = job.folder / "submit.sh";
  std::fflush(stdout);
  if (std::system(quoted(script.string()).c_str()) != 0)
    throw MachineError(fmt::format("{}: Slurm did not take the job (sbatch)", script.string()));
}

}  // namespace mote
