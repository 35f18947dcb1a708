#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The experiments that CoherentGS invites: more cameras, a shorter and a longer schedule, larger
Gaussians. Each changes one thing of the standard training, and is measured on the same held-out
photographs; prints a table and keeps a picture of each.

usage: seed_experiments.py PROGRAM SCENE OUT [-- OPTION...]

  tests/eval/seed_experiments.py build/release/bin/cgs fern out/seed -- --downscale 2

Every eighth photograph by name, from the first, is held out; cameras are spread evenly over the
others. OPTIONs go to `cgs train`. What was trained already is read from OUT, where ROW_views/*.png are the
pictures of the held-out photographs.

Columns: PSNR and SSIM over all pixels of the held-out photographs, holes filled; PSNR over what an input
saw of them and their share of holes; Gaussians; processor seconds of depth and training.
"""

import json
import subprocess
import sys
from pathlib import Path

from photo_count import held_out_and_others, spread, train

CAMERAS = 3
# What changes: cameras, or settings as factors of the standard ones.
ROWS = {
    "standard, 3 cameras": {},
    "4 cameras": {"cameras": 4},
    "half the schedule": {"steps": 0.5},
    "one and a half times the schedule": {"steps": 1.5},
    "Gaussians of four times the radius": {"radius_factor": 4, "max_radius": 4},
}


def standard_settings(model):
    return json.loads((model / "training.json").read_text())["settings"]


def changed(change, standard):
    """--set for each setting that a row changes."""
    options = []
    for name, factor in change.items():
        if name == "cameras":
            continue
        value = float(standard[name]) * factor
        options += ["--set", f"{name}={round(value) if name == 'steps' else value}"]
    return options


def row(program, scene, name, names, held_out, out, options):
    found = train(program, scene, names, out, options)
    views = ",".join(held_out)
    done = subprocess.run(
        [program, "evaluate", out, "--views", views, "--json"],
        capture_output=True, text=True, check=True)
    mean = json.loads(done.stdout)["mean"]
    pictures = out.with_name(out.name + "_views")
    if not pictures.exists():
        subprocess.run(
            [program, "render", out, "--views", views, "-q", "-o", pictures], check=True)
    gaussians = json.loads((out / "training.json").read_text())["gaussians"]
    return (f"| {name} | {mean['psnr']:.2f} dB / {mean['ssim']:.3f} | {mean['psnr_seen']:.2f} dB "
            f"| {100 * mean['hole_fraction']:.1f} % | {gaussians / 1e6:.2f} million "
            f"| {found['seconds']:.0f} |")


def main(arguments):
    split = arguments.index("--") if "--" in arguments else len(arguments)
    options = arguments[split + 1:]
    if split != 3:
        print(__doc__, file=sys.stderr)
        return 2
    program, scene, out = arguments[0], arguments[1], Path(arguments[2])
    out.mkdir(parents=True, exist_ok=True)
    held_out, others = held_out_and_others(program, scene)
    print("| | held out, all pixels | seen | holes | Gaussians | core-s |")
    print("|---|---|---|---|---|---|")
    standard = None
    for name, change in ROWS.items():
        model = out / name.replace(" ", "_").replace(",", "")
        inputs = spread(others, change.get("cameras", CAMERAS))
        settings = changed(change, standard)
        print(row(program, scene, name, inputs, held_out, model, options + settings), flush=True)
        standard = standard or standard_settings(model)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
