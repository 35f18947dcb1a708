#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""How time and memory of a run grow with the pixels of its photographs, per stage, and how much
more threads help.

usage: growth.py PROGRAM SCENE OUT DIVISOR... [-- OPTION...]

  tests/bench/growth.py build/release/bin/cgs herzjesu out 12 8 6 4 3 -- --views 2,4,6 --preset draft

Runs the program with --downscale DIVISOR each, the coarsest first, and the middle one once more with
a single thread. Prints processor seconds per stage over the megapixels of the input photographs, the
power of the pixels with which they grow (a straight line through the logarithms), and the peak of memory;
then wall time with one thread over that with all. Draws OUT/growth.svg. OPTIONs go to `cgs run`.
"""

import json
import math
import subprocess
import sys
from pathlib import Path

import real_run

COLORS = ["#1f6fb5", "#c2571a", "#2c8a4b", "#8a4bb0", "#b8860b", "#5b6670", "#c23b63", "#12848c",
          "#7f3f00", "#000000", "#9aa50f", "#4d5cff"]
LEAST = 0.5  # [processor seconds] stages below it at the largest size are left out


def megapixels(program, scene, divisor, options, out):
    """Of all input photographs at this size."""
    done = subprocess.run(
        [program, "run", scene, *options, "--downscale", str(divisor), "--dry-run", "--json", "-q", "-o", out],
        capture_output=True, text=True, check=True)
    return json.loads(done.stdout)["pixels"] / 1e6


def processor_seconds(stages):
    return {name: values[1] + values[2] for name, values in stages.items()}


def power(sizes, seconds):
    """The slope of a straight line through the logarithms."""
    xs, ys = [math.log(x) for x in sizes], [math.log(max(y, 0.01)) for y in seconds]
    mean_x, mean_y = sum(xs) / len(xs), sum(ys) / len(ys)
    return (sum((x - mean_x) * (y - mean_y) for x, y in zip(xs, ys))
            / sum((x - mean_x) ** 2 for x in xs))


def draw(sizes, curves, path):
    """Both axes logarithmic."""
    left, top, width, height = 50, 20, 420, 300
    values = [value for curve in curves.values() for value in curve if value >= LEAST / 5]
    low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    first, last = math.log10(sizes[0]), math.log10(sizes[-1])

    def place(size, value):
        along = (math.log10(size) - first) / (last - first)
        up = (math.log10(max(value, 10**low)) - low) / (high - low)
        return left + width * along, top + height * (1 - up)

    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 700 370" font-size="12" '
        'font-family="system-ui, sans-serif" fill="#1d2733">',
        '<rect width="700" height="370" fill="#ffffff"/>',
        f'<path d="M{left} {top}V{top + height}H{left + width}" fill="none" stroke="#75808c"/>',
        f'<text x="{left}" y="{top - 6}">processor seconds</text>',
        f'<text x="{left + width}" y="{top + height + 34}" text-anchor="end">megapixels of input</text>',
    ]
    for k in range(low, high + 1):
        y = place(sizes[0], 10**k)[1]
        parts += [f'<path d="M{left} {y:.1f}H{left + width}" stroke="#e3e7eb"/>',
                  f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{10**k:g}</text>']
    for size in sizes:
        x = place(size, 1)[0]
        parts.append(f'<text x="{x:.1f}" y="{top + height + 16}" text-anchor="middle">{size:.2g}</text>')
    for i, (name, curve) in enumerate(sorted(curves.items(), key=lambda item: -item[1][-1])):
        color = COLORS[i % len(COLORS)]
        line = " ".join("{:.1f},{:.1f}".format(*place(*pair)) for pair in zip(sizes, curve))
        parts += [
            f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="2"/>',
            f'<text x="{left + width + 12}" y="{top + 16 * i + 10}" fill="{color}">{name}: '
            f"{power(sizes, curve):.2f}</text>",
        ]
    path.write_text("\n".join(parts + ["</svg>"]) + "\n")


def main():
    arguments = sys.argv[1:]
    split = arguments.index("--") if "--" in arguments else len(arguments)
    options = arguments[split + 1:]
    if len(set(arguments[3:split])) < 2:
        sys.exit(__doc__)
    program, scene, out = arguments[0], arguments[1], Path(arguments[2])
    divisors = sorted(set(map(int, arguments[3:split])), reverse=True)
    out.mkdir(parents=True, exist_ok=True)
    sizes = [megapixels(program, scene, divisor, options, out / "plan") for divisor in divisors]
    runs = []
    for divisor in divisors:
        runs.append(real_run.stages_of(program, scene, [*options, "--downscale", str(divisor)]))
        print(f"# {divisor}: {runs[-1]['all'][0]:.0f} s", file=sys.stderr)
    curves = {}
    for name in runs[-1]:
        if all(name in run for run in runs):
            curve = [processor_seconds(run)[name] for run in runs]
            if curve[-1] >= LEAST:
                curves[name] = curve
    print("| | " + " | ".join(f"{size:.2f}" for size in sizes) + " megapixels | power |")
    print("|---" * (len(sizes) + 2) + "|")
    for name, curve in curves.items():
        print(f"| {name} | " + " | ".join(f"{value:.1f}" for value in curve)
              + f" | {power(sizes, curve):.2f} |")
    peaks = [run["all"][-1] for run in runs]
    print("| memory [MiB] | " + " | ".join(f"{peak:.0f}" for peak in peaks)
          + f" | {power(sizes, peaks):.2f} |")
    draw(sizes, curves, out / "growth.svg")
    middle = len(divisors) // 2
    alone = real_run.stages_of(
        program, scene, [*options, "--downscale", str(divisors[middle]), "--threads", "1"])
    print(f"\nat {sizes[middle]:.2f} megapixels, one thread over all: " + ", ".join(
        f"{name} {alone[name][0] / runs[middle][name][0]:.2f}" for name in curves if name in alone))


if __name__ == "__main__":
    main()
