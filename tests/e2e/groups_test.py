#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""A facade of 25 photographs, cut into groups, each reconstructed by itself, gives the surface of the
whole: split, train, fuse, mesh, compare.

usage: groups_test.py PROGRAM MAKE_CAPTURE WORK_FOLDER
"""
import json
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

program, make_capture, work = sys.argv[1], sys.argv[2], Path(sys.argv[3])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
scene = work / "facade"
subprocess.run([make_capture, scene, "--scene", "facade", "--downscale", "6"], check=True)


def cgs(*arguments, code=0):
    done = subprocess.run([program, *arguments], capture_output=True, text=True)
    assert done.returncode == code, (arguments, done.stderr)
    return done


def trained(views, out):
    cgs("train", scene, *views, "--preset", "draft", "--set", "steps=0", "-o", out)
    return out


groups = json.loads(cgs("split", scene, "--size", "10", "-o", work / "groups", "--json").stdout)
assert groups == json.loads((work / "groups/groups.json").read_text())
names = [group["name"] for group in groups["groups"]]
assert names == ["group_1", "group_2", "group_3", "group_4"], names
own = sorted(name for group in groups["groups"] for name in group["own"])
assert own == [f"view_{i:02d}" for i in range(1, 26)], own
assert all(len(group["views"]) == 10 for group in groups["groups"])
# What is there is not replaced.
assert "holds the groups" in cgs("split", scene, "-o", work / "groups", code=2).stderr

models = []
for name in names:
    folder = work / "groups" / name
    models.append(trained(["--views", (folder / "views.txt").read_text().strip()], folder / "model"))
whole = trained(["--use-all"], work / "whole")

VOXEL = 0.06
joined = json.loads(
    cgs("fuse", *models, "--voxel-size", str(VOXEL), "-o", work / "joined.vdb", "--json").stdout
)
assert joined["models"] == 4 and joined["photographs"] == 25, joined
in_groups = Counter(name for group in groups["groups"] for name in group["views"])
assert joined["in_several"] == sum(count > 1 for count in in_groups.values()), joined
cgs("fuse", whole, "--voxel-size", str(VOXEL), "-o", work / "whole.vdb")
for name in ("joined", "whole"):
    cgs("mesh", work / f"{name}.vdb", "-o", work / name)
surfaces = [work / name / "surface.ply" for name in ("joined", "whole")]
for a, b in (surfaces, surfaces[::-1]):
    said = cgs("compare", a, b, "--assume-unit", "m", "--json").stdout
    apart = json.loads(said)["distance"]["mean_absolute"] / VOXEL
    print(f"apart by {apart:.3f} voxels on average")
    assert apart < 0.1, apart

# Volumes cannot be joined, and what can be is said; so it is of models among depth frames.
said = cgs("fuse", work / "joined.vdb", work / "whole.vdb", "-o", work / "x.vdb", code=2).stderr
assert "give the models" in said, said
said = cgs("fuse", whole, scene, "-o", work / "x.vdb", code=2).stderr
assert "is no model" in said, said
assert not (work / "x.vdb").exists()
