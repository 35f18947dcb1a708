#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs what is needed, builds, makes a capture of a carved portal whose truth is known, and
# turns three of its photographs into every asset. Run again, it only does what is missing; after an
# update of the sources, remove the folder out first to see what they do.
#
# usage: samples/run.sh [OUTPUT]     (default: out/portal; relative to the repository)
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  -*)
    echo "usage: samples/run.sh [OUTPUT]" >&2
    exit 2
    ;;
esac
output="${1:-out/portal}"

samples/install.sh
cmake --preset release -DCGS_BUILD_TESTS=OFF >/dev/null
cmake --build --preset release --target cgs_cli cgs_make_capture

if [ ! -f out/capture/capture.json ]; then
  build/release/bin/cgs_make_capture out/capture
fi
build/release/bin/cgs run out/capture --views view_01,view_02,view_03 --assume-unit m -o "$output"
echo
build/release/bin/cgs evaluate "$output/model" --quiet
echo
echo "open $output/report.html in a browser, $output/mesh/watertight.ply in MeshLab or Blender"
