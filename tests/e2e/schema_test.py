#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What every command prints with --json, and the files of results, have the keys of docs/schema.

usage: schema_test.py PROGRAM CAPTURES SCHEMAS WORK_FOLDER
"""
import copy
import json
import re
import shutil
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

try:
    from jsonschema import Draft7Validator, RefResolver
except ImportError:
    print("skipped: python3-jsonschema is not installed")
    sys.exit(77)

program, captures, schemas, work = (Path(word).resolve() for word in sys.argv[1:5])
large, capture, small = (captures / divisor for divisor in ("6", "9", "18"))
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
SCHEMAS = {path.name: json.loads(path.read_text()) for path in sorted(schemas.glob("*.json"))}
LISTS = {"batch", "render", "next", "cameras"}  # lists of rows, which state no version
held = {}  # values that were held against a schema, by its name


def validator(name):
    schema = SCHEMAS[name + ".json"]
    return Draft7Validator(schema, resolver=RefResolver(name + ".json", schema, store=SCHEMAS))


def check(value, name):
    """Holds a value against a schema; says where they differ."""
    held.setdefault(name, []).append(value)
    wrong = [
        f"{'/'.join(map(str, error.absolute_path))}: {error.message[:300]}"
        for error in validator(name).iter_errors(value)
    ]
    assert not wrong, f"{name}: " + "\n".join(wrong)
    if name not in LISTS:
        assert value["schema_version"] == 1, name
    return value


def cgs(command, *words, schema=None, code=0):
    done = subprocess.run(
        [program, command, *map(str, words), "--json"], capture_output=True, text=True, cwd=work
    )
    assert done.returncode == code, f"cgs {command} {words}: {done.returncode} {done.stderr}"
    value = json.loads(done.stdout)
    if command == "info":  # one schema over those of all kinds
        check(value, command)
    return check(value, schema or command)


def file(path, schema):
    return check(json.loads((work / path).read_text()), schema)


def properties(schema):
    """Every description of a key in a schema."""
    if isinstance(schema, list):
        for part in schema:
            yield from properties(part)
    if not isinstance(schema, dict):
        return
    for key, part in schema.items():
        if key == "properties":
            yield from part.items()
        yield from properties(part)


def test_schemas_themselves():
    for name, schema in SCHEMAS.items():
        Draft7Validator.check_schema(schema)
        assert schema["$id"] == name and schema["title"], name
        for key, value in properties(schema):
            assert value.get("description"), f"{name}: {key} has no description"
    listed = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    commands = re.findall(r"^  ([a-z]+) ", listed.split("Subcommands:")[1], re.M)
    assert len(commands) > 10, listed
    for command in commands:
        help_text = subprocess.run([program, command, "--help"], capture_output=True, text=True).stdout
        if "--json" in help_text:
            assert command + ".json" in SCHEMAS, f"docs/schema has no {command}.json"


DRAFT = ["--preset", "draft", "--set", "steps=0"]
THREE = ["--views", "view_01,view_02,view_03"]


def test_runs():
    """With a scale and held-out views, and without either; one that goes on; what changed."""
    told = cgs("run", capture, "--views", "view_01,view_03", *DRAFT, "--assume-unit", "m",
               "--lods", "1", "--refine-poses", "--fill", "none", "-o", "metric")
    assert told["evaluation"]["views"] and told["units"] == "m" and told["web"]["levels"]
    assert "refined_poses" in told and told["mesh"]["output"]["left_out"] == {}
    cameras = json.loads((capture / "transforms.json").read_text())
    cameras["frames"] = cameras["frames"][:3]
    shutil.copytree(capture / "images", work / "cut/images")
    (work / "cut/transforms.json").write_text(json.dumps(cameras))
    told = cgs("run", "cut", "--preset", "draft", "--set", "steps=2", "--max-size", "60kB",
               "--max-error", "0.5", "--estimated", "keep",
               "--local-origin", "--use-all", "--old-photographs", "--texture", "atlas", "-o", "plain")
    assert told["web"]["texture"]["atlas"]["charts"] > 0
    assert told["evaluation"] is None and told["units"] == "unknown"
    assert told["mesh"]["output"]["left_out"] and told["mesh"]["promise"]
    assert len(told["model"]["loss"]) == 2 and told["web"]["asset.glb"]["words"]
    assert told["splats"]["fill"]["splats"] > 0 and "fill" not in file("metric/report.json", "run")["splats"]
    assert told["model"]["responses"]["terms"]
    for name in ("metric", "plain"):
        assert "seconds" not in file(f"{name}/model/training.json", "train")
        file(f"{name}/report.json", "run")
        assert file(f"{name}/run.json", "run-record")["outputs"]
        file(f"{name}/model/cameras.json", "cameras")
    assert cgs("info", "metric", schema="info-run")["finished"]
    told = cgs("run", capture, *THREE, "--dry-run", "-o", "foretold", schema="run-forecast")
    assert len(told["input"]) == 3 and told["most_memory"] > 1e6
    told = cgs("run", small, "--preview", "-o", "looked")
    assert "preview" in told["settings_reason"]


def test_classical_training():
    words = ["--preset", "classical", "--set", "steps=3"]
    told = cgs("train", small, *THREE, *words, "-o", "free")
    assert told["density"]["begun_with"] == told["gaussians"] and told["density"]["start"] is None
    told = cgs("train", small, *THREE, *words, "--start", "free/gaussians.ply", "-o", "refined")
    assert told["density"]["start"] == "gaussians.ply"


def test_verify():
    assert cgs("verify", "metric")["differing"] == []
    (work / "metric/web/splats.spz").write_bytes(b"changed")
    assert len(cgs("verify", "metric", code=3)["differing"]) == 1


def control_table(path):
    """Places before three cameras, in other coordinates, with what each camera sees of them."""
    cameras = json.loads((work / "trained/cameras.json").read_text())
    cameras = [camera for camera in cameras if camera["role"] == "input"]
    rows = ["name,x,y,z,sigma,role,view,px,py"]
    for k, place in enumerate([(-1, -0.8, 6), (1, -0.9, 7), (0.9, 0.8, 6), (-0.8, 0.9, 7.5), (0, 0.1, 8)]):
        middle = cameras[1]
        pose = zip(middle["rotation"], middle["position"])
        point = [sum(r * x for r, x in zip(row, place)) + p for row, p in pose]
        role = "check" if k == 4 else "control"
        for camera in cameras:
            away = [p - q for p, q in zip(point, camera["position"])]
            x, y, z = (sum(camera["rotation"][j][i] * away[j] for j in range(3)) for i in range(3))
            pick = camera["fx"] * x / z + camera["cx"] - 0.5, camera["fy"] * y / z + camera["cy"] - 0.5
            at = ",".join(str(10 * c) for c in point)
            rows.append(f"p{k},{at},0.05,{role},{camera['img_name']},{pick[0]},{pick[1]}")
    rows.append("p5,0,0,0,0.05,control,,,")  # picked nowhere
    path.write_text("\n".join(rows) + "\n")


def write_mask(path, width, height):
    """A picture that leaves out the rows above the middle."""
    write_png(path, width, height, 0, [bytes([255 if y > height / 2 else 0]) * width for y in range(height)])


def read_png(data, channels):
    """Width, height and rows of an 8-bit picture."""
    at, parts = 8, {}
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        parts[kind] = parts.get(kind, b"") + data[at + 8:at + 8 + length]
        at += 12 + length
    width, height = struct.unpack(">II", parts[b"IHDR"][:8])
    data, above, rows = zlib.decompress(parts[b"IDAT"]), bytes(width * channels), []
    for y in range(height):
        method, *row = data[y * (width * channels + 1):(y + 1) * (width * channels + 1)]
        for i, value in enumerate(row):
            left = row[i - channels] if i >= channels else 0
            corner = above[i - channels] if i >= channels else 0
            paeth = min((abs(above[i] - corner), 0, left), (abs(left - corner), 1, above[i]),
                        (abs(left + above[i] - 2 * corner), 2, corner))[2]
            row[i] = value + [0, left, above[i], (left + above[i]) // 2, paeth][method] & 255
        above = bytearray(row)
        rows.append(above)
    return width, height, rows


def write_png(path, width, height, kind, lines):
    rows = b"".join(b"\0" + bytes(line) for line in lines)
    parts = [(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)),
             (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in parts
    ))


def test_train():
    """Lengths, a table of points and a sensor give the scale; or nothing does."""
    told = cgs("train", capture, *THREE, *DRAFT, "-o", "trained",
               "--known-distance", "view_02:20,20", "view_02:36,20", "1m")
    assert told["scale"]["distances"] and told["seconds"] >= 0
    assert file("trained/training.json", "train")["scale"] == told["scale"]
    file("trained/cameras.json", "cameras")
    control_table(work / "table.csv")
    told = cgs("run", "cut", *DRAFT, "--control-points", "table.csv", "-o", "surveyed")
    assert told["scale"]["control_points"]["check_rms"], told["scale"]
    assert file("surveyed/run.json", "run-record")["request"]["control_points"]
    depth = work / "frames/depth"
    depth.mkdir(parents=True)
    for path in sorted((capture / "truth").glob("view_*_depth.exr")):
        shutil.copy(path, depth / path.name.replace("_depth", ""))
    shutil.copytree(capture / "images", work / "frames/images")
    shutil.copy(capture / "transforms.json", work / "frames")
    (work / "frames/masks").mkdir()
    camera = json.loads((capture / "transforms.json").read_text())["frames"][0]
    write_mask(work / "frames/masks/view_01.png", camera["w"], camera["h"])
    told = cgs("train", "frames", *THREE, *DRAFT, "--depth-kind", "metric", "-o", "sensed")
    assert "mask_path" in file("sensed/cameras.json", "cameras")[0]
    assert told["given_depth"]["metres_per_unit"] > 0 and told["scale"] is None
    told = cgs("train", "frames", *THREE, *DRAFT, "--depth-kind", "depth", "-o", "guessed")
    assert told["given_depth"]["kind"] == "depth"


def test_water():
    """Taken out of photographs, and put back to be compared with them."""
    told = cgs("run", captures / "water", "--views", "view_01,view_02,view_03,view_08", *DRAFT,
               "--medium", "water", "--voxel-size", "0.1", "-o", "watered")
    assert told["model"]["water"]["found"] and told["evaluation"]["through_water"]
    assert file("watered/run.json", "run-record")["request"]["medium"] == "water"
    assert file("watered/model/cameras.json", "cameras")[0]["water"]["veil"]
    assert file("watered/model/training.json", "train")["water"]["matches"] > 1000
    assert cgs("evaluate", "watered/model")["through_water"] is True
    assert (work / "watered/views/view_08.restored.png").exists()
    assert not (work / "watered/views/view_04.restored.png").exists()
    assert "restored" in (work / "watered/report.html").read_text()


def painted_holes():
    """A picture that is white in holes, of which splats are made; nothing is known of pixels else."""
    assert cgs("render", "trained", "--holes", "--fill", "none", "-o", "holes")["views"][0]["hole_fraction"] > 0
    file("holes/cameras.json", "cameras")
    path = work / "holes/hole_1.png"
    width, height, rows = read_png(path.read_bytes(), 3)
    _, _, holes = read_png((work / "holes/hole_1_mask.png").read_bytes(), 1)
    for row, mask in zip(rows, holes):
        for x, hole in enumerate(mask):
            if hole:
                row[3 * x:3 * x + 3] = b"\xff\xff\xff"
    write_png(path, width, height, 2, rows)
    told = cgs("fill", "trained", "holes", "-o", "filled")
    assert told["views"][0]["lifted"] and told["splats"]
    assert cgs("fill", "trained", "-o", "filled_by_itself")["views"][0]["file"] == "surroundings/hole_1.png"
    assert cgs("render", "filled", "--path", "holes/cameras.json", "-o", "shown")[0]["synthetic_fraction"] > 0
    assert cgs("render", "filled", "--views", "view_04", "-o", "shown_view")[0]["synthetic_fraction"] >= 0
    assert cgs("convert", "filled", "painted.ply")["output"]["synthetic"]["splats"]
    assert cgs("info", "painted.ply", schema="info-splats")["synthetic"]["sources"]


def test_pictures():
    assert cgs("evaluate", "trained")["mean"]["psnr"] > 5
    assert cgs("evaluate", "trained", "--views", "view_02")["views"][0]["role"] == "input"
    assert cgs("render", "trained", "--views", "view_02", "-o", "views")[0]["role"] == "input"
    assert len(cgs("render", "trained", "--path", "spiral", "--frames", "2", "-o", "path")) == 2
    file("path/cameras.json", "cameras")
    painted_holes()
    assert cgs("render", "sensed", "--views", "view_01", "-o", "masked")[0]["masked_fraction"] > 0.3
    (work / "bare").mkdir()  # splats beside the cameras of another program
    shutil.copy(work / "trained/gaussians.ply", work / "bare")
    cameras = json.loads((work / "trained/cameras.json").read_text())
    for camera in cameras:
        for key in ("frame", "internal_position", "role"):
            camera.pop(key, None)
    (work / "bare/cameras.json").write_text(json.dumps(cameras))
    assert cgs("render", "bare", "--views", "view_02", "-o", "bare_views")[0]["hole_fraction"] is None
    assert cgs("evaluate", "bare", "--views", "view_04")["mean"]["psnr_seen"] is None
    assert cgs("next", "trained", "--count", "2")[0]["name"] is None
    assert cgs("next", "trained", "--views", "view_05")[0]["name"] == "view_05"
    assert cgs("info", "views/view_02.exr", schema="info-raster")["camera_stated"]
    assert cgs("info", large, *THREE, schema="info-scene")["camera_fit"]["pairs"]
    told = cgs("info", large, *THREE, "--refine-poses", schema="info-scene")
    assert told["refined_poses"]["error_after"] > 0
    assert cgs("info", "frames", "--views", "view_01,view_02", schema="info-scene")["depth_files"]


def test_splats():
    assert cgs("info", "trained", schema="info-splats")["provenance"]
    assert "loss" in cgs("convert", "trained", "splats.spz")["output"]
    for name in ("splats.splat", "splats.compressed.ply", "copy.ply"):
        cgs("convert", "trained/gaussians.ply", name)
    assert cgs("info", "splats.spz", schema="info-splats")["provenance"] is None
    told = cgs("convert", "splats.spz", "made.glb", "--virtual-views", "6", "--virtual-size", "64",
               "--filter-floaters", "--voxel-size", "0.4")
    assert told["fusion"]["virtual_cameras"]["count"] == 6 and told["floaters"] and told["certificate"]
    cgs("convert", "metric/mesh/watertight.ply", "made.obj")
    cgs("convert", "trained", "made.vdb")


def test_volumes():
    told = cgs("split", capture, "--size", "3", "-o", "groups")
    assert file("groups/groups.json", "split") == told and len(told["groups"]) > 1
    assert "models" not in cgs("fuse", "trained", "-o", "one.vdb")
    assert cgs("fuse", "sensed", "sensed", "--voxel-size", "0.3", "-o", "two.vdb")["models"] == 2
    assert cgs("fuse", "frames", "--depth-kind", "metric", "-o", "frames.vdb")["frames"] > 2
    assert cgs("info", "one.vdb", schema="info-volume")["fused_here"]
    assert cgs("mesh", "one.vdb", "-o", "meshes")["output"]["left_out"] == {}
    told = cgs("mesh", "plain/volume.vdb", "--simplify", "0", "-o", "unsimplified")
    assert told["simplification"] is None and told["output"]["left_out"]


def write_ball():
    """A mesh of another program, without labels: a ball of 80 faces."""
    told = cgs("filter", "metric/mesh/watertight.stl", "whole.stl", "--op", "simplify=5cm")
    assert told["operations"][0]["before"]["area"] is None
    (work / "cloud.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
    )


def test_meshes():
    """With labels and sigma, without; closed, open; points alone."""
    write_ball()
    mesh = "metric/mesh/watertight.ply"
    assert cgs("info", mesh, schema="info-mesh")["states"]["provenance"]
    assert not cgs("info", "whole.stl", schema="info-mesh")["states"]["provenance"]
    assert cgs("info", "cloud.ply", schema="info-mesh")["certificate"] is None
    told = cgs("filter", "metric/mesh/surface.ply", "closed.ply", "--op", "largest=1", "--op", "watertight")
    assert told["operations"][1]["details"]["certificate"]["passed"]
    solid = ["--area", "--volume", "--bounds", "--section", "z=4", "--thickness"]
    ends = ["-1,0,4", "1,0,4"]
    places = ["--thickness-at", "0,0,4", "--distance", *ends, "--along", *ends]
    plane = ["--fit", "plane", "--at", "0,0,4", "--radius", "1m"]
    picture = ["--orthophoto", "photo", "--pixel-size", "10cm"]
    figures = cgs("measure", mesh, *solid, *places, *plane, *picture)["figures"]
    assert figures["area"]["sigma"] and figures["volume"]["surface_shares"]
    assert file("photo.orthophoto.json", "orthophoto")["files"][0] == "photo.png"
    figures = cgs("measure", "whole.stl", *solid)["figures"]
    assert figures["area"]["observed"] is None and figures["volume"]["surface_shares"] is None
    told = cgs("measure", "plain/mesh/surface.ply", "--volume", "--section", "z=4")
    assert told["figures"]["volume"]["value"] is None and told["mesh"]["unit"] == "units"
    assert cgs("measure", "plain/mesh/watertight.ply")["figures"]["certificate"]
    cgs("measure", "plain/mesh/watertight.ply", "--fit", "sphere", "--at", "0,0,4", "--radius", "2")
    told = cgs("compare", mesh, "metric/mesh/surface.ply", "--samples", "2000", "--icp", "--threshold", "1cm")
    assert told["registration"]["matrix"] and told["agreement"]
    told = cgs("compare", mesh, "whole.stl", "--samples", "2000", "--assume-unit", "mm")
    assert told["registration"] is None
    assert cgs("compare", mesh, mesh, "--m3c2", "--cylinder", "50cm")["m3c2"]


def test_splats_compared():
    around = cgs("compare", "metric/web/splats.glb", "metric/model/gaussians.ply", schema="compare-splats")
    assert around["cameras"] == "around" and around["a"]["psnr"] is None
    words = ["--scene", "metric", "--pictures", "compared"]
    seen = cgs("compare", "metric/model/gaussians.ply", "metric/model/gaussians.ply", *words,
               schema="compare-splats")
    assert seen["psnr"] == "same" and seen["a"]["psnr"] and len(seen["views"]) > 1


def test_batch():
    (work / "broken").mkdir()
    (work / "broken/transforms.json").write_text('{"frames": [')
    rows = cgs("batch", "cut", "broken", *DRAFT, "-o", "batch")
    assert [row["state"] for row in rows] == ["done", "failed"]
    assert file("batch/batch.json", "batch") == rows


def test_monitor():
    """A date held against itself."""
    told = cgs("monitor", "metric", "metric", "--registered", "--unit", "mm", "-o", "watched")
    assert told["unit"] == "mm" and told["gained"]["comparable"] > 0.5
    assert file("watched/changes.json", "monitor") == told


def test_tradeoff():
    words = ["--views", "view_01,view_03", "--want", "size<1MB", "--assume-unit", "m",
             "--reference", capture / "truth/mesh.ply", "-o", "tradeoff"]
    for _ in range(50):  # goes on where time was up: a slow machine does not do one setting at once
        done = subprocess.run(
            [program, "tradeoff", small, *words, "--minutes", "0.05"], cwd=work, capture_output=True
        )
        if done.returncode != 4:
            break
    told = cgs("tradeoff", small, *words, "--minutes", "0")
    assert file("tradeoff/tradeoff.json", "tradeoff") == told and told["recommendation"]
    assert told["settings"][0]["from_reference"], told["settings"][0]


def objects(value, key=""):
    """Every object in a value, with the key it has there."""
    if isinstance(value, dict):
        yield key, value
        for name, part in value.items():
            yield from objects(part, name)
    elif isinstance(value, list):
        for part in value[:1]:
            yield from objects(part, key)


def test_wrong_values_are_told():
    """A key too many in any object of what was held, and any required one too few, are errors."""
    for name, values in held.items():
        is_good = validator(name).is_valid
        for value in values[:2]:
            value = copy.deepcopy(value)
            assert is_good(value), name
            for key, part in objects(value):
                part["key that no schema has"] = []
                assert not is_good(value), f"{name}: {key} may have any key"
                del part["key that no schema has"]
        schema = SCHEMAS[name + ".json"]
        for key in schema.get("required", []):
            less = {k: v for k, v in values[0].items() if k != key}
            assert not is_good(less), f"{name} does without {key}"
    for name, key in {"batch": "state", "render": "name", "next": "place", "cameras": "img_name"}.items():
        rows = copy.deepcopy(held[name][0])
        del rows[0][key]
        assert not validator(name).is_valid(rows), f"{name} does without {key}"
    for name in ("run", "measure", "info-mesh"):
        assert not validator(name).is_valid({**held[name][0], "schema_version": 2}), name


if __name__ == "__main__":
    for test in [value for name, value in list(globals().items()) if name.startswith("test_")]:
        start = time.monotonic()
        test()
        print(f"{test.__name__}: {time.monotonic() - start:.1f} s", flush=True)
    unused = set(SCHEMAS) - {name + ".json" for name in held} - {"common.json"}
    assert not unused, f"nothing was held against {unused}"
