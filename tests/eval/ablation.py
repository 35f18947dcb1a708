#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What each part of the training brings on held-out views, as a Markdown table.

usage: tests/eval/ablation.py CGS_BUILD MODEL... [--rows NAME,NAME] [--limit VIEWS | --views NAME,NAME]
                              [--time]

CGS_BUILD is the folder of the programs (build/release/bin). Each MODEL is a folder that
`cgs train SCENE --set steps=0 -o MODEL` wrote. Every setting is trained from the same start on each
of them, by training_accuracy; the fox needs --limit 2. A row says what is changed from the standard
setting, a column PSNR [dB] and SSIM over all pixels, the share of holes and, with --time, the
core-seconds of the steps. Rows of many steps, of networks (decoder=conv) and of terms of related
systems (all of them: --rows related) only run where named.
"""
import argparse
import pathlib
import re
import subprocess
import sys

ROWS = {
    "standard": [],
    "no training": ["steps=0"],
    "draft": ["steps=20"],
    "120 steps": ["steps=120"],
    "almost no decoder: lattices of 2 pixels": ["depth_spacing=2", "opacity_spacing=2"],
    "depth stays": ["depth_rate=1e-12"],
    "opacity stays": ["opacity_rate=1e-12"],
    "shapes stay balls": ["free_from=1"],
    "colours stay": ["color_rate=0"],
    "colours the same from everywhere": ["sh_degree=0"],
    "no prior of depth": ["prior_weight=0"],
    "no prior of opacity": ["opacity_prior=0"],
    "no prior of colours": ["color_prior=0"],
    "no D-SSIM": ["ssim_weight=0", "l1_weight=1"],
    "L1 on one scale": ["l1_levels=1"],
    "with multisampling": ["sharp_from=0.5"],
    "with coarse to fine": ["coarse_until=0.3"],
    "with TV": ["tv_weight=0.01"],
    "with TV within layers": ["masked_tv_weight=0.01"],
    "with flow": ["flow_weight=1"],
    "with block dropout": ["dropout=0.1"],
}
SLOW = {
    "240 steps": ["steps=240"],
    "1500 steps": ["steps=1500"],
    "networks": ["decoder=conv"],
    "networks 240 steps": ["decoder=conv", "steps=240"],
    "reference 240 steps": ["preset=reference", "steps=240"],
}
# Terms of related systems, two weights each; `--rows related` runs all of them.
RELATED = {
    f"{name} {value}": [f"{field}={value}"]
    for name, field, values in [
        ("spread of depth", "spread_weight", ("0.0005", "0.003")),
        ("emptiness", "emptiness_weight", ("0.003", "0.03")),
        ("near opacity", "near_opacity_weight", ("0.1", "1")),
        ("mean of parameters", "average_decay", ("0.8", "0.95")),
        ("edge-aware smoothness", "edge_smooth_weight", ("0.3", "1")),
        ("seen through", "seen_through_weight", ("0.1", "1")),
        ("order of depth", "order_weight", ("0.1", "1")),
        ("depth of patches", "patch_depth_weight", ("0.001", "0.01")),
        ("virtual views", "virtual_weight", ("0.2", "0.8")),
        ("TV of virtual views", "virtual_tv_weight", ("0.003", "0.03")),
        ("pruned before the mode", "prune", ("0.05", "0.2")),
    ]
    for value in values
}


def last_line(program, model, held_out, settings):
    """PSNR, SSIM, share of holes and core-seconds after the last step."""
    done = subprocess.run(
        [program, model, "every=100000", held_out, *settings],
        capture_output=True, text=True, check=False)
    lines = [line for line in done.stdout.splitlines() if re.match(r"\s*\d+ ", line)]
    if done.returncode != 0 or not lines:
        sys.exit(f"{program} {model} {' '.join(settings)}: {done.stderr.strip()}")
    parts = lines[-1].split("|")
    psnr, ssim = (float(word) for word in parts[1].split())
    return psnr, ssim, parts[3].split()[1], float(parts[0].split()[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build")
    parser.add_argument("models", nargs="+")
    parser.add_argument("--rows", help="only these, separated by commas")
    parser.add_argument("--limit", type=int, default=6, help="held-out views per model")
    parser.add_argument("--views", help="held-out views by name instead, separated by commas")
    parser.add_argument("--time", action="store_true", help="core-seconds of the steps as well")
    args = parser.parse_args()
    program = str(pathlib.Path(args.build) / "training_accuracy")
    rows = args.rows.split(",") if args.rows else list(ROWS)
    if rows == ["related"]:
        rows = list(RELATED)
    known = ROWS | SLOW | RELATED
    unknown = [row for row in rows if row not in known]
    if unknown:
        sys.exit(f"--rows: {', '.join(unknown)} is none of {', '.join(known)}")
    held_out = f"views={args.views}" if args.views else f"limit={args.limit}"
    rows = ["standard"] + [row for row in rows if row != "standard"]  # what changes are against
    names = [pathlib.Path(model).name for model in args.models]
    print("| setting | " + " | ".join(names) + " | mean change |")
    print("|---" * (len(names) + 2) + "|")
    standard = None
    for row in rows:
        results = [last_line(program, model, held_out, known[row]) for model in args.models]
        standard = standard or results
        change = sum(r[0] - s[0] for r, s in zip(results, standard)) / len(results)
        cells = [f"{psnr:.2f} / {ssim:.3f}, {holes}" + (f", {seconds:.0f} s" if args.time else "")
                 for psnr, ssim, holes, seconds in results]
        print(f"| {row} | " + " | ".join(cells) + f" | {change:+.2f} dB |", flush=True)


if __name__ == "__main__":
    main()
