#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether `cgs next` names the photograph that helps most: adds each of the photographs that are left
to some inputs, one at a time, and measures all others with it.

usage: next_photo.py PROGRAM SCENE OUT INPUTS [-- OPTION...]

  tests/eval/next_photo.py build/release/bin/cgs fern out/next 1,10,19 -- --downscale 8

OPTIONs go to `cgs train`. What was trained already is read from OUT. Per candidate, in the order that
`cgs next` gives: held-out PSNR over all pixels, and share of the input pixels measured, with it. Held
out are the photographs that are neither input nor candidate: every second of the rest is one.
"""

import json
import subprocess
import sys
from pathlib import Path


def run(*command):
    return subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, check=True
    ).stdout


def main(arguments):
    split = arguments.index("--") if "--" in arguments else len(arguments)
    options = arguments[split + 1 :]
    if split != 4:
        print(__doc__, file=sys.stderr)
        return 2
    program, scene, out, inputs = arguments[0], arguments[1], Path(arguments[2]), arguments[3]
    out.mkdir(parents=True, exist_ok=True)
    cameras = json.loads(run(program, "info", scene, "--views", inputs, "--json"))["cameras"]
    rest = [c["name"] for c in cameras if c["role"] in ("held out", "not used")]
    candidates = rest[1::2]
    held_out = rest[::2]
    chosen = [c["name"] for c in cameras if c["role"] == "input"]

    def trained(names, folder):
        if not (folder / "cameras.json").exists():
            run(program, "train", scene, "--views", ",".join(names), "-o", folder, "-q", *options)
        return folder

    def figures(names, folder):
        model = trained(names, folder)
        mean = json.loads(
            run(program, "evaluate", model, "--views", ",".join(held_out), "--json")
        )["mean"]
        depth = json.loads((model / "training.json").read_text())["depth_of_views"]
        return mean["psnr"], sum(view["with_evidence"] for view in depth) / len(depth)

    base = figures(chosen, out / "base")
    ranked = json.loads(
        run(program, "next", out / "base", "--views", ",".join(candidates), "--count", "100",
            "--json")
    )
    print(f"without: {base[0]:.2f} dB, {100 * base[1]:.0f} % measured")
    results = []
    for rank, place in enumerate(ranked):
        name = place["name"]
        results.append(figures(chosen + [name], out / name))
        print(f"{rank + 1} {name}: worth {place['worth']:.3f}, {results[-1][0]:.2f} dB, "
              f"{100 * results[-1][1]:.0f} % measured", flush=True)
    mean = [sum(r[k] for r in results) / len(results) for k in (0, 1)]
    best = max(results)
    print(f"first choice {results[0][0]:.2f} dB, {100 * results[0][1]:.0f} %; mean of all "
          f"{mean[0]:.2f} dB, {100 * mean[1]:.0f} %; best {best[0]:.2f} dB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
