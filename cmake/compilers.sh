#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# cmake/compilers.sh [folder]: builds and runs examples and a test with each compiler, standard library, C++ standard and
# Eigen that is here, and prints a table. What is not here is named as not tried. One job; some minutes for each row.
#   JML_EIGENS         more Eigens, folders of headers parted by ':'
#   JML_LIBCXX_16      where libc++ 16 was unpacked (its packages cannot be installed beside those of 19)
#   JML_SUNDIALS, JML_CERES   more installations of these, prefixes parted by ':'
set -uo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
out=${1:-$root/build/compilers}
mkdir -p "$out"
programs=(examples/first_filter examples/bounded_noise examples/continuous_filter tests/riccati/refusals_test)
googletest=/usr/src/googletest/googletest  # of libgtest-dev: for what cannot link the installed library

version_of() { sed -n 's/^#define EIGEN_'"$2"'_VERSION \([0-9]*\).*/\1/p' "$1"/Eigen/Version "$1"/Eigen/src/Core/util/Macros.h 2>/dev/null | head -1; }
eigen_version() {
  if [[ -f $1/Eigen/Version ]]; then echo "$(version_of "$1" MAJOR).$(version_of "$1" MINOR).$(version_of "$1" PATCH)"
  else echo "$(version_of "$1" WORLD).$(version_of "$1" MAJOR).$(version_of "$1" MINOR)"; fi
}

# gtest_for <key> <compiler> <flags>...: GoogleTest as one object, for a library that the installed one was not built with.
gtest_for() {
  local object=$out/gtest_${1//[^a-z0-9]/_}.o compiler=$2
  shift 2
  [[ -f $object ]] || printf '#include "%s"\n' src/gtest-all.cc src/gtest_main.cc |
    $compiler -std=c++20 -O1 -w "$@" -I"$googletest" -isystem "$googletest/include" -x c++ -c - -o "$object" >&2
  echo "$object"
}

echo "| compiler | standard library | C++ | Eigen | on | result |"
echo "|---|---|---|---|---|---|"
# row <compiler> <library> <standard> <eigen> <on> <run> <flags>...
row() {
  local compiler=$1 library=$2 standard=$3 eigen=$4 on=$5 run=$6 name passed=0 failed=""
  shift 6
  if ! command -v "${compiler%% *}" >/dev/null || [[ ! -d $eigen/Eigen ]]; then
    echo "| ${compiler} | $library | $standard | | $on | not tried: not here |"
    return
  fi
  for name in "${programs[@]}"; do
    local flags=("-std=c++${standard/23/2b}" -O1 -DJML_PLAIN_INLINING -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror
                 "-I$root/include" "-I$root/tests" -isystem "$eigen" "$@")
    local rest=()
    if [[ $name == tests/* ]]; then
      rest=(-lgtest -lgtest_main -pthread)
      if [[ $library != libstdc++ || $on != "$machine" ]]; then
        rest=("$(gtest_for "$compiler $library" "$compiler" "$@")" -pthread)
        flags+=(-isystem "$googletest/include")
      fi
    fi
    if $compiler "${flags[@]}" "$root/$name.cpp" -o "$out/program" "${rest[@]}" >"$out/log" 2>&1 && $run "$out/program" >>"$out/log" 2>&1; then
      passed=$((passed + 1))
    else
      failed+=" ${name##*/}"
      cp "$out/log" "$out/${compiler##*/}_${library// /_}_${standard}_${name##*/}.log"
    fi
  done
  local title
  title=$($compiler --version | head -1 | grep -oE '(clang version )?[0-9]+\.[0-9]+\.[0-9]+' | head -1)
  echo "| ${compiler##*/} ${title#clang version } | $library | $standard | $(eigen_version "$eigen") | $on | $passed of ${#programs[@]} passed${failed:+; failed:$failed} |"
}

system=/usr/include/eigen3
machine=$(uname -m)
for standard in 20 23; do row g++ libstdc++ $standard $system "$machine" env; done
for clang in clang++-16 clang++-19; do
  for standard in 20 23; do row $clang libstdc++ $standard $system "$machine" env; done
done
row clang++-19 libc++ 20 $system "$machine" env -stdlib=libc++
row clang++-19 libc++ 23 $system "$machine" env -stdlib=libc++
if [[ -n ${JML_LIBCXX_16:-} ]]; then
  l=$JML_LIBCXX_16/usr/lib/llvm-16
  row clang++-16 "libc++ 16" 20 $system "$machine" "env LD_LIBRARY_PATH=$l/lib:$JML_LIBCXX_16/usr/lib/$machine-linux-gnu" \
    -stdlib=libc++ -nostdinc++ -isystem "$l/include/c++/v1" "-L$l/lib" "-L$JML_LIBCXX_16/usr/lib/$machine-linux-gnu"
fi
row aarch64-linux-gnu-g++ libstdc++ 20 $system "aarch64, QEMU" "qemu-aarch64 -L /usr/aarch64-linux-gnu"
IFS=: read -ra eigens <<<"${JML_EIGENS:-}"
for eigen in "${eigens[@]}"; do
  row g++ libstdc++ 20 "$eigen" "$machine" env
  row clang++-19 libstdc++ 20 "$eigen" "$machine" env
done

# component_row <component> <package> <prefix> <test>: a program that finds the installed jml with the component, and a
# test of the suite, with this installation of the package.
echo
echo "| component | with | built and run | result |"
echo "|---|---|---|---|"
component_row() {
  local component=$1 package=$2 prefix=$3 test=$4 build=$out/with_$1_${3//[^a-zA-Z0-9]/_} result=passed version
  local paths="$build/prefix;$prefix${CMAKE_PREFIX_PATH:+;$CMAKE_PREFIX_PATH}"
  {
    cmake -S "$root" -B "$build" -DJML_BUILD_TESTS=OFF -DJML_BUILD_EXAMPLES=OFF -DJML_BUILD_BENCHMARKS=OFF &&
      cmake --install "$build" --prefix "$build/prefix" &&
      cmake -S "$root/tests/package/consumer" -B "$build/consumer" "-DCMAKE_PREFIX_PATH=$paths" "-DCOMPONENTS=$component" "-DTEST=$root/$test.cpp" &&
      cmake --build "$build/consumer" -j1 &&
      env LD_LIBRARY_PATH="$prefix/lib" "$build/consumer/consumer_$component" &&
      env LD_LIBRARY_PATH="$prefix/lib" "$build/consumer/consumer_test"
  } >"$build.log" 2>&1 || result="failed: $build.log"
  version=$(sed -n "s/^${package}_DIR:PATH=//p" "$build/consumer/CMakeCache.txt" 2>/dev/null)
  version=$(sed -n 's/^ *set(PACKAGE_VERSION "\?\([0-9][0-9.]*\)"\?).*/\1/Ip' "$version"/*[vV]ersion.cmake 2>/dev/null | head -1)
  echo "| $component | $package ${version:-not found} | consumer_$component, ${test##*/} | $result |"
}
IFS=: read -ra installations <<<"/usr${JML_SUNDIALS:+:$JML_SUNDIALS}"
for prefix in "${installations[@]}"; do component_row cvode SUNDIALS "$prefix" tests/cvode/continuous_cvode_test; done
IFS=: read -ra installations <<<"/usr${JML_CERES:+:$JML_CERES}"
for prefix in "${installations[@]}"; do component_row ceres Ceres "$prefix" tests/ceres/bounds_ceres_test; done
