#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Says whether the presets lie on the measured fronts of scenes: a table of what each costs and
brings, and of the settings that beat it in both.

usage: preset_fronts.py TRADEOFF...

TRADEOFF is the output folder of `cgs tradeoff SCENE -o TRADEOFF`, of a scene with photographs held
out. Time is that of the processor from photographs to views; it must differ by more than that of the
three standard runs, PSNR by more than 0.05 dB.
"""

import json
import sys
from pathlib import Path

PRESETS = ("draft", "standard", "fine")
PSNR_NOISE = 0.05  # [dB]


def cost(setting):
    return setting["cost"]["model"]["cpu"]


def psnr(setting):
    return setting["pictures"]["psnr"]


def rows(folder):
    found = json.loads((folder / "tradeoff.json").read_text())
    noise = found["noise"]["cpu"]
    settings = {s["label"]: s for s in found["settings"] if "failed" not in s}
    for preset in PRESETS:
        if preset not in settings:
            yield [folder.name, preset, "not measured", "", ""]
            continue
        own = settings[preset]
        better = [
            label
            for label, s in settings.items()
            if cost(s) * (1 + noise) < cost(own) and psnr(s) > psnr(own) + PSNR_NOISE
        ]
        costs = f"{cost(own):.1f} s ± {100 * noise:.0f} %"
        yield [folder.name, preset, costs, f"{psnr(own):.2f} dB", ", ".join(better) or "none"]


def main(folders):
    print("| scene | preset | CPU | PSNR held out | beaten by |\n|---|---|---|---|---|")
    for folder in folders:
        for row in rows(Path(folder)):
            print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1:])
