#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs sets of photographs without cameras, as people take them, and prints a table of what came
out: how many were placed, how held-out photographs are met, how much was measured, what the mesh is
worth, and the time.

usage: photo_sets.py PROGRAM EVIDENCE_ACCURACY SETS OUT [SET...]

  tests/eval/photo_sets.py build/release/bin/cgs build/release/bin/evidence_accuracy photos out/sets

SETS is a folder with a folder of JPEG photographs per set. Of every five neighbours by name the first, the
third and the fifth are the input, those between are held out; of more than twelve such fives, twelve
spread over the set are run. Photographs are brought to about 700 pixels. What was run already is read
from OUT.

Columns: five (its first photograph); placed, of five; PSNR over what an input saw of the held-out
photographs [dB], and their share of holes; shares of the input pixels that are measured or adjoin
what is, are sky, moved, and are estimated or open; share of contradicted evidence of the mesh;
certified; processor seconds.
"""

import json
import resource
import shutil
import subprocess
import sys
from pathlib import Path

PICTURES = (".jpg", ".jpeg")
MOST_FIVES = 12
LARGEST_SIDE = 700  # [pixels]


def fives(folder):
    files = sorted(p for p in folder.rglob("*") if p.suffix.lower() in PICTURES)
    starts = range(max(0, len(files) - 4))
    if len(starts) > MOST_FIVES:
        starts = [k * (len(starts) - 1) // (MOST_FIVES - 1) for k in range(MOST_FIVES)]
    return [files[k : k + 5] for k in starts]


def cpu_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def jpeg_size(photograph):
    """Larger side by the first frame header (ITU T.81, B.2.2); 0 where there is none."""
    data = photograph.read_bytes()
    at = 2
    while at + 9 < len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height = int.from_bytes(data[at + 5 : at + 7], "big")
            return max(height, int.from_bytes(data[at + 7 : at + 9], "big"))
        at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return 0


def reduction(photograph):
    """The whole number that --downscale is to be."""
    return max(1, round(jpeg_size(photograph) / LARGEST_SIDE))


def run(program, five, out):
    """Runs one five, and keeps what was said and how long it took in OUT/five.json."""
    record = out / "five.json"
    if record.exists():
        return json.loads(record.read_text())
    shutil.rmtree(out, ignore_errors=True)
    photographs = out / "photographs"
    photographs.mkdir(parents=True)
    for file in five:
        shutil.copy(file, photographs)
    before = cpu_seconds()
    done = subprocess.run(
        [program, "run", photographs, "--views", ",".join(five[k].name for k in (0, 2, 4)),
         "--preset", "draft", "--downscale", str(reduction(five[0])), "-o", out / "run"],
        capture_output=True,
        text=True,
    )
    found = {"seconds": cpu_seconds() - before, "code": done.returncode, "said": done.stderr}
    record.write_text(json.dumps(found))
    return found


def contradicted(evidence_accuracy, run_folder):
    done = subprocess.run([evidence_accuracy, run_folder], capture_output=True, text=True)
    for line in done.stdout.splitlines():
        if line.startswith("evidence"):
            return line.split("%")[-2].split()[-1] + " %"
    return "-"


def percent(value):
    return "-" if value is None else f"{100 * value:.1f} %"


def row(program, evidence_accuracy, five, out):
    found = run(program, five, out)
    name = f"{out.parent.name} {five[0].stem}"
    if found["code"] != 0:
        reason = found["said"].strip().splitlines()[-1] if found["said"].strip() else "?"
        return [name, f"refused ({reason})"] + ["-"] * 8 + [f"{found['seconds']:.0f}"]
    report = json.loads((out / "run/report.json").read_text())
    placed = len(report["photographs"])
    mean = (report.get("evaluation") or {}).get("mean", {})
    depth = report["model"]["depth_of_views"]
    part = {key: sum(view.get(key, 0) for view in depth) / len(depth)
            for key in ("with_evidence", "sky", "transient", "estimated", "left_open")}
    psnr = mean.get("psnr_seen")
    return [
        name,
        str(placed),
        f"{psnr:.1f}" if psnr else "-",
        percent(mean.get("hole_fraction")),
        percent(part["with_evidence"]),
        percent(part["sky"]),
        percent(part["transient"]),
        percent(part["estimated"] + part["left_open"]),
        contradicted(evidence_accuracy, out / "run"),
        "yes" if report["certificate"]["passed"] else "no",
        f"{found['seconds']:.0f}",
    ]


def main():
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    program, evidence_accuracy, sets, out = sys.argv[1:5]
    wanted = sys.argv[5:]
    heads = ["five", "placed", "PSNR seen", "holes", "measured", "sky", "moved", "estimated",
             "contradicted", "certified", "core-s"]
    print("| " + " | ".join(heads) + " |\n" + "|---" * len(heads) + "|", flush=True)
    for folder in sorted(p for p in Path(sets).iterdir() if p.is_dir()):
        if wanted and folder.name not in wanted:
            continue
        for k, five in enumerate(fives(folder)):
            cells = row(program, evidence_accuracy, five, Path(out) / folder.name / str(k))
            print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
