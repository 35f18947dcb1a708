#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""A reef at two dates, each reconstructed in a frame of its own from its own photographs: what grew by
5 mm and what broke off is found, with its volume, and nothing else, though a fish swims through one
photograph.

usage: monitor_test.py PROGRAM MAKE_CAPTURE WORK_FOLDER
"""
import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

import numpy
from PIL import Image, ImageDraw

program, make_capture, work = sys.argv[1], sys.argv[2], Path(sys.argv[3])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)

# samples/capture/reef.h
GROWTH = {"at": (-0.28, 0.55), "radius": 0.11, "thickness": 0.005}
KNOB = {"at": (0.30, 0.38), "radius": 0.06, "height": 0.035}


def cgs(*arguments, code=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == code, (arguments, done.stderr)
    return done


def growth_volume():
    """Of a disc whose rim of 2 cm rises smoothly: 3 t^2 - 2 t^3."""
    step, sum_of = 0.0005, 0
    for i in range(int(GROWTH["radius"] / step)):
        r = (i + 0.5) * step
        t = min(1, (GROWTH["radius"] - r) / 0.02)
        sum_of += 2 * math.pi * r * step * GROWTH["thickness"] * t * t * (3 - 2 * t)
    return sum_of


def move(scene):
    """Another frame: turned and moved."""
    path = scene / "transforms.json"
    cameras = json.loads(path.read_text())
    turn, tilt = math.radians(70), math.radians(25)
    about_z = numpy.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0],
                           [0, 0, 1]])
    about_x = numpy.array([[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)],
                           [0, math.sin(tilt), math.cos(tilt)]])
    motion = numpy.eye(4)
    motion[:3, :3] = about_z @ about_x
    motion[:3, 3] = (4, -2, 7)
    for frame in cameras["frames"]:
        frame["transform_matrix"] = (motion @ numpy.array(frame["transform_matrix"])).tolist()
    path.write_text(json.dumps(cameras))


def add_fish(path):
    picture = Image.open(path)
    width, height = picture.size
    draw = ImageDraw.Draw(picture)
    x, y, long, high = 0.62 * width, 0.6 * height, 0.09 * width, 0.05 * height
    draw.ellipse((x - long, y - high, x + long, y + high), fill=(228, 120, 40))
    draw.polygon(((x + long, y), (x + 1.4 * long, y - high), (x + 1.4 * long, y + high)),
                 fill=(240, 235, 230))
    picture.save(path)


def reconstruct(name, scene):
    out = work / name
    cgs("train", work / scene, "--use-all", "--preset", "draft", "--set", "steps=0",
        "--assume-unit", "m", "-o", out / "model")
    cgs("fuse", out / "model", "-o", out / "volume.vdb")
    cgs("mesh", out / "volume.vdb", "-o", out / "mesh")
    return out


for scene, which in (("photos_a", "reef"), ("photos_b", "reef-later")):
    subprocess.run([make_capture, work / scene, "--scene", which, "--views",
                    "view_02,view_04,view_06"], check=True)
move(work / "photos_b")
add_fish(work / "photos_b/images/view_04.png")
before, after = reconstruct("a", "photos_a"), reconstruct("b", "photos_b")

found = json.loads(cgs("monitor", before, after, "-o", work / "out", "--json").stdout)
written = json.loads((work / "out/changes.json").read_text())
assert found == written
registration = found["registration"]
print(f"registration: {registration}")
assert registration["agreeing_places"] > 50 and registration["share"] > 0.7
assert found["unit"] == "m" and abs(registration["scale"] - 1) < 1e-9


def check(side, at, radius, volume):
    """One patch holds nearly all, where it was planted, of the volume that it has."""
    told = found[side]
    print(side, {key: value for key, value in told.items() if key != "patches"})
    for patch in told["patches"]:
        print("  ", patch)
    first = told["patches"][0]
    x, _, z = first["center"]
    assert math.hypot(x - at[0], z - at[1]) < 0.3 * radius, first
    off = first["volume"] - volume
    print(f"{side}: volume {1e6 * first['volume']:.1f} cm3, planted {1e6 * volume:.1f} cm3")
    assert abs(off) < 0.25 * volume and abs(off) < 3 * first["volume_sigma"], (first, volume)
    others = sum(patch["area"] for patch in told["patches"][1:])
    assert others < 0.15 * first["area"], told["patches"]


check("gained", GROWTH["at"], GROWTH["radius"], growth_volume())
check("lost", KNOB["at"], KNOB["radius"],
      math.pi * KNOB["radius"] ** 2 * KNOB["height"] / 3)
page = (work / "out/index.html").read_text()
assert page.count("<figure") == 3 and page.count("data:image/") == 9

# The same dates twice: nothing changed. The frames are one.
same = json.loads(cgs("monitor", before, before, "--registered", "-o", work / "same", "--json").stdout)
assert not same["gained"]["patches"] and not same["lost"]["patches"], same

# What cannot be.
assert "no open surface" in cgs("monitor", before, work / "photos_b", "-o", work / "x", code=3).stderr
