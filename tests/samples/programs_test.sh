#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The sample programs one after the other, as somebody tries them who reads their first lines.
#
# usage: programs_test.sh BIN_FOLDER CAPTURE WORK_FOLDER
set -euo pipefail
bin="$1" capture="$2" work="$3"
rm -rf "$work"
mkdir -p "$work/scene/depth"
cp -r "$capture/images" "$capture/transforms.json" "$work/scene"
cd "$work"

expect() {  # expect PATTERN FILE
  grep -Eq "$1" "$2" || { echo "not in $2: $1" >&2; cat "$2" >&2; exit 1; }
}

"$bin/sample_01_reconstruct" scene splats.ply >01.txt
expect '^[0-9]+ Gaussians; ' 01.txt
expect 'measured' 01.txt
"$bin/sample_02_render_path" splats.ply scene path >02.txt
[ "$(find path -name '*.png' -size +1k | wc -l)" -ge 3 ]

for depth in "$capture"/truth/view_*_depth.exr; do
  name="$(basename "$depth")"
  cp "$depth" "scene/depth/${name/_depth/}"
done
"$bin/sample_03_fuse_depth" scene surface.ply >03.txt
expect '^8 frames, ' 03.txt
"$bin/sample_04_close_and_certify" surface.ply solid.ply >04.txt
expect '^closed, manifold, outward, 0 self-intersections' 04.txt
"$bin/sample_05_measure" solid.ply >05.txt
expect '^unit: m$' 05.txt
expect '^volume [0-9.]+ \+- ' 05.txt
expect ' % observed' 05.txt

for program in "$bin"/sample_0*; do  # told what is missing, not silent
  status=0
  "$program" 2>usage.txt || status=$?
  [ "$status" = 2 ]
  expect '^usage: ' usage.txt
done
