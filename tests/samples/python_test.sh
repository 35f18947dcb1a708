#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The Python samples one after the other, and what the program makes of the same.
#
# usage: python_test.sh PROGRAM CAPTURE WORK_FOLDER     (PYTHONPATH has the module)
set -euo pipefail
samples="$(cd "$(dirname "$0")/../../samples/python" && pwd)"
program="$1" capture="$2" work="$3" views=view_01,view_02,view_03
rm -rf "$work"
mkdir -p "$work/scene/depth" "$work/network"
cp -r "$capture/images" "$capture/transforms.json" "$work/scene"
cd "$work"
run() { /usr/bin/python3 -W error "$samples/$1" "${@:2}"; }
expect() {  # expect PATTERN FILE
  grep -Eq "$1" "$2" || { echo "not in $2: $1" >&2; cat "$2" >&2; exit 1; }
}

run 01_photographs_to_mesh.py scene $views closed.ply >01.txt
"$program" train scene --views $views --assume-unit m --preset draft -o model -q
"$program" fuse model -o model.vdb -q
"$program" mesh model.vdb --simplify 0 -o mesh -q
cmp closed.ply mesh/watertight.ply
/usr/bin/python3 - "$("$program" measure closed.ply --volume --json)" >volume.txt <<'E2'
import json, sys
volume = json.loads(sys.argv[1])["figures"]["volume"]
print(f"volume {volume['value']} +- {volume['sigma']} {volume['unit']}")
E2
expect "^$(sed 's/[+^]/\\&/g' volume.txt)$" 01.txt

/usr/bin/python3 - <<'E2'
import cgs, numpy as np
model = cgs.read_model("model")
for name in model.input:
    depth = model.input_depth(name)["depth"]
    depth = np.where(np.isfinite(depth), depth, np.nanmedian(depth))
    np.save(f"network/{name}.npy", (0.7 / depth + 0.2).astype("float32"))
E2
run 03_network_depth.py scene $views network guessed >03.txt
"$program" train scene --views $views --depth network --depth-kind disparity --preset draft -o told -q
cmp guessed/gaussians.ply told/gaussians.ply
expect '^view_02: .*measured.*guessed' 03.txt

for depth in "$capture"/truth/view_*_depth.exr; do
  name="$(basename "$depth")"
  cp "$depth" "scene/depth/${name/_depth/}"
done
run 02_depth_frames_to_mesh.py scene frames.vdb frames.ply >02.txt
expect '^8 frames, voxels of ' 02.txt
"$program" fuse scene --depth-kind metric --assume-unit m -o program.vdb -q
"$program" mesh program.vdb --simplify 0 -o program -q
"$program" compare frames.ply program/surface.ply --json >compare.json
/usr/bin/python3 - <<'E2'
import cgs, json
found = json.load(open("compare.json"))["distance"]
assert abs(found["median"]) < 0.1 * cgs.read_volume("program.vdb").voxel_size, found
E2

run 04_clean_and_certify.py frames.ply clean.ply >04.txt
expect '^certified' 04.txt
run 05_render_path.py model film >05.txt
expect '^10 frames$' 05.txt
[ "$(find film -name 'frame_*.png' -size +1k | wc -l)" = 10 ]
