#!/usr/bin/env bash
# A shot of 12 frames on a Slurm of three nodes, while one node crashes and one mote is killed: in the end all pictures are
# there, byte for byte those of a plain run, and nothing was drawn twice that was whole.
# slurm_test.sh MOTE   the program to test; needs slurm_loopback.sh's packages, ImageMagick and ffmpeg. Writes
#                      only into a temporary folder. On failure it prints what Slurm and the tasks logged.
# Exit codes: 0 passed, 1 failed, 2 usage, 3 Slurm cannot run here.
set -euo pipefail

readonly limit=120 # seconds for everything, but for ending Slurm
# Particles a frame: few, which are soon written, but of seven times their size, so that a frame takes half a second on
# one thread, longer than it takes to kill.
readonly count=15000

[[ $# -eq 1 && -x "$1" ]] || { printf 'usage: slurm_test.sh MOTE\n' >&2; exit 2; }
mote=$(realpath -- "$1")
loopback=$(dirname -- "$(realpath -- "${BASH_SOURCE[0]}")")/slurm_loopback.sh
work=$(mktemp -d)
slurm=$work/slurm
# Blanks and quotes, so that every script that is written has to quote.
shot="$work/it's a \"shot\""
export SLURM_CONF="$slurm/slurm.conf"
# What this shell has of another Slurm, whose job it may be, is not this one's.
for variable in "${!SLURM_@}" "${!SBATCH_@}"; do [[ "$variable" == SLURM_CONF ]] || unset "$variable"; done

say() { printf '[%3d s] %s\n' "$SECONDS" "$*"; }

fail() {
  printf '\nslurm_test: %s\n' "$*" >&2
  exit 1
}

# All that helps to understand a failure.
report() {
  local log
  printf '\n== squeue, sinfo\n'
  timeout 5 squeue --states=all || true
  timeout 5 sinfo --Node --long || true
  "$loopback" logs "$slurm"
  for log in "$shot"/scene.farm/logs/*; do
    printf '== %s\n' "$log"
    cat -- "$log"
  done
  printf '== files\n'
  ls -lA -- "$shot" "$shot"/out "$shot"/scene.farm
}

finish() {
  local code=$?
  trap - EXIT
  if [[ $code -ne 0 && -d "$slurm" ]]; then report >&2 || true; fi
  wait # a node may be about to boot
  if [[ -d "$slurm" ]]; then "$loopback" stop "$slurm"; fi
  rm -rf -- "$work"
  exit "$code"
}
trap finish EXIT

# wait_for WHAT COMMAND...: until the command succeeds.
wait_for() {
  local what=$1
  shift
  until "$@"; do
    ((SECONDS < limit)) || fail "$what did not happen within $limit s"
    sleep 0.05
  done
}

# Bounded by what is left of the time.
bounded() {
  local code=0
  timeout "$((limit > SECONDS ? limit - SECONDS : 1))" "$@" || code=$?
  [[ $code -ne 124 ]] || fail "$1 $2 was not done within $limit s"
  return "$code"
}

picture() { printf '%s/out/plume.%04d.exr' "$shot" "$1"; }
log_of() { printf '%s/scene.farm/logs/frames-%s.log' "$shot" "$1"; }
state_of() { timeout 10 squeue --states=all --noheader --jobs="$1" --format=%T; }

# How many of the frames FIRST to LAST have their picture.
pictures() {
  local frame there=0
  for ((frame = $1; frame <= $2; ++frame)); do
    if [[ -e "$(picture "$frame")" ]]; then there=$((there + 1)); fi
  done
  printf '%d\n' "$there"
}

make_shot() {
  mkdir -p -- "$shot/out" "$shot/plain"
  (cd -- "$shot" && bounded "$mote" generate plume --count "$count" --frames 1-12 -o plume.####.prt -q)
  # Camera, light and density are open: parts of the shot must agree on them.
  cat >"$shot/scene.json" <<EOF_SCENE
{
  "particles": [{"file": "plume.####.prt", "radius": {"channel": "Radius", "scale": 7}}],
  "lighting": {"backend": "cpu"},
  "view": {"backend": "cpu"},
  "output": {"size": [320, 180]},
  "frames": {"first": 1, "last": 12}
}
EOF_SCENE
}

submit() {
  local ids
  ids=$(bounded "$mote" farm slurm "$shot/scene.json" -o "$shot/out/plume.####.exr" --per-task 4 --cpus 1 --memory 500M \
    --minutes 5 --contact-sheet "$shot/sheet.png" --movie "$shot/movie.mp4" --submit) ||
    fail "mote farm slurm failed"
  array=$(sed -n 's/^frames \([0-9]\{1,\}\)$/\1/p' <<<"$ids")
  last_job=$(sed -n 's/^finish \([0-9]\{1,\}\)$/\1/p' <<<"$ids")
  [[ -n "$array" && -n "$last_job" ]] || fail "mote farm slurm --submit printed no ids: $ids"
  # The tasks' numbers, whether they begin with 0 or 1.
  mapfile -t tasks < <(squeue --array --noheader --jobs="$array" --format=%K | sort -n)
  [[ ${#tasks[@]} -eq 3 ]] || fail "job $array has ${#tasks[@]} tasks, not 3"
}

# A kill must come in the middle of the work.
check_caught() {
  local task=$1 first=$2 there
  there=$(pictures "$first" $((first + 3)))
  ((there < 4)) || fail "task $task was killed too late: all of its pictures are there; a frame must take longer"
  printf '%d\n' "$there" >"$work/pictures_of_$task"
  say "task $task killed with $there of 4 pictures"
}

# Waits for the second picture of a task (the first one is whole then, with all that belongs to it); then its node dies,
# with all that runs there.
crash_node() {
  local task=$1 first=$2 node crashing
  wait_for "frame $first" test -e "$(picture "$first")"
  node=$(timeout 10 squeue --array --noheader --jobs="${array}_$task" --format=%N)
  [[ -n "$node" ]] || fail "task $task runs on no node"
  wait_for "frame $((first + 1))" test -e "$(picture $((first + 1)))"
  "$loopback" crash "$slurm" "$node" &
  crashing=$!
  wait_for "the death of $node" no_jobs_on "$node"
  check_caught "$task" "$first"
  wait "$crashing"
  say "$node is back"
}
no_jobs_on() { [[ -z "$("$loopback" jobs "$slurm" "$1")" ]]; }

# The same for the mote of a task only, not its script.
kill_mote() {
  local task=$1 first=$2 pid victim=
  wait_for "frame $first" test -e "$(picture "$first")"
  for pid in $("$loopback" jobs "$slurm"); do
    if grep -qzsx "SLURM_ARRAY_TASK_ID=$task" "/proc/$pid/environ" && grep -qzsx render "/proc/$pid/cmdline"; then
      victim=$pid
    fi
  done
  [[ -n "$victim" ]] || fail "task $task has no mote that could be killed"
  wait_for "frame $((first + 1))" test -e "$(picture $((first + 1)))"
  kill -KILL "$victim"
  check_caught "$task" "$first"
}

# Both were started twice; the second start found what the first one had made, but for the frame that it was killed in.
check_resumed() {
  local task=$1 there found again
  there=$(cat "$work/pictures_of_$task")
  mapfile -t found < <(sed -n 's/.*resume: \([0-9]*\) of 4 frames are there already.*/\1/p' "$(log_of "$task")")
  [[ ${#found[@]} -eq 2 ]] || fail "task $task was started ${#found[@]} times, not twice"
  [[ ${found[0]} -eq 0 ]] || fail "task $task found ${found[0]} pictures where none can have been"
  again=$((there - found[1]))
  # The newest picture may lack its preview.
  ((again >= 0 && again <= 1)) || fail "task $task had $there pictures when it was killed and drew $again of them again"
  say "task $task: started twice, drew $again of its $there pictures again"
}

check_pictures() {
  local frame
  for ((frame = 1; frame <= 12; ++frame)); do
    [[ -s "$(picture "$frame")" ]] || fail "frame $frame is missing"
    cmp -s -- "$(picture "$frame")" "$shot/plain/$frame.exr" ||
      fail "frame $frame is not the one of a plain run: its pixels or what its header says of them"
  done
}

check_sheet_and_movie() {
  local frames
  identify -format 'sheet: %w x %h\n' "$shot/sheet.png" || fail "the contact sheet is no picture"
  frames=$(ffprobe -v error -select_streams v:0 -count_frames -show_entries stream=nb_read_frames -of csv=p=0 "$shot/movie.mp4") ||
    fail "the movie cannot be read"
  [[ "$frames" == 12 ]] || fail "the movie has $frames frames, not 12"
}

check_nothing_left() {
  local left
  left=$(find "$shot" -name '*.part*' -o -name '*tmp*')
  [[ -z "$left" ]] || fail "partial files are left: $left"
  left=$("$loopback" jobs "$slurm")
  [[ -z "$left" ]] || fail "processes of jobs are left: $left"
}

say "a Slurm of three nodes"
"$loopback" start "$slurm" 3
say "12 frames of $count particles"
make_shot
say "the plain run"
bounded "$mote" render "$shot/scene.json" -o "$shot/plain/plume.####.exr" -q
for ((frame = 1; frame <= 12; ++frame)); do mv -- "$shot/plain/plume.$(printf '%04d' "$frame").exr" "$shot/plain/$frame.exr"; done

submit
say "job $array: tasks ${tasks[*]}; job $last_job behind it"
crash_node "${tasks[1]}" 5 &
killers=($!)
kill_mote "${tasks[2]}" 9 &
killers+=($!)
for killer in "${killers[@]}"; do wait "$killer" || exit 1; done

finished() { [[ "$(state_of "$last_job")" =~ ^(COMPLETED|FAILED|CANCELLED|TIMEOUT|NODE_FAIL|OUT_OF_MEMORY)$ ]]; }
wait_for "the last job" finished
[[ "$(state_of "$last_job")" == COMPLETED ]] || fail "the last job is $(state_of "$last_job")"
say "the last job is done"
check_resumed "${tasks[1]}"
check_resumed "${tasks[2]}"
check_pictures
check_sheet_and_movie
check_nothing_left
"$loopback" stop "$slurm"
say "passed: 12 pictures as those of a plain run, contact sheet and movie"
