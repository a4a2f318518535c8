#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# cmake/packaging/debian.sh <folder>: the Debian source package, libjml-dev_*.deb and lintian's word, in <folder>. What
# is committed is packaged. Needs dpkg-dev, debhelper, lintian, cmake, libeigen3-dev.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
mkdir -p "$1"
cd "$1"
version=$(sed -n '1s/.*(\(.*\)-[0-9]*).*/\1/p' "$root/cmake/packaging/debian/changelog")
rm -rf "jml-$version"
git -C "$root" archive --prefix="jml-$version/" HEAD . ':(exclude)examples/data' | gzip -9n >"jml_$version.orig.tar.gz"
tar xf "jml_$version.orig.tar.gz"
cp -r "$root/cmake/packaging/debian" "jml-$version/debian"
(cd "jml-$version" && dpkg-buildpackage --no-sign)
lintian --allow-root --fail-on error,warning jml_*.changes
