#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""A facade of 25 photographs in groups through Snakemake on this machine: one group is killed, and all end with
what the commands leave when they are called by hand.

usage: groups_test.py CGS MAKE_CAPTURE FOLDER
"""
import json
import pathlib
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True  # nothing is left in the sources
import common

common.skip_without("snakemake")
program, make_capture, work = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
subprocess.run([make_capture, work / "facade", "--scene", "facade", "--downscale", "6"], check=True)

# Each option is one of another command's, the one with a number below 0 of training.
TRAINING = "--preset draft --set steps=0 --assume-unit m --up 0 -1 0"
SETTINGS = ["large=facade", "output=out", "size=10", "voxel=0.06", "threads=1",
            f"options=--estimated drop {TRAINING} --simplify 3cm"]
KILLED = "group_2"
# Ends the first training of a group as a scheduler does.
common.write_program(work / "killed_once", f"""#!/bin/sh
case "$*" in
  "train "*/{KILLED}/model) [ -f {work}/was_killed ] || {{ touch {work}/was_killed; kill -9 $$; }} ;;
esac
exec {program} "$@"
""")
out, jobs = work / "out", work / "out/jobs/groups"


def workflow(*config):
    return common.snakemake(work, "--cores", "2", "--keep-going", "--config", *config)


def files_of_mesh(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != ".snakemake_timestamp"}


code, said = workflow(f"cgs={work}/killed_once", *SETTINGS)
assert code == 1, said
groups = [group["name"] for group in json.loads((out / "groups/groups.json").read_text())["groups"]]
assert groups == ["group_1", "group_2", "group_3", "group_4"], groups
for group in groups:
    assert (out / "groups" / group / "model/training.json").exists() == (group != KILLED), (group, said)
    assert (out / "groups" / group / "failure.txt").exists() == (group == KILLED), (group, said)
failure = (out / "groups" / KILLED / "failure.txt").read_text()
assert "ended in the middle" in failure and " MB, 30 minutes" in failure, failure
assert not (out / "all.vdb").exists() and not (out / "mesh").exists()

# Again: what is done stays.
before = {group: (out / "groups" / group / "model/gaussians.ply").stat().st_mtime_ns
          for group in groups if group != KILLED}
code, said = workflow(f"cgs={program}", *SETTINGS)
assert code == 0, said
assert not list(out.rglob("failure.txt"))
for group, time in before.items():
    assert (out / "groups" / group / "model/gaussians.ply").stat().st_mtime_ns == time, group
code, said = workflow(f"cgs={program}", *SETTINGS)
assert code == 0 and "Nothing to be done" in said, said

# A job has what the plan of its group says; the volume and its meshes what that of the largest does.
plans = {group: json.loads((jobs / f"{group}.plan.json").read_text())["mem_mb"] for group in groups}
for group in groups:
    assert common.attempts(jobs / f"{group}.attempts") == [plans[group]] * (1 + (group == KILLED)), group
for job in ("fuse", "mesh"):
    assert common.attempts(jobs / f"{job}.attempts") == [max(plans.values())], job


def cgs(*arguments):
    subprocess.run([program, *arguments, "-q"], cwd=work, check=True)


hand = work / "hand"
cgs("split", "facade", "--size", "10", "-o", hand)
for group in groups:
    views = (hand / group / "views.txt").read_text().strip()
    cgs("train", "facade", "--views", views, *TRAINING.split(), "-o", hand / group / "model")
    by_hand, by_job = (folder / group / "model/gaussians.ply" for folder in (hand, out / "groups"))
    assert by_hand.read_bytes() == by_job.read_bytes(), group
models = [hand / group / "model" for group in groups]
cgs("fuse", *models, "--voxel-size", "0.06", "--estimated", "drop", "-o", hand / "all.vdb")
assert (hand / "all.vdb").read_bytes() == (out / "all.vdb").read_bytes()
cgs("mesh", hand / "all.vdb", "--simplify", "3cm", "-o", hand / "mesh")
by_hand, by_job = files_of_mesh(hand / "mesh"), files_of_mesh(out / "mesh")
assert "watertight.stl" in by_hand and by_hand.keys() == by_job.keys(), by_hand.keys() ^ by_job.keys()
different = [file for file in by_hand if by_hand[file] != by_job[file]]
assert not different, different

# Coarser voxels: the models stay.
code, said = workflow(f"cgs={program}", *SETTINGS, "voxel=0.12")
assert code == 0, said
assert (out / "all.vdb").stat().st_size < (hand / "all.vdb").stat().st_size / 2
assert (out / "groups" / groups[0] / "model/gaussians.ply").stat().st_mtime_ns == before[groups[0]]

# Cut in another way, and what training refuses: no model of the former groups is left.
code, said = workflow(f"cgs={program}", *SETTINGS, "size=25", "options=--max-size 2MB")
assert code == 1, said
failures = list(out.glob("groups/group_*/failure.txt"))
assert failures and all("--max-size" in failure.read_text() for failure in failures), said
assert not list(out.glob("groups/group_*/model/gaussians.ply"))

(work / "empty").mkdir()
code, said = workflow(f"cgs={program}", "large=empty", "output=none")
failure = (work / "none/groups/failure.txt").read_text()
assert code == 1 and failure and "ended in the middle" not in failure, failure
code, said = workflow("large=nowhere")
assert code == 1 and "nowhere is no folder" in said, said
