#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes through Snakemake on this machine: one is broken and stops no other, one is killed and given more memory.

usage: local_test.py CGS CAPTURE FOLDER
"""
import csv
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True  # nothing is left in the sources
import common

common.skip_without("snakemake")
cgs, capture, work = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
first, second, third = common.make_scenes(capture, work / "photos", 3)
broken = work / "photos" / third / "transforms.json"
whole = broken.read_text()
broken.write_text('{"frames": [')

# Ends the first run of the second scene as a scheduler does.
common.write_program(work / "killed_once", f"""#!/bin/sh
case "$*" in
  *"{second} "*--overwrite*) [ -f {work}/was_killed ] || {{ touch {work}/was_killed; kill -9 $$; }} ;;
esac
exec {cgs} "$@"
""")
results, jobs = work / "out/results", work / "out/jobs"
settings = ["scenes=photos", "output=out", "threads=1", f"options={common.OPTIONS}"]


def workflow(*more):
    return common.snakemake(work, "--cores", "2", "--keep-going", *more)


code, said = workflow("--config", f"cgs={work}/killed_once", *settings)
assert code == 1, said
assert (results / first / "report.json").is_file(), said
failure = (results / third / "failure.txt").read_text()
assert failure.startswith("SYNTAX: photos/" + third + "/transforms.json"), failure
assert not (results / third / "report.json").exists() and not (jobs / f"{third}.attempts").exists()
failure = (results / second / "failure.txt").read_text()
assert "ended in the middle" in failure and " MB, 30 minutes" in failure, failure
page = (results / "index.html").read_text()
assert "1 of 3 scenes" in page and "SYNTAX: " in page and "ended in the middle" in page

# What the run foretold is what the job was given room for.
plan = json.loads((jobs / f"{first}.plan.json").read_text())
record = json.loads((results / first / "run.json").read_text())
foretold = max(record["predicted_memory"].values()) / 2**20
assert abs(plan["mem_mb"] - 1.25 * (foretold + 256 + 150)) <= 2, (plan, foretold)
taken = max(stage["peak_memory"] for stage in record["stages"].values()) / 2**20
assert taken < plan["mem_mb"], (taken, plan)

# Again: what is done stays, what was killed ends, what is broken is tried twice.
before = {path: path.stat().st_mtime_ns for path in (results / first).rglob("*") if path.is_file()}
(work / "was_killed").unlink()
code, said = workflow("--retries", "1", "--config", f"cgs={work}/killed_once", *settings)
assert code == 1, said
assert common.attempts(jobs / f"{second}.attempts")[1:] == [plan["mem_mb"], 2 * plan["mem_mb"]]
assert not (results / second / "failure.txt").exists() and (results / second / "report.json").is_file()
assert "2 of 3 scenes" in (results / "index.html").read_text()

broken.write_text(whole)
code, said = workflow("--config", f"cgs={cgs}", *settings)
assert code == 0, said
assert not (results / third / "failure.txt").exists()
assert "3 of 3 scenes" in (results / "index.html").read_text()
assert before == {path: path.stat().st_mtime_ns for path in (results / first).rglob("*") if path.is_file()}
code, said = workflow("--config", f"cgs={cgs}", *settings)
assert code == 0 and "Nothing to be done" in said, said

# The same by hand; where a run was killed, it ends with the same.
for name in (second, third):
    subprocess.run([cgs, "run", f"photos/{name}", *common.OPTIONS.split(), "-q", "-o", f"hand/{name}"], cwd=work,
                   check=True)
    assert common.files_of(work / "hand" / name) == common.files_of(results / name), name

cost = subprocess.run([common.WORKFLOW / "cost.py", work / "out", "--scenes", "6000", "--nodes", "100", "--cores", "3",
                       "--memory", "2"], check=True, capture_output=True, text=True).stdout
found = re.search(r"3 scenes are done: .*\n6000 of them on 100 nodes, (\d+) jobs at once: ([\d.]+) core-hours", cost)
assert found, cost
assert int(found[1]) == 100 * min(3, math.floor(2000 / plan["mem_mb"])), cost
seconds = sum(float(next(csv.DictReader(open(path), delimiter="\t"))["s"]) for path in jobs.glob("*.tsv"))
expected = 2000 * (seconds + 3 * 2 * 3) / 3600  # three seconds to start each of two jobs, for three scenes
assert abs(float(found[2]) - expected) < 0.06, (cost, expected)

code, said = workflow("--config", "scenes=nowhere")
assert code == 1 and "nowhere is no folder" in said, said
code, said = workflow()
assert code == 1 and "say where the scenes are" in said, said
