#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains coherent and classical Gaussians of the same photographs and prints a table of what they cost
and how well they meet photographs that they did not see.

usage: classical.py PROGRAM PORTAL DATA OUT

  tests/eval/classical.py build/release/bin/cgs build/release/tests/captures/3 data out/classical

PORTAL is a folder of cgs_make_capture. DATA holds the folders fox (instant-ngp), llff_fern (LLFF) and
lego_subset (NeRF); what is not there is left out, with a word. Pictures are of about 170 pixels. What was
trained already is read from OUT.

Rows of a scene: coherent Gaussians, --preset standard; classical ones (--preset classical --set steps=N)
after as many pictures drawn, after as many processor seconds, and after a thousand pictures. Depth is measured in the
same way for all, and its time is in all. Columns: pictures drawn while training; PSNR over all pixels and
over those that an input saw, of views that were held out, and of the input views [dB]; share of holes of
the held-out views; splats; processor seconds; memory [MiB]."""

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

STEPS = 60  # of --preset standard, each of up to four views
AT_ONCE = 4
LONG = 1000  # steps of the longest classical training: a third of --preset classical


def names_in(folder, count):
    """So many photographs of a folder, spread over it."""
    names = sorted(p.stem for p in folder.glob("*.[jp][pn]g"))
    return [names[k * (len(names) - 1) // (count - 1)] for k in range(count)]


def scenes(portal, data):
    """Name, folder, input views (none: those that are chosen for it), divisor of the size, and the views that
    are judged (none: all that are held out)."""
    fox = data / "fox"
    fern = data / "llff_fern"
    lego = data / "lego_subset"
    yield "portal, 3 views", portal, ["view_01", "view_02", "view_03"], 1, []
    if fern.is_dir():
        yield "fern, 3 views", fern, ["image001", "image010", "image019"], 3, []
    if fox.is_dir():
        yield "fox, 3 views", fox, ["0001", "0009", "0014"], 12, ["0008", "0012"]
        yield "fox, 20 views", fox, names_in(fox / "images", 20), 12, []
    if lego.is_dir():
        yield "lego, 14 views", lego, None, 5, []
    for folder in (fern, fox, lego):
        if not folder.is_dir():
            print(f"left out: {folder} is not there")


def run(command):
    """What it said, its processor seconds and its memory [MiB]."""
    child = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    said = child.stdout.read()
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        sys.exit(f"failed: {' '.join(map(str, command))}")
    return said, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def train(program, scene, out, options):
    """Trains once, and keeps what came of it in OUT/row.json."""
    record = out / "row.json"
    if record.exists():
        return json.loads(record.read_text())
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    _, folder, views, downscale, judged = scene
    chosen = [] if views is None else ["--views", ",".join(views)]
    model = out / "model"
    said, seconds, memory = run(
        [program, "train", folder, *chosen, "--downscale", downscale, *options, "-q", "--json", "-o", model])
    trained = json.loads(said)
    inputs = [v["view"] for v in trained["depth_of_views"]]

    def mean_of(views):
        chosen = ["--views", ",".join(views)] if views else []
        return json.loads(run([program, "evaluate", model, *chosen, "-q", "--json"])[0])["mean"]

    held_out, fitted = mean_of(judged), mean_of(inputs)
    found = {
        "inputs": len(inputs),
        "steps": len(trained["loss"]),
        "splats": trained["gaussians"],
        "seconds": seconds,
        "memory": memory,
        "psnr": held_out["psnr"],
        "psnr_seen": held_out["psnr_seen"],
        "holes": held_out["hole_fraction"],
        "psnr_input": fitted["psnr"],
    }
    record.write_text(json.dumps(found))
    return found


def steps_in(seconds, none, few, many):
    """Steps of the classical training that take so long, by trainings of known time, the first of one step: a
    power, as a step takes the longer the more splats there are."""
    of_few, of_many, wanted = (
        max(0.1, s - none["seconds"]) for s in (few["seconds"], many["seconds"], seconds))
    power = math.log(many["steps"] / few["steps"]) / math.log(of_many / of_few)
    return max(1, round(few["steps"] * (wanted / of_few) ** power))


def row(name, pictures, found):
    return (f"| {name} | {pictures} | {found['psnr']:.2f} | {found['psnr_seen']:.2f} | "
            f"{found['psnr_input']:.2f} | {100 * found['holes']:.1f} % | {found['splats']} | "
            f"{found['seconds']:.0f} | {found['memory']:.0f} |")


def main():
    program, portal, data, out = (Path(word).resolve() for word in sys.argv[1:5])
    print("| | pictures drawn | held out | seen | input | holes | splats | processor s | MiB |")
    print("|---|---|---|---|---|---|---|---|---|")
    for scene in scenes(portal, data):
        folder = out / scene[0].replace(", ", "_").replace(" ", "_")
        coherent = train(program, scene, folder / "coherent", ["--preset", "standard"])
        drawn = STEPS * min(AT_ONCE, coherent["inputs"])

        def classical(steps):
            words = ["--preset", "classical", "--set", f"steps={steps}"]
            return train(program, scene, folder / f"classical_{steps}", words)

        few = classical(drawn)
        many = classical(LONG)
        timely = classical(steps_in(coherent["seconds"], classical(1), few, many))
        print(row(f"{scene[0]}: coherent", drawn, coherent))
        print(row("classical, as many pictures", drawn, few))
        print(row("classical, as many seconds", timely["steps"], timely))
        print(row("classical, a thousand", LONG, many), flush=True)


if __name__ == "__main__":
    main()
