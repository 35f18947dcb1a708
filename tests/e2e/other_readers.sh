#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Opens the files of a finished run with other people's programs and checks what they see:
# vdb_print, exrheader, Open3D, Python, ezdxf, and the Khronos glTF validator where npm has it installed.
#
# usage: other_readers.sh OUT        (a folder that cgs run --assume-unit m wrote)
#
# Open3D compares every pair of faces: minutes for a mesh of 200,000 faces, hours for 2,000,000.
set -euo pipefail
out="$1"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
failures=0
passed=0

expect() {  # expect NAME COMMAND...: the command must succeed
  local name="$1"
  shift
  if "$@" >"$log" 2>&1; then
    passed=$((passed + 1))
  else
    failures=$((failures + 1))
    echo "FAILED: $name"
    sed 's/^/    /' "$log" | tail -5
  fi
  rm -f "$log"
}

grids=$(vdb_print "$out/volume.vdb")
for grid in tsdf weight color state surface; do
  expect "vdb_print lists $grid" grep -qw "$grid" <<<"$grids"
done

for exr in "$out"/views/*.exr; do
  header=$(exrheader "$exr")
  for channel in A B G R Z N.X N.Y N.Z distance.Y variance.Y support.Y hole.Y holeKind.Y; do
    expect "$(basename "$exr") has channel $channel" grep -q "  *$channel, 32-bit floating-point" <<<"$header"
  done
  for attribute in worldToCamera cgs:worldToCamera cgs:K cgs:units; do
    expect "$(basename "$exr") has $attribute" grep -q "^$attribute " <<<"$header"
  done
done

expect "Open3D: watertight.ply is a closed manifold" /usr/bin/python3 - "$out" <<'PY'
import sys
import open3d as o3d
mesh = o3d.io.read_triangle_mesh(sys.argv[1] + "/mesh/watertight.ply")
assert len(mesh.triangles) > 1000, "few triangles"
assert mesh.has_vertex_colors() and mesh.has_vertex_normals(), "no colours or normals"
assert mesh.is_edge_manifold(allow_boundary_edges=False), "not edge-manifold"
assert mesh.is_vertex_manifold(), "not vertex-manifold"
assert mesh.is_orientable(), "not orientable"
assert mesh.is_watertight(), "not watertight"  # includes: does not intersect itself
textured = o3d.io.read_triangle_mesh(sys.argv[1] + "/mesh/watertight.obj", True)
assert sum(not image.is_empty() for image in textured.textures) >= 2, "no texture"
for name, scale in (("stl", 1000), ("obj", 1)):
    other = o3d.io.read_triangle_mesh(f"{sys.argv[1]}/mesh/watertight.{name}")
    assert len(other.triangles) == len(mesh.triangles), name
    # Up is +z in this run, so that no format turns it.
    size, expected = (m.get_max_bound() - m.get_min_bound() for m in (other, mesh))
    assert abs(size / (scale * expected) - 1).max() < 1e-4, (name, size, expected)
PY

expect "Python: watertight.3mf is the mesh of watertight.ply" /usr/bin/python3 - "$out" <<'PY'
import sys
import xml.etree.ElementTree as tree
import zipfile
core = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
with zipfile.ZipFile(sys.argv[1] + "/mesh/watertight.3mf") as archive:
    assert archive.testzip() is None, "damaged"
    model = tree.fromstring(archive.read("3D/3dmodel.model"))
assert model.get("unit") == "millimeter", "unit"
with open(sys.argv[1] + "/mesh/watertight.ply", "rb") as file:
    counts = {w[1]: int(w[2]) for w in (line.decode().split() for line in iter(
        file.readline, b"end_header\n")) if w[0] == "element"}
assert len(model.findall(f".//{core}vertex")) == counts["vertex"], "vertices"
assert len(model.findall(f".//{core}triangle")) == counts["face"], "faces"
assert len(model.findall(f"{core}build/{core}item")) == 1, "build"
PY

drawing=$(mktemp -d)
cgs="${CGS_BINARY:-$(dirname "$0")/../../build/release/bin/cgs}"
expect "cgs measure draws a section" sh -c '"$1" measure "$2" --section z=1 --dxf "$3/a.dxf" --json >"$3/a.json"' \
  sh "$cgs" "$out/mesh/watertight.ply" "$drawing"
expect "ezdxf: a section has no fault and the length that cgs states" /usr/bin/python3 - "$drawing" <<'PY'
import json, sys
import ezdxf
doc = ezdxf.readfile(sys.argv[1] + "/a.dxf")
audit = doc.audit()
assert not audit.errors and not audit.fixes, audit.errors
assert doc.layers.get("INFERRED").dxf.linetype == "DASHED"
def length_of(lines):
    length = 0
    for line in lines:
        places = [v.dxf.location for v in line.vertices]
        if line.is_closed: places.append(places[0])
        length += sum((b - a).magnitude for a, b in zip(places, places[1:]))
    return length
outlines = [line for line in doc.modelspace() if line.dxf.layer == "OUTLINE"]
assert outlines and all(line.is_closed for line in outlines), "can be hatched"
length = length_of(line for line in doc.modelspace() if line.dxf.layer != "OUTLINE")
assert abs(length_of(outlines) / length - 1) < 1e-9, (length_of(outlines), length)
stated = json.load(open(sys.argv[1] + "/a.json"))["figures"]["section_length"]["value"]
assert abs(length / stated - 1) < 1e-9, (length, stated)
PY
rm -rf "$drawing"

expect "Open3D: gaussians.ply opens as points" /usr/bin/python3 - "$out" <<'PY'
import sys
import open3d as o3d
points = o3d.io.read_point_cloud(sys.argv[1] + "/model/gaussians.ply")
assert len(points.points) > 1000
PY

if command -v splat-transform >/dev/null; then
  packed=$(mktemp -d)
  expect "splat-transform: reads every packed splat" sh -c '
    count() { "$1" info "$2" | head -1 | cut -d" " -f3; }
    "$1" convert "$2" "$3/a.compressed.ply" && splat-transform "$3/a.compressed.ply" "$3/b.ply" &&
      test "$(count "$1" "$3/b.ply")" = "$(count "$1" "$2")"' sh \
    "$cgs" "$out/model/gaussians.ply" "$packed"
  rm -rf "$packed"
else
  echo "skipped: packed splats (npm install @playcanvas/splat-transform)"
fi

if node -e 'require("gltf-validator")' 2>/dev/null; then
  for file in "$out"/web/asset*.glb; do
    expect "glTF validator: $(basename "$file"): no error, no warning" node -e '
const fs = require("fs");
const file = process.argv[1];
require("gltf-validator").validateBytes(new Uint8Array(fs.readFileSync(file))).then((report) => {
  const { numErrors, numWarnings } = report.issues;
  if (numErrors + numWarnings > 0) {
    console.log(JSON.stringify(report.issues.messages.slice(0, 5), null, 1));
    process.exit(1);
  }
});' "$file"
  done
else
  echo "skipped: glTF validator (npm install gltf-validator)"
fi

echo "$passed passed, $failures failed"
[ "$failures" -eq 0 ]
