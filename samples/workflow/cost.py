#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What many scenes would cost on a cluster, from the jobs of scenes that are done.

usage: cost.py OUT --scenes N --nodes N --cores N --memory GB     cores and memory of a node

OUT is the folder `output` of the workflow. Core-hours are those that jobs reserve. The scenes are taken
to be like those that are done, in turn, and nodes to be as fast as the machines that did these and used by
nobody else; nothing fails.
"""
import argparse
import csv
import heapq
import itertools
import json
import pathlib
import re

START = 3          # [s] of Slurm and of Snakemake in a job; tests/workflow/slurm_test.py prints them
SUBMITTED = 10     # jobs a second, at most; Snakemake's own limit
ASKED = 10         # running jobs a second that it asks Slurm for, in rounds
BETWEEN_ROUNDS = 10  # [s]


def most_at_once():
    profile = pathlib.Path(__file__).parent / "slurm" / "config.yaml"
    return int(re.search(r"^jobs: (\d+)", profile.read_text(encoding="utf-8"), re.MULTILINE)[1])


def seconds_of(path):
    with open(path, encoding="utf-8") as file:
        return float(next(csv.DictReader(file, delimiter="\t"))["s"])


def measured(jobs):
    """(seconds of the plan, seconds of the run, plan) of each scene that is done."""
    for run in sorted(jobs.glob("*.run.tsv")):
        stem = str(run)[:-len(".run.tsv")]
        plan = json.loads(pathlib.Path(stem + ".plan.json").read_text(encoding="utf-8"))
        yield seconds_of(stem + ".plan.tsv"), seconds_of(run), plan


def finished_after(scenes, at_once):
    """[s] until jobs of these pairs of seconds are done, each second one after the first."""
    seen = BETWEEN_ROUNDS + at_once / ASKED  # until Snakemake knows that a job has ended
    free = [0.0] * at_once
    ready = [(0.0, 0, i) for i in range(len(scenes))]  # when a job may be submitted, which of the two, scene
    submitted = 0.0
    while ready:
        at, which, scene = heapq.heappop(ready)
        submitted = max(submitted + 1 / SUBMITTED, at, free[0])
        end = submitted + START + scenes[scene][which] + seen
        heapq.heapreplace(free, end)
        if which == 0:
            heapq.heappush(ready, (end, 1, scene))
    return max(free)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("out", type=pathlib.Path)
    for name in ("--scenes", "--nodes", "--cores", "--memory"):
        parser.add_argument(name, type=int, required=True)
    args = parser.parse_args()
    jobs = list(measured(args.out / "jobs"))
    if not jobs:
        parser.exit(1, f"cost.py: no scene is done in {args.out}\n")
    threads = max(plan["threads"] for _, _, plan in jobs)
    memory = max(plan["mem_mb"] for _, _, plan in jobs)
    seconds = [run for _, run, _ in jobs]
    on_node = min(args.cores // threads, args.memory * 1000 // memory)
    if on_node == 0:
        parser.exit(1, f"cost.py: a job needs {threads} cores and {memory} MB, more than such a node has\n")
    at_once = min(on_node * args.nodes, most_at_once())
    scenes = list(itertools.islice(itertools.cycle([(plan, run) for plan, run, _ in jobs]), args.scenes))
    core_hours = threads * sum(plan + run + 2 * START for plan, run in scenes) / 3600
    done = "1 scene is done" if len(jobs) == 1 else f"{len(jobs)} scenes are done"
    print(f"{done}: {sum(seconds) / len(seconds):.0f} s ({min(seconds):.0f} to "
          f"{max(seconds):.0f} s) on {threads} cores with up to {memory / 1000:.1f} GB")
    print(f"{args.scenes} of them on {args.nodes} nodes, {at_once} jobs at once: {core_hours:.1f} core-hours, "
          f"{finished_after(scenes, at_once) / 60:.0f} min")


if __name__ == "__main__":
    main()
