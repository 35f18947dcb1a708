#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the program on a scene and prints what each stage took; beside another build of it, if one is
given, as ratios of the same minutes.

usage: real_run.py [--against PROGRAM] PROGRAM SCENE [OPTION...]

  tests/bench/real_run.py --against old/cgs build/release/bin/cgs photographs --preset draft

OPTIONs go to `cgs run`. Columns: wall [s], user and system time of all threads [s], pages that the kernel
had to supply [thousands], read and written [MiB], and the peak of memory so far [MiB], from /proc
while the program runs.
"""

import os
import re
import subprocess
import sys
import tempfile
import time

COLUMNS = ("wall", "user", "system", "pages", "read", "written", "peak")
END_OF_STAGE = re.compile(r"^(\S.*?)\s+\d+(\.\d+)? s(\s|$)")


def counters(pid):
    """What a process has used so far, in the order of COLUMNS."""
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    minor, major, user, system = (int(fields[k]) for k in (7, 9, 11, 12))
    ticks = os.sysconf("SC_CLK_TCK")
    with open(f"/proc/{pid}/io") as file:
        io = dict(line.split(": ") for line in file.read().splitlines())
    with open(f"/proc/{pid}/status") as file:
        peak = re.search(r"VmHWM:\s+(\d+)", file.read())
    return (time.monotonic(), user / ticks, system / ticks, (minor + major) / 1e3,
            int(io["rchar"]) / 2**20, int(io["wchar"]) / 2**20,
            int(peak[1]) / 2**10 if peak else 0.0)


def stages_of(program, scene, options):
    """Per stage its counters, and of all together."""
    stages = {}
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen([program, "run", scene, *options, "-o", f"{folder}/run"],
                                   stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        first = before = counters(process.pid)
        for line in process.stderr:
            end = END_OF_STAGE.match(line)
            if end is None or process.poll() is not None:
                continue
            now = counters(process.pid)
            stages[end[1]] = [*(b - a for a, b in zip(before[:-1], now[:-1])), now[-1]]
            before = now
        if process.wait() != 0:
            sys.exit(f"{program} ended with {process.returncode}")
    stages["all"] = [*(b - a for a, b in zip(first[:-1], before[:-1])), before[-1]]
    return stages


def cell(value, other):
    ratio = f" ({value / other:.2f})" if other else ""
    return f"{value:.1f}{ratio}"


def main():
    arguments = sys.argv[1:]
    against = None
    if len(arguments) > 1 and arguments[0] == "--against":
        against, arguments = arguments[1], arguments[2:]
    if len(arguments) < 2:
        sys.exit(__doc__)
    program, scene, options = arguments[0], arguments[1], arguments[2:]
    others = stages_of(against, scene, options) if against else {}
    stages = stages_of(program, scene, options)
    print("| stage | " + " | ".join(COLUMNS) + " |\n" + "|---" * (len(COLUMNS) + 1) + "|")
    for stage, values in stages.items():
        other = others.get(stage, [0.0] * len(values))
        print(f"| {stage} | " + " | ".join(cell(v, o) for v, o in zip(values, other)) + " |")


if __name__ == "__main__":
    main()
