#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what building, testing and measuring jml needs and a fresh Debian 12 lacks. Safe to repeat; a second
# or two when nothing is missing. A user of the library needs a compiler, CMake and libeigen3-dev alone.
set -euo pipefail

packages=(
  g++ cmake ninja-build libeigen3-dev   # the library and its build
  libceres-dev                          # component jml::ceres
  libsundials-dev                       # component jml::cvode
  librandom123-dev nlohmann-json3-dev libboost-dev  # component jml::campaign
  libopenmpi-dev openmpi-bin            # component jml::mpi
  libcli11-dev                          # the campaign program in examples/
  libgtest-dev libgmock-dev pkgconf     # tests
  libbenchmark-dev                      # benchmarks
  gnuplot-nox                           # the demo's figures
  doxygen                               # the reference: target docs
  gcc-arm-none-eabi libstdc++-arm-none-eabi-picolibc picolibc-arm-none-eabi qemu-system-arm  # bare-metal tests
)

if ! command -v apt-get >/dev/null; then
  echo "install-dependencies: no apt-get here. Install by other means what these Debian packages hold:" >&2
  echo "  ${packages[*]}" >&2
  exit 1
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
  if [[ $status != installed ]]; then missing+=("$package"); fi
done
if [[ ${#missing[@]} -eq 0 ]]; then exit 0; fi

if [[ $(id -u) -eq 0 ]]; then
  as_root=(env)
elif command -v sudo >/dev/null; then
  as_root=(sudo env)
else
  echo "install-dependencies: neither root nor sudo. Ask whoever is root here for:" >&2
  echo "  apt-get install --no-install-recommends ${missing[*]}" >&2
  exit 1
fi

echo "install-dependencies: installing ${missing[*]}"
apt() { "${as_root[@]}" DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 "$@"; }
apt update || { sleep 5; apt update; }
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! apt install -y --no-install-recommends "${missing[@]}" >"$log" 2>&1; then
  cat "$log" >&2
  exit 1
fi
