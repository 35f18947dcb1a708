#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs what was built and builds a project of somebody else with it.
#
# usage: install_test.sh BUILD_FOLDER CXX_COMPILER WORK_FOLDER
set -euo pipefail
sources="$(cd "$(dirname "$0")" && pwd)"
build="$1" compiler="$2" work="$3"
rm -rf "$work"
mkdir -p "$work"
cmake --install "$build" --prefix "$work/prefix" >"$work/install.log"

"$work/prefix/bin/cgs" --version
repository="$(cd "$sources/../.." && pwd)"
if grep -rn --include='*.cmake' -e "$repository" -e "$build" "$work/prefix"; then
  echo "the installed package names folders of the build" >&2
  exit 1
fi

# Elsewhere, as a package is unpacked where it was not built.
mv "$work/prefix" "$work/moved"
cmake -S "$sources" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/moved" \
  -DCMAKE_CXX_COMPILER="$compiler" >"$work/configure.log"
cmake --build "$work/build" >"$work/build.log" || { cat "$work/build.log"; exit 1; }
cd "$work" && build/consumer
