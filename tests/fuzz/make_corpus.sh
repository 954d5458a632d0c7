#!/usr/bin/env bash
# Makes tests/fuzz/corpus/ anew: of what is there, what the readers' own tests write (good files and hostile ones), the
# scenes of scenes/ and what tools/fuzz.sh has learnt, as little as reaches the same code, and of that 64 files.
# tests/fuzz/make_corpus.sh [TARGET...]   Needs the presets dev, for the tests, and fuzz; TESTS names a folder of built ones.
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.."

# Which tests write files for which target. A new target has a line here.
declare -A writers=(
  [prt]="prt_test prt_writer_test writer_test" [prt2]="prt2_test writer_test"
  [npy]="npy_test writer_test" [npz]=npz_test [ply]="ply_test writer_test" [csv]="csv_test writer_test"
  [vtk]=vtk_test [vtk_xml]=vtk_xml_test [bgeo]=bgeo_test [houdini]=houdini_test [hdf5]=hdf5_test
  [vdb]=vdb_test [nanovdb]=nanovdb_test
  [salvage]="salvage_test prt_test prt2_test" [gltf]="gltf_import_test gltf_errors_test solids_test" [scene]=gltf_import_test
)
targets=("$@")
if [[ $# -eq 0 ]]; then mapfile -t targets < <(printf '%s\n' "${!writers[@]}" | sort); fi
most_files=64 # of a target's corpus

build=build/fuzz
tests=${TESTS:-build/dev/tests}
if [[ -z "${TESTS:-}" ]]; then
  cmake --preset dev
  # shellcheck disable=SC2086 # words of lists
  for target in "${targets[@]}"; do printf '%s\n' ${writers[$target]}; done | sort -u |
    xargs cmake --build --preset dev --target
fi
mkdir -p "$build/seeds"
cc -shared -fPIC -O1 -o "$build/keep_files.so" tests/fuzz/keep_files.c

for target in "${targets[@]}"; do
  seeds=$build/seeds/$target corpus=tests/fuzz/corpus/$target fuzzer=$build/tests/fuzz/fuzz_$target
  mkdir -p "$seeds" "$corpus" "$build/corpus/$target"
  for test in ${writers[$target]}; do
    KEEP_FILES=$PWD/$seeds LD_PRELOAD=$PWD/$build/keep_files.so "$tests/$test" --gtest_brief=1 >/dev/null
  done
  if [[ $target == scene ]]; then find scenes -name '*.json' ! -name '*.schema.json' -exec cp -t "$seeds" -- {} +; fi
  # What differs from another one by its end or a bit the fuzzer makes itself: 16 files of a size are enough, and of
  # those that are cut off (in order, each stands before one that goes on) none.
  python3 - "$seeds" <<'END'
import collections, pathlib, sys
files = sorted((path.read_bytes(), path) for path in pathlib.Path(sys.argv[1]).iterdir())
sizes = collections.Counter()
for (content, path), (longer, _) in zip(files, files[1:] + [(b"", None)]):
    sizes[len(content)] += 1
    if sizes[len(content)] > 16 or longer.startswith(content): path.unlink()
END

  # Edges count, not how often they are taken.
  rm -rf "$build/merged"
  mkdir "$build/merged"
  ASAN_OPTIONS=quarantine_size_mb=16 "$fuzzer" -merge=1 -use_counters=0 -max_len=65536 \
    "$build/merged" "$corpus" "$seeds" "$build/corpus/$target" >"$build/$target.merge.log" 2>&1
  bytes=0 most_bytes=20000
  if [[ $target == vdb || $target == nanovdb ]]; then most_bytes=300000; fi # masks of one node alone are 8 kB, nearly all zeros
  rm -rf "$corpus"
  mkdir "$corpus"
  files=0
  while read -r name size; do # a fair choice of small and large: names are hashes
    if ((files == most_files || bytes + size > most_bytes)); then continue; fi
    bytes=$((bytes + size)) files=$((files + 1))
    cp "$build/merged/$name" "$corpus/"
  done < <(find "$build/merged" -type f -printf '%f %s\n' | sort)
  printf '%-8s %5d seeds, %3d files of %d bytes are kept\n' "$target" "$(find "$seeds" -type f | wc -l)" \
    "$(find "$corpus" -type f | wc -l)" "$bytes"
done
