#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Says how well finished runs foresaw their memory, stage by stage.

usage: memory_ratio.py OUT...     folders of `cgs run`

Prints predicted over actual peak of each stage, and over all of them the least and the largest;
ends with 1 if a stage lies outside of 0.8 to 1.25.
"""
import json
import os
import sys

LEAST, MOST = 0.8, 1.25
# What the plan calls the stages of a run.
STAGES = {"depth and Gaussians": "model", "views": "views", "held-out views": "evaluation",
          "splats for browsers": "splats", "volume and mesh": "mesh", "textured assets": "web",
          "report": "report"}


def ratios(folder):
    with open(os.path.join(folder, "run.json"), encoding="utf-8") as file:
        record = json.load(file)
    for title, foreseen in record["predicted_memory"].items():
        stage = STAGES[title]
        done = record["stages"].get(stage)
        if done:
            yield stage, foreseen / done["peak_memory"]


def main(folders):
    found = []
    for folder in folders:
        of_run = list(ratios(folder))
        print(folder + ": " + ", ".join(f"{stage} {ratio:.2f}" for stage, ratio in of_run))
        found += [ratio for _, ratio in of_run]
    print(f"memory: predicted over actual {min(found):.2f} to {max(found):.2f}, "
          f"{len(found)} stages of {len(folders)} runs")
    return 0 if LEAST <= min(found) and max(found) <= MOST else 1


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1:]))
