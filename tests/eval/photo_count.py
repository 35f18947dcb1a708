#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What more photographs bring: reconstructs a scene from more and more of them, each time measured
on the same held-out ones, and prints a table.

usage: photo_count.py PROGRAM SCENE OUT COUNT... [-- OPTION...]

It also draws OUT/photo_count.svg, where there are two COUNTs or more.

  tests/eval/photo_count.py build/release/bin/cgs fox out/fox 3 6 12 24 -- --downscale 4

Every eighth photograph by name, from the first, is held out. Of the others, COUNT are taken, evenly
spread. OPTIONs go to `cgs train`. What was trained already is read from OUT.

Columns: photographs; PSNR and SSIM over all pixels of the held-out ones, PSNR over what an input saw
of them and their share of holes; share of the input pixels that is measured or adjoins what is;
Gaussians; processor seconds and memory of the training with depth.
"""

import json
import math
import resource
import subprocess
import sys
from pathlib import Path

HOLD_EVERY = 8


def photographs(program, scene):
    done = subprocess.run(
        [program, "info", scene, "--json"], capture_output=True, text=True, check=True
    )
    cameras = json.loads(done.stdout)["cameras"]
    return sorted(camera["name"] for camera in cameras if camera["role"] != "no image")


def held_out_and_others(program, scene):
    names = photographs(program, scene)
    held_out = names[::HOLD_EVERY]
    return held_out, [name for name in names if name not in held_out]


def spread(names, count):
    if count >= len(names):
        return names
    return [names[k * (len(names) - 1) // (count - 1)] for k in range(count)]


def train(program, scene, names, out, options):
    """Trains, if that was not done before. \\return processor seconds and peak memory [MiB]"""
    record = out.with_suffix(".json")
    if record.exists():
        return json.loads(record.read_text())
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        ["/usr/bin/time", "-f", "%M", "-o", out.with_suffix(".kib"), program, "train", scene,
         "--views", ",".join(names), "-o", out, *options],
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    memory = int(out.with_suffix(".kib").read_text()) / 1024
    found = {"seconds": used, "memory": memory}
    record.write_text(json.dumps(found))
    return found


def row(program, scene, inputs, held_out, out, options):
    found = train(program, scene, inputs, out, options)
    done = subprocess.run(
        [program, "evaluate", out, "--views", ",".join(held_out), "--json"],
        capture_output=True,
        text=True,
        check=True,
    )
    mean = json.loads(done.stdout)["mean"]
    training = json.loads((out / "training.json").read_text())
    depth = training["depth_of_views"]
    measured = sum(view["with_evidence"] for view in depth) / len(depth)
    figures = {
        "photographs": len(inputs),
        "psnr": mean["psnr"],
        "measured": measured,
        "seconds": found["seconds"],
    }
    return figures, [
        str(len(inputs)),
        f"{mean['psnr']:.2f} dB / {mean['ssim']:.3f}",
        f"{mean['psnr_seen']:.2f} dB",
        f"{100 * mean['hole_fraction']:.1f} %",
        f"{100 * measured:.0f} %",
        f"{training['gaussians'] / 1e6:.2f} million",
        f"{found['seconds']:.0f}",
        f"{found['memory']:.0f} MiB",
    ]


def panel(title, counts, values, left):
    """A curve over the number of photographs, whose axis is logarithmic; the other begins at zero."""
    width, height, top = 240, 150, 30
    first, last = math.log(counts[0]), math.log(counts[-1])
    most = max(values)
    points = [
        (left + width * (math.log(count) - first) / (last - first), top + height * (1 - value / most))
        for count, value in zip(counts, values)
    ]
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    parts = [
        f'<text x="{left}" y="16">{title}</text>',
        f'<path d="M{left} {top}V{top + height}H{left + width}" fill="none" stroke="#75808c"/>',
        f'<polyline points="{line}" fill="none" stroke="#1f6fb5" stroke-width="2"/>',
    ]
    for (x, y), count, value in zip(points, counts, values):
        parts += [
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#1f6fb5"/>',
            f'<text x="{x:.1f}" y="{y - 8:.1f}" text-anchor="middle">{value:.3g}</text>',
            f'<text x="{x:.1f}" y="{top + height + 16}" text-anchor="middle">{count}</text>',
        ]
    return parts


def draw(rows, path):
    """Decibels, share measured and processor seconds over the number of photographs."""
    counts = [row["photographs"] for row in rows]
    panels = [
        ("held out, all pixels [dB]", [row["psnr"] for row in rows]),
        ("measured of the inputs [%]", [100 * row["measured"] for row in rows]),
        ("processor seconds", [row["seconds"] for row in rows]),
    ]
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 890 210" font-size="12" '
        'font-family="system-ui, sans-serif" fill="#1d2733">',
        '<rect width="890" height="210" fill="#ffffff"/>',
    ]
    for i, (title, values) in enumerate(panels):
        parts += panel(title, counts, values, 20 + 295 * i)
    path.write_text("\n".join(parts + ["</svg>"]) + "\n")


def main(arguments):
    split = arguments.index("--") if "--" in arguments else len(arguments)
    options = arguments[split + 1 :]
    if split < 4:
        print(__doc__, file=sys.stderr)
        return 2
    program, scene, out = arguments[0], arguments[1], Path(arguments[2])
    out.mkdir(parents=True, exist_ok=True)
    held_out, others = held_out_and_others(program, scene)
    print("| photographs | held out, all pixels | seen | holes | measured | Gaussians "
          "| core-s | memory |")
    print("|---|---|---|---|---|---|---|---|")
    rows = []
    for count in map(int, arguments[3:split]):
        inputs = spread(others, count)
        figures, columns = row(program, scene, inputs, held_out, out / str(len(inputs)), options)
        rows.append(figures)
        print("| " + " | ".join(columns) + " |", flush=True)
    if len(rows) > 1:
        draw(rows, out / "photo_count.svg")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
