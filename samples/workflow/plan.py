#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a job of `cgs run` needs, as JSON: {"threads", "mem_mb", "minutes"}.

usage: plan.py CGS THREADS MINUTES SCENE OUT [OPTION...]     OPTIONs as for cgs run

Cameras of photographs alone are then in OUT/model, so that the job does not solve for them again.
"""
import json
import math
import subprocess
import sys

SNAKEMAKE = 150    # [MiB] of it in a job
MARGIN = 1.25      # predictions are down to 0.82 of what is needed


def main(cgs, threads, minutes, scene, out, *options):
    asked = subprocess.run([cgs, "run", scene, *options, "--dry-run", "--json", "--threads", threads, "-o", out],
                           stdout=subprocess.PIPE, text=True)
    if asked.returncode != 0:
        return asked.returncode if asked.returncode > 0 else 1  # below 0: killed
    memory = math.ceil(MARGIN * (json.loads(asked.stdout)["most_memory"] / 2**20 + SNAKEMAKE))
    print(json.dumps({"threads": int(threads), "mem_mb": memory, "minutes": int(minutes)}))
    return 0


if __name__ == "__main__":
    if len(sys.argv) < 6:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
