#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many scenes: one fails and stops no other; what is done is not done again; the page shows all.

usage: batch_test.py PROGRAM CAPTURE WORK_FOLDER
"""
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

program, capture, work = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
shutil.rmtree(work, ignore_errors=True)
for name in ("first", "second #2"):
    for part in ("images", "transforms.json"):
        copy = shutil.copytree if (capture / part).is_dir() else shutil.copy
        (work / name).mkdir(parents=True, exist_ok=True)
        copy(capture / part, work / name / part)
(work / "broken").mkdir()
(work / "broken/transforms.json").write_text('{"frames": [')

scenes = [work / name for name in ("first", "broken", "second #2")]
out = work / "out"
options = ["--views", "view_01,view_03", "--preset", "draft", "--set", "steps=2", "--assume-unit", "m"]


def batch(*more):
    done = subprocess.run(
        [program, "batch", *scenes, *options, "-o", out, "--json", *more],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return {row["name"]: row for row in json.loads(done.stdout)}, done.stderr


rows, said = batch()
assert list(rows) == ["first", "broken", "second #2"], rows
for name in ("first", "second #2"):
    assert rows[name]["state"] == "done" and rows[name]["certified"], rows[name]
    assert rows[name]["photographs"] == 2 and 0.3 < rows[name]["measured"] <= 1, rows[name]
    assert 0 < rows[name]["observed"] < 1 and rows[name]["psnr"] > 10, rows[name]
    assert (out / name / "web/asset.glb").stat().st_size > 1000
    assert not (out / name / "failure.txt").exists()
assert rows["broken"]["failure"].startswith("SYNTAX: "), rows["broken"]
assert (out / "broken/failure.txt").read_text().startswith("SYNTAX: ")
assert json.loads((out / "batch.json").read_text()) == list(rows.values())

page = (out / "index.html").read_text()
assert "2 of 3 scenes" in page and "SYNTAX: " in page
assert 'href="first/report.html"' in page and 'href="second%20%232/report.html"' in page
thumbnail = page.split('<img src="')[1].split('"')[0]
assert (out / thumbnail).is_file(), thumbnail

# What is done is not done again, nor what failed, unless asked.
before = {f: f.stat().st_mtime_ns for f in out.glob("*/web/asset.glb")}
(work / "broken/transforms.json").write_text((work / "first/transforms.json").read_text())
shutil.copytree(work / "first/images", work / "broken/images")
rows, said = batch()
assert rows["broken"]["state"] == "failed" and "--retry" in said, said
rows, _ = batch("--retry")
assert rows["broken"]["state"] == "done", rows["broken"]
assert all(f.stat().st_mtime_ns == at for f, at in before.items())
assert "3 of 3 scenes" in (out / "index.html").read_text()

# Options that do not suit a finished run make no failure of it, nor does the folder of a scene take results.
rows, _ = batch("--set", "steps=3")
assert "--overwrite" in rows["first"]["failure"] and not (out / "first/failure.txt").exists(), rows["first"]
rows, _ = batch()
assert all(row["state"] == "done" for row in rows.values()), rows
rows, _ = batch("--set", "steps=3", "--overwrite")
assert rows["first"]["state"] == "done", rows["first"]
assert all(f.stat().st_mtime_ns != at for f, at in before.items())
onto = subprocess.run([program, "batch", work / "first", "-o", work], capture_output=True, text=True)
assert onto.returncode == 2 and "lies in the input" in onto.stderr, onto.stderr

# Results are called as the scene was typed: by a link, also with a slash behind it and where nothing is.
(work / "bad").mkdir()
(work / "bad/transforms.json").write_text('{"frames": [')
(work / "linked").symlink_to("bad")
failing = [program, "batch", f"{work}/linked", f"{work}/bad/", f"{work}/missing/", "-o", work / "failed", "--json"]
done = subprocess.run(failing, capture_output=True, text=True)
assert done.returncode == 0, done.stderr
assert [row["name"] for row in json.loads(done.stdout)] == ["linked", "bad", "missing"], done.stdout
assert (work / "failed/missing/failure.txt").is_file() and not (work / "failed/failure.txt").exists()
strict = subprocess.run([*failing, "--strict"], capture_output=True, text=True)
assert strict.returncode == 3 and "3 of 3 scenes failed" in strict.stderr, strict.stderr
assert len(json.loads(strict.stdout)) == 3
nameless = subprocess.run([program, "batch", "/", "-o", work / "no"], capture_output=True, text=True)
assert nameless.returncode == 2 and "has no name" in nameless.stderr, nameless.stderr

same = subprocess.run([program, "batch", work / "first", work / "out/../first", "-o", out], capture_output=True, text=True)
assert same.returncode == 2 and "two scenes are called first" in same.stderr, same.stderr
