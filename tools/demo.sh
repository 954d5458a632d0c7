#!/usr/bin/env bash
# From a bare Debian 12 to a picture: installs what is missing, builds Mote and renders scenes/plume.json into out/.
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."

tools/setup.sh
built_from=$SECONDS
cmake --preset release
cmake --build --preset release --target mote
rendered_from=$SECONDS
mkdir -p out
build/release/mote render scenes/plume.json -o out/plume.exr --preview out/plume.png --stats out/plume.json
done_at=$SECONDS

cat <<TEXT

The set-up took $built_from s, the build $((rendered_from - built_from)) s, the picture $((done_at - rendered_from)) s.
  $PWD/out/plume.png   to look at
  $PWD/out/plume.exr   linear, premultiplied, to composite
  $PWD/out/plume.json  seconds of each stage, memory, particle counts
TEXT
