#!/usr/bin/env bash
# Feeds whatever reads files with damaged ones: builds the targets of tests/fuzz/ (clang, libFuzzer, sanitizers) and
# runs them, two at a time.
# tools/fuzz.sh [SECONDS] [TARGET...]   20 s each and all of them by default; fails where one finds something.
# What is learnt stays in build/fuzz/corpus/, what is found in build/fuzz/findings/.
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."

seconds=20
if [[ "${1:-}" =~ ^[0-9]+$ ]]; then
  seconds=$1
  shift
fi
mapfile -t targets < <(sed -nE 's/^ *mote_fuzz(_particles)?\(([a-z0-9_]+) [^.]*$/\2/p' tests/fuzz/CMakeLists.txt)
for target in "$@"; do
  if [[ ! " ${targets[*]} " == *" $target "* ]]; then
    printf 'usage: tools/fuzz.sh [SECONDS] [TARGET...]   (got "%s"; there are %s)\n' "$target" "${targets[*]}" >&2
    exit 2
  fi
done
if [[ $# -gt 0 ]]; then targets=("$@"); fi
werror=OFF
if [[ "${CI:-}" == true ]]; then werror=ON; fi

tools/setup.sh --fuzz
cmake --preset fuzz -DMOTE_WERROR="$werror"
cmake --build --preset fuzz --target "${targets[@]/#/fuzz_}"

# Freed memory is kept back for a while, to catch its use: 16 MB of it, as the limit below counts it too.
export ASAN_OPTIONS=quarantine_size_mb=16:${ASAN_OPTIONS:-}
# 64 KiB hold every structure of every format, and deflate makes 66 MB of them at most; a good file of that size is
# read in milliseconds.
limits=(-max_len=65536 -rss_limit_mb=512 -malloc_limit_mb=256 -timeout=5)
build=build/fuzz
mkdir -p "$build/findings"

# Learns into build/, from there and from what is committed.
run() {
  local learnt=$build/corpus/$1 known=()
  mkdir -p "$learnt"
  if [[ -d tests/fuzz/corpus/$1 ]]; then known=("tests/fuzz/corpus/$1"); fi # a new target has none
  "$build/tests/fuzz/fuzz_$1" "${limits[@]}" -max_total_time="$seconds" -print_final_stats=1 \
    -artifact_prefix="$build/findings/$1-" "$learnt" "${known[@]}" >"$build/$1.log" 2>&1
}

# A line for one that has ended, and its log's end where it found something.
report() {
  local log=$build/$1.log executions
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  if [[ $2 -eq 0 ]]; then
    printf '%-8s %10s executions, coverage %s\n' "$1" "$executions" "$(sed -n 's/.* cov: \([0-9]*\).*/\1/p' "$log" | tail -1)"
    return
  fi
  local finding
  finding=$(sed -n 's/.*Test unit written to //p' "$log" | tail -1)
  printf '\n%s: a finding after %s executions, in full in %s:\n\n' "$1" "${executions:-no}" "$log"
  grep -vE '^#[0-9]+[[:space:]]+(NEW|REDUCE|pulse|RELOAD|INITED)' "$log" | tail -40
  printf '\nreproduce: %s/tests/fuzz/fuzz_%s %s\n\n' "$build" "$1" "${finding:-(no file was written)}"
}

printf '\n== fuzzing %d targets for %d s each\n' "${#targets[@]}" "$seconds"
failed=0
for ((i = 0; i < ${#targets[@]}; i += 2)); do
  pair=("${targets[@]:i:2}")
  pids=()
  for target in "${pair[@]}"; do
    run "$target" &
    pids+=($!)
  done
  for k in "${!pair[@]}"; do
    status=0
    wait "${pids[k]}" || status=$?
    report "${pair[k]}" "$status"
    if [[ $status -ne 0 ]]; then failed=1; fi
  done
done
exit "$failed"
