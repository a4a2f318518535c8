#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# install-peers.sh DIRECTORY: installs what the preset peers measures jml against: Debian packages, Python packages in a
# virtual environment DIRECTORY/venv, and the sources of Rust crates. What cannot be had is named in DIRECTORY/skipped.txt,
# one line "contender: why", and left out of the measurement; the script then still succeeds. Safe to repeat.
set -uo pipefail

directory=${1:?usage: install-peers.sh DIRECTORY}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
mkdir -p "$directory"
: >"$directory/skipped.txt"
skip() {
  echo "install-peers: skipped $1: $2"
  echo "$1: $2" >>"$directory/skipped.txt"
}

tools=(python3 python3-venv clang-19 gnuplot-nox binutils)
peers=(
  libceres-dev        # ceres, ceres_default
  libsundials-dev     # cvode_by_hand, jml_cvode
  librandom123-dev nlohmann-json3-dev libboost-dev libopenmpi-dev openmpi-bin   # scaling over threads and ranks
  libmrpt-bayes-dev   # mrpt_ekf
  liborocos-bfl-dev   # bfl_ekf
)
python_packages=(
  numpy==1.26.4 scipy==1.13.1 filterpy==1.4.5   # filterpy_ekf
  gtsam==4.3.0      # gtsam, gtsam_lag, gtsam_lag_batch
  casadi==3.8.2     # casadi_ipopt, casadi_ipopt_lag
)

if [[ $(id -u) -eq 0 ]]; then
  as_root=(env)
elif command -v sudo >/dev/null; then
  as_root=(sudo env)
else
  as_root=()
fi
installed() { [[ $(dpkg-query --show --showformat='${db:Status-Status}' "$1" 2>/dev/null || true) == installed ]]; }

missing=()
if command -v apt-get >/dev/null; then
  for package in "${tools[@]}" "${peers[@]}"; do
    if ! installed "$package"; then missing+=("$package"); fi
  done
  if [[ ${#missing[@]} -gt 0 && ${#as_root[@]} -gt 0 ]]; then
    echo "install-peers: installing ${missing[*]}"
    apt() { "${as_root[@]}" DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=120 "$@"; }
    apt update || { sleep 5; apt update; }
    if ! apt install -y --no-install-recommends "${missing[@]}" >"$directory/apt.log" 2>&1; then
      for package in "${missing[@]}"; do  # one that cannot be had does not keep the others away
        apt install -y --no-install-recommends "$package" >>"$directory/apt.log" 2>&1
      done
    fi
  fi
fi

# The builds name the C++ peers that they do not find.
venv=$directory/venv
if [[ ! -x $venv/bin/python ]] && ! python3 -m venv "$venv" >"$directory/venv.log" 2>&1; then
  rm -rf "$venv"
  for name in filterpy_ekf gtsam gtsam_lag gtsam_lag_batch casadi_ipopt casadi_ipopt_lag; do
    skip "$name" "python3 -m venv failed, see venv.log"
  done
else
  install_python() { "$venv/bin/python" -m pip install -q --disable-pip-version-check "$@" >>"$directory/pip.log" 2>&1; }
  : >"$directory/pip.log"
  if ! install_python "${python_packages[@]}"; then
    for package in "${python_packages[@]}"; do  # one that cannot be had does not keep the others away
      install_python "$package" || case $package in
        filterpy*) skip filterpy_ekf "pip could not install $package, see pip.log" ;;
        gtsam*) for name in gtsam gtsam_lag gtsam_lag_batch; do skip "$name" "pip could not install $package, see pip.log"; done ;;
        casadi*) for name in casadi_ipopt casadi_ipopt_lag; do skip "$name" "pip could not install $package, see pip.log"; done ;;
      esac
    done
  fi
fi

if ! command -v cargo >/dev/null; then
  skip minikalman_ekf "no cargo (Rust 1.89 or newer; that of Debian 12 is older)"
  skip fusion_nav "no cargo (Rust 1.89 or newer; that of Debian 12 is older)"
elif ! cargo fetch -q --manifest-path "$here/bench/peers/rust/Cargo.toml" >"$directory/cargo.log" 2>&1; then
  skip minikalman_ekf "cargo fetch failed, see cargo.log"
  skip fusion_nav "cargo fetch failed, see cargo.log"
fi
exit 0
