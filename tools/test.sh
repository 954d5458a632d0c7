#!/usr/bin/env bash
# Installs what is missing, builds the presets dev and asan and runs the tests with both, on Mesa's lavapipe: all of them,
# but of the slowest each with one alone, where both are run.
# tools/test.sh [dev|asan]...   only these; CI=true makes warnings errors. The last lines are ctest's own summary.
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."

presets=("$@")
if [[ ${#presets[@]} -eq 0 ]]; then presets=(dev asan); fi
for preset in "${presets[@]}"; do
  if [[ "$preset" != dev && "$preset" != asan ]]; then
    printf 'usage: tools/test.sh [dev|asan]...   (got "%s")\n' "$preset" >&2
    exit 2
  fi
done
werror=OFF
if [[ "${CI:-}" == true ]]; then werror=ON; fi

# One driver and one vector width, whatever else the machine has: the subgroup size depends on it.
VK_ICD_FILENAMES=/usr/share/vulkan/icd.d/lvp_icd.$(uname -m).json
export VK_ICD_FILENAMES LP_NATIVE_VECTOR_WIDTH=256

# Ten to a hundred seconds each. Files that are damaged at every place are for the sanitizers to look on; errors of light
# measured over many clouds, pictures over many frames and a cluster's shots are for the build that is fast, as other
# tests go the same ways of the code under sanitizers.
declare -A left_out=(
  [dev]='SurvivesEveryFlippedBit|SurvivesFlippedBits|Hdf5Reader.SurvivesDamage|VdbReader.RefusesTruncationAtEveryByte'
  [asan]='Approximate.*(KeepsTheErrorOnRealSmoke|DoesNotFlicker|ServesWhereVeryMany|ProbesFew)|LevelOfDetail.KeepsIt'
)
left_out[asan]+='|LightGrid.ConvergesToTheExactSum|LightGridPassTest.SplitsTilesThatDoNotFit|Occlusion.AgreesWithEveryTriangle'
left_out[asan]+='|Faults.(WhatNoPartsCanHelp|MemoryThatRunsOut)|Orbit|BenchFigures.DrawsEveryPoint|farm_slurm'

stage() { printf '\n== %s (%d:%02d)\n' "$1" $((SECONDS / 60)) $((SECONDS % 60)); }

# ctest's own last lines: from "100% tests passed" on, with the names of those that failed.
summary() { sed -n '/% tests passed/,$p' "build/$1/ctest.log"; }

stage "set-up"
tools/setup.sh
for preset in "${presets[@]}"; do
  stage "build $preset"
  cmake --preset "$preset" -DMOTE_WERROR="$werror" -DMOTE_TESTS=ON
  cmake --build --preset "$preset"
done
failed=0
for preset in "${presets[@]}"; do
  stage "tests $preset"
  exclude=()
  if [[ ${#presets[@]} -gt 1 ]]; then exclude=(--exclude-regex "${left_out[$preset]}"); fi
  ctest --preset "$preset" --no-tests=error "${exclude[@]}" --parallel "$(nproc)" 2>&1 | tee "build/$preset/ctest.log" || failed=1
done

stage "summary"
for preset in "${presets[@]}"; do
  printf '\n%s:\n' "$preset"
  summary "$preset"
done
exit "$failed"
