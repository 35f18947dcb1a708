# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes for the tests of samples/workflow, and how these call Snakemake."""
import ctypes
import itertools
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys

WORKFLOW = pathlib.Path(__file__).resolve().parents[2] / "samples/workflow"
OPTIONS = "--assume-unit m --voxel-size 40cm --simplify 0 --set steps=2"
# They say when and where a run was made.
DIFFER = {"report.html", "report.json", "run.json"}


def skip_without(*programs):
    for program in programs:
        if not shutil.which(program):
            print(f"skipped: {program} is not installed")
            sys.exit(77)


def make_scenes(capture, folder, count):
    """Scenes of three photographs each, no two of the same three."""
    transforms = json.loads((capture / "transforms.json").read_text())
    frames = sorted(transforms["frames"], key=lambda frame: frame["file_path"])[:6]
    for i, chosen in enumerate(itertools.islice(itertools.combinations(frames, 3), count)):
        scene = folder / f"scene_{i + 1:02}"
        (scene / "images").mkdir(parents=True)
        for frame in chosen:
            shutil.copy(capture / frame["file_path"], scene / frame["file_path"])
        kept = {key: transforms[key] for key in ("camera_model",)}
        (scene / "transforms.json").write_text(json.dumps({**kept, "frames": chosen}))
    return sorted(scene.name for scene in folder.iterdir())


def ends_with_this_process():
    """For what a test starts: it ends even if the test is killed."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def snakemake(work, *arguments):
    """Exit code, and all that was printed."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(work / "cache"), "CI": "true"}  # CI: it looks more often
    done = subprocess.run(["snakemake", "-s", WORKFLOW / "Snakefile", *arguments], cwd=work, env=environment,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          preexec_fn=ends_with_this_process)
    return done.returncode, done.stdout


def write_program(path, text):
    path.write_text(text)
    path.chmod(0o755)


def attempts(file):
    """Memory [MB] that the job had at each."""
    return [int(line.split(" MB")[0].rsplit(" ", 1)[1]) for line in file.read_text().splitlines()]


def files_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*"))
            if path.is_file() and path.name not in DIFFER}
