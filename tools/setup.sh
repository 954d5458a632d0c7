#!/usr/bin/env bash
# Installs the Debian 12 packages that Mote is built from and tested with, as far as they are missing.
# tools/setup.sh --interop   also the programs that ctest's label `interop` reads and writes files with (VTK: 1 GB).
# tools/setup.sh --fuzz      also the compiler that tools/fuzz.sh builds with.
# Needs root or sudo, and only where something is missing; no terminal. MOTE_NO_SETUP=1 leaves the machine as it is.
set -euo pipefail

packages=(
  g++ cmake ninja-build git pkg-config
  libvulkan1 libvulkan-dev libvulkan-volk-dev mesa-vulkan-drivers vulkan-validationlayers
  glslang-tools spirv-tools
  libglm-dev libtbb-dev libopenexr-dev libpng-dev libssl-dev
  zlib1g-dev liblz4-dev libzip-dev libblosc-dev libpugixml-dev libnanoflann-dev libhdf5-dev
  libassimp-dev libembree-dev libcli11-dev nlohmann-json3-dev libfmt-dev libhwy-dev libgtest-dev
  libopenvdb-dev libboost-dev libnanovdb-dev
  imagemagick fonts-dejavu-core python3 python3-numpy
  slurmctld slurmd slurm-client munge ffmpeg
)
for group in "$@"; do
  case "$group" in
    --interop) packages+=(python3-numpy python3-h5py hdf5-tools python3-vtk9 python3-openvdb) ;;
    --fuzz) packages+=(clang libclang-rt-14-dev) ;;
    *)
      printf 'usage: tools/setup.sh [--interop] [--fuzz]   (got "%s")\n' "$*" >&2
      exit 2
      ;;
  esac
done

# One line a package that dpkg knows, "g++ ii "; those it does not know are missing as well.
missing_packages() {
  local installed package
  installed=$(dpkg-query -W -f='${Package} ${db:Status-Abbrev}\n' "${packages[@]}" 2>/dev/null || true)
  for package in "${packages[@]}"; do
    grep -qxF -- "$package ii " <<<"$installed" || printf '%s\n' "$package"
  done
}

die() {
  printf 'setup: %s\n' "$1" >&2
  exit 1
}

is_bookworm() {
  [[ -r /etc/os-release ]] || return 1
  # LMDE and other children of Debian name their parent's release.
  # shellcheck disable=SC1091
  (. /etc/os-release && [[ "${DEBIAN_CODENAME:-${VERSION_CODENAME:-}}" == bookworm ]])
}

if [[ "${MOTE_NO_SETUP:-0}" != 0 ]]; then exit 0; fi

by_hand="install what corresponds to these Debian 12 packages and run this again with MOTE_NO_SETUP=1: ${packages[*]}"
command -v dpkg-query >/dev/null || die "this is not Debian (there is no dpkg-query); $by_hand"
mapfile -t missing < <(missing_packages)
if [[ ${#missing[@]} -eq 0 ]]; then exit 0; fi
is_bookworm || die "packages are missing (${missing[*]}), and this is not Debian 12 (bookworm); $by_hand"
command -v apt-get >/dev/null || die "packages are missing (${missing[*]}), and there is no apt-get to install them with"

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  command -v sudo >/dev/null || die "packages are missing, and only root may install them: apt-get install ${missing[*]}"
  as_root=(sudo)
fi

printf 'setup: installing %s\n' "${missing[*]}" >&2
apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o Acquire::Retries=2 -o DPkg::Lock::Timeout=300 "$@"
}
install_missing() { apt update && apt install -y --no-install-recommends "${missing[@]}"; }
# Mirrors that are being updated fail for minutes at most; a second list of packages usually helps.
if ! install_missing; then
  printf 'setup: that failed; once more in 10 seconds\n' >&2
  sleep 10
  install_missing || die "apt-get could not install ${missing[*]}; its messages stand above"
fi
mapfile -t missing < <(missing_packages)
[[ ${#missing[@]} -eq 0 ]] || die "apt-get succeeded, and yet these are not installed: ${missing[*]}"
