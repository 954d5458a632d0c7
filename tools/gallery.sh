#!/usr/bin/env bash
# Renders the figures of the thesis (Monette 2011, chapters 4 and 5) as scenes of ours, and a contact sheet of them all.
# tools/gallery.sh [--small] [--docs] [NAME]...
#   --small   a tenth of the particles and a quarter of the picture's edge: a minute instead of many
#   --docs    also writes docs/gallery/: thumbnails and the page with the command for each
#   NAME      only these pictures; `tools/gallery.sh --list` prints the names
# Pictures, statistics and the sheet go to out/gallery/.
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."

plume=scenes/plume.json cloud=scenes/cloud.json
near="--set /camera/position=[-0.05,0.97,3.75] --set /camera/target=[-0.05,-0.06,0]"  # than the fitted camera
# NAME | SCENE | CAPTION | FLAGS
gallery=(
  "still|scenes/gallery/lens.json|Figure 21, left: a still plume|"
  "motion_blur|scenes/gallery/lens.json|Figure 21, centre: motion blur, particles and camera move|--set /camera/shutter=[-0.12,0.12]"
  "depth_of_field|scenes/gallery/lens.json|Figure 21, right: depth of field|--set /camera/aperture_radius=0.2"
  "plume|$plume|Figure 26: smoke plume, 350,000 particles|"
  "cloud|$cloud|Figure 27: cloud, 9,000,000 particles|$near --set /particles/0/count=9000000"
  "size_1|$plume|Figure 28: drawn at a quarter of the size, same lighting|--set /view/radius_scale=0.25"
  "size_2|$plume|Figure 28: at half the size|--set /view/radius_scale=0.5"
  "size_3|$plume|Figure 28: at twice the size|--set /view/radius_scale=2"
  "size_4|$plume|Figure 28: at four times the size|--set /view/radius_scale=4"
  "density_1|$plume|Figure 29: mean optical depth 1|--set /medium/optical_depth=1"
  "density_2|$plume|Figure 29: mean optical depth 3|--set /medium/optical_depth=3"
  "density_3|$plume|Figure 29: mean optical depth 9|--set /medium/optical_depth=9"
  "density_4|$plume|Figure 29: mean optical depth 27|--set /medium/optical_depth=27"
  "subsample_100|$cloud|Figure 30: 3,000,000 particles, all of them in the octree|$near --set /particles/0/count=3000000"
  "subsample_50|$cloud|Figure 30: 50 % in the octree|$near --set /particles/0/count=3000000 --set /lighting/subsample=0.5"
  "subsample_10|$cloud|Figure 30: 10 % in the octree|$near --set /particles/0/count=3000000 --set /lighting/subsample=0.1"
  "solid_on_medium|scenes/gallery/louvre.json|Figure 32: a solid shadows the medium|"
  "medium_on_solid|scenes/gallery/ground.json|Figure 33: the medium shadows a solid|"
  "smoke1|scenes/gallery/smoke1.json|Real smoke (OpenVDB's sample smoke1) with the mesh spot in it|"
)

die() {
  printf 'gallery: %s\n' "$1" >&2
  exit 2
}

small=0 docs=0 wanted=()
for argument in "$@"; do
  case "$argument" in
    --small) small=1 ;;
    --docs) docs=1 ;;
    --list)
      for entry in "${gallery[@]}"; do printf '%s\n' "${entry%%|*}"; done
      exit 0
      ;;
    -*) die "no such flag: $argument (--small, --docs, --list)" ;;
    *) wanted+=("$argument") ;;
  esac
done
for name in "${wanted[@]}"; do
  printf '%s\n' "${gallery[@]%%|*}" | grep -qxF -- "$name" || die "no picture named $name; tools/gallery.sh --list prints them"
done
[[ $docs -eq 0 || ($small -eq 0 && ${#wanted[@]} -eq 0) ]] || die "--docs makes the whole page, so it goes with no other argument"
command -v montage >/dev/null || die "the contact sheet needs ImageMagick: apt-get install imagemagick"

mote=${MOTE:-build/release/mote}
if [[ ! -x "$mote" ]]; then
  tools/setup.sh
  cmake --preset release
  cmake --build --preset release --target mote
fi

# A tenth of the scene's own count, or of the count that a flag gives.
shrink() {
  local scene=$1 flags=$2 count
  [[ $small -eq 1 ]] || return 0
  count=$(grep -o 'particles/0/count=[0-9]*' <<<"$flags" | cut -d= -f2 || true)
  if [[ -z "$count" ]]; then count=$(grep -o '"count": *[0-9]*' "$scene" | grep -o '[0-9]*$' | head -1 || true); fi
  if [[ -n "$count" ]]; then printf -- '--set /particles/0/count=%d' $((count / 10)); fi
}
size=960x540
if [[ $small -eq 1 ]]; then size=240x135; fi

out=out/gallery
mkdir -p "$out"
seconds_file=$out/seconds.txt
: >"$seconds_file"
sheet=()
for entry in "${gallery[@]}"; do
  IFS='|' read -r name scene caption flags <<<"$entry"
  if [[ ${#wanted[@]} -gt 0 ]] && ! printf '%s\n' "${wanted[@]}" | grep -qxF -- "$name"; then continue; fi
  if [[ "$scene" == *smoke1* && ! -d ../shared/data ]]; then
    printf 'gallery: %s left out: ../shared/data is not here\n' "$name" >&2
    continue
  fi
  from=$(date +%s.%N)
  # shellcheck disable=SC2046,SC2086  # flags are words
  "$mote" render "$scene" --size "$size" -o "$out/$name.exr" --preview "$out/$name.png" --stats "$out/$name.json" \
    $flags $(shrink "$scene" "$flags")
  printf '%s %.1f\n' "$name" "$(echo "$(date +%s.%N) $from" | awk '{print $1 - $2}')" >>"$seconds_file"
  sheet+=(-label "${caption//%/%%}" "$out/$name.png")
done
montage -font DejaVu-Sans -background '#202020' -fill '#dddddd' -pointsize 11 -tile 4x -geometry 320x180+6+6 "${sheet[@]}" "$out/sheet.png"
printf 'gallery: %s, seconds a picture in %s\n' "$out/sheet.png" "$seconds_file"

if [[ $docs -eq 1 ]]; then
  mkdir -p docs/gallery
  {
    printf '# Gallery\n\nThe figures of the thesis as scenes of Mote. `tools/gallery.sh --docs` renders all of them and writes this page;\n'
    printf 'seconds are those of its last run, from start to files, on two cores without a GPU.\n'
    for entry in "${gallery[@]}"; do
      IFS='|' read -r name scene caption flags <<<"$entry"
      [[ -e "$out/$name.png" ]] || continue
      convert "$out/$name.png" -resize 480x270 -strip -quality 88 "docs/gallery/$name.jpg"
      printf '\n## %s\n\n![%s](%s.jpg)\n\n    mote render %s%s --size 960x540 -o %s.exr\n\n%s s\n' "$caption" "$caption" "$name" \
        "$scene" "$(sed -E "s/--set ([^ ]*\[[^ ]*)/--set '\1'/g" <<<"${flags:+ $flags}")" "$name" "$(awk -v n="$name" '$1 == n {print $2}' "$seconds_file")"
    done
  } >docs/gallery/README.md
fi
