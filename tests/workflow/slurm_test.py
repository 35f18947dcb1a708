#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Twelve scenes through Snakemake and Slurm: one is killed for its memory and a node is drained, and all end.

usage: slurm_test.py CGS CAPTURE FOLDER

Starts a Slurm of its own: two nodes of two cores, both of them this machine, reached from nowhere else. What the
jobs leave must be, to the bit, what the program leaves when it is called by hand.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time

sys.dont_write_bytecode = True  # nothing is left in the sources
import common

SCENES = 12
KILLED = "scene_07"
DRAINED_AFTER = 3  # scenes
SLURM_CONF = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
AuthInfo=socket={work}/munge.socket
SlurmUser={user}
SlurmdUser={user}
SlurmctldPidFile={work}/slurmctld.pid
SlurmdPidFile={work}/%n.pid
StateSaveLocation={work}/state
SlurmdSpoolDir={work}/spool/%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=1
JobAcctGatherParams=OverMemoryKill
JobCompType=jobcomp/filetxt
JobCompLoc={work}/jobs.txt
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SlurmdParameters=config_overrides
MpiDefault=none
KillWait=5
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[1]} CPUs=2 RealMemory=4000
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[2]} CPUs=2 RealMemory=4000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE
"""
# Stands for a scene that needs more than was foretold: holds as much as its job has at first.
HUNGRY = """#!/usr/bin/python3
import subprocess, sys, time
held = b""
if "--overwrite" in sys.argv and any(argument.endswith("{killed}") for argument in sys.argv):
    held = bytearray({megabytes} << 20)
    held[::4096] = b"x" * len(held[::4096])
    time.sleep(4)
sys.exit(subprocess.call(["{cgs}", *sys.argv[1:]]))
"""

os.environ["PATH"] += ":/usr/sbin"
common.skip_without("snakemake", "munged", "slurmctld", "slurmd", "sbatch")
version = subprocess.run(["snakemake", "--version"], capture_output=True, text=True).stdout.strip()
if not version.startswith("7."):
    print(f"skipped: the profile is for Snakemake 7, this is {version}")
    sys.exit(77)
cgs, capture, work = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])


def free_ports(count):
    held = [socket.socket() for _ in range(count)]
    for one in held:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in held]
    for one in held:
        one.close()
    return ports


class Slurm:
    """Runs from `with` to its end, in folders of its own."""

    def __enter__(self):
        os.environ["SLURM_CONF"] = str(work / "slurm.conf")
        for folder in ("state", "spool/n1", "spool/n2"):
            (work / folder).mkdir(parents=True)
        key = work / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o600)
        user = subprocess.run(["id", "-un"], capture_output=True, text=True, check=True).stdout.strip()
        conf = SLURM_CONF.format(host=socket.gethostname().split(".")[0], ports=free_ports(3), work=work, user=user)
        (work / "slurm.conf").write_text(conf)
        self.daemons = []
        try:
            files = [f"--{name}-file={work}/munge.{name}" for name in ("key", "pid", "log", "seed")]
            self.start("munged", "--foreground", "--force", f"--socket={work}/munge.socket", *files)
            wait_until(lambda: (work / "munge.socket").exists(), "munged")
            self.start("slurmctld", "-D", "-c")
            for node in ("n1", "n2"):
                self.start("slurmd", "-D", "-N", node)
            wait_until(lambda: said("sinfo", "-h", "-N", "-o", "%N %T") == "n1 idle\nn2 idle\n", "Slurm")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        if len(self.daemons) > 1:
            said("scancel", "--user", str(os.getuid()))
            for _ in range(20):
                if not said("squeue", "-h"):
                    break
                time.sleep(0.5)
        for daemon in reversed(self.daemons):
            daemon.terminate()
            try:
                daemon.wait(10)
            except subprocess.TimeoutExpired:
                daemon.kill()

    def start(self, *command):
        log = open(work / f"daemon_{len(self.daemons)}.log", "w")
        self.daemons.append(
            subprocess.Popen(command, stdout=log, stderr=log, preexec_fn=common.ends_with_this_process))


def said(*command):
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=30).stdout
    except subprocess.TimeoutExpired:
        return ""


def wait_until(is_so, what, seconds=60):
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end, f"{what} is not there after {seconds} s; see {work}"
        time.sleep(0.2)


def drain():
    """Takes a node out once some scenes are done; says when."""
    wait_until(lambda: len(list(results.glob("*/report.json"))) >= DRAINED_AFTER, "some scenes", 600)
    subprocess.run(["scontrol", "update", "NodeName=n2", "State=DRAIN", "Reason=test"], check=True)
    drained.append(time.time())


def ended_jobs():
    """What Slurm wrote down of each: a dictionary."""
    for line in (work / "jobs.txt").read_text().splitlines():
        job = dict(re.findall(r"(\w+)=(\S*)", line))
        for key in ("StartTime", "EndTime"):
            job[key] = time.mktime(time.strptime(job[key], "%Y-%m-%dT%H:%M:%S"))
        yield job


# So that Slurm is ended, too, with its jobs. They may take no longer than CTest waits.
for number in (signal.SIGTERM, signal.SIGALRM):
    signal.signal(number, lambda number, _: sys.exit(128 + number))
signal.alarm(1200)
shutil.rmtree(work, ignore_errors=True)
names = common.make_scenes(capture, work / "photos", SCENES)
results, jobs = work / "out/results", work / "out/jobs"
options = common.OPTIONS.split()
for name in names:
    subprocess.run([cgs, "run", f"photos/{name}", *options, "-q", "-o", f"hand/{name}"], cwd=work, check=True)

plan = json.loads(subprocess.run([common.WORKFLOW / "plan.py", cgs, "1", "10", f"photos/{KILLED}", "none", *options],
                                 cwd=work, capture_output=True, check=True).stdout)["mem_mb"]
common.write_program(work / "hungry", HUNGRY.format(killed=KILLED, megabytes=plan, cgs=cgs))

drained = []
start = time.monotonic()
with Slurm():
    drainer = threading.Thread(target=drain, daemon=True)
    drainer.start()
    code, output = common.snakemake(
        work, "--profile", common.WORKFLOW / "slurm", "--latency-wait", "10", "--config", "scenes=photos", "output=out",
        f"cgs={work}/hungry", "threads=1", "minutes=10", f"options={common.OPTIONS}")
    assert code == 0, output
    assert drained, "all scenes were done before a node was drained"
    wait_until(lambda: said("sinfo", "-h", "-N", "-n", "n2", "-o", "%T") == "drained\n", "a drained node")
print(f"{SCENES} scenes in {time.monotonic() - start:.0f} s")

ended = list(ended_jobs())
on_drained = [job for job in ended if job["NodeList"] == "n2"]
assert on_drained, "the drained node did nothing before"
assert all(job["StartTime"] <= drained[0] + 1 for job in on_drained), "the drained node was given jobs"
assert any(job["StartTime"] > drained[0] for job in ended), "nothing was left to do on the other node"
completed = [job for job in ended if job["JobState"] == "COMPLETED"]
failed = [job for job in ended if job["JobState"] != "COMPLETED"]
assert len(completed) == 2 * SCENES and len(failed) == 1, ended
assert failed[0]["Name"] == "cgs-scene" and f"mem={plan}M" in failed[0]["Tres"], failed

for name in names:
    had = common.attempts(jobs / f"{name}.attempts")
    assert had == ([plan, 2 * plan] if name == KILLED else [plan]), (name, had)
    assert ("exceeded memory limit" in (jobs / f"{name}.log.slurm").read_text()) == (name == KILLED), name
    assert not (results / name / "failure.txt").exists(), name
    by_hand, by_job = common.files_of(work / "hand" / name), common.files_of(results / name)
    assert "model/gaussians.ply" in by_hand and "web/asset.glb" in by_hand
    assert by_hand.keys() == by_job.keys(), (name, by_hand.keys() ^ by_job.keys())
    different = [file for file in by_hand if by_hand[file] != by_job[file]]
    assert not different, (name, different)
assert len({(results / name / "model/gaussians.ply").read_bytes() for name in names}) == SCENES
assert f"{SCENES} of {SCENES} scenes" in (results / "index.html").read_text()
assert json.loads((results / "batch.json").read_text())[0]["state"] == "done"
print(f"{SCENES * len(by_hand)} files are those of runs by hand; {KILLED} was killed at {plan} MB and ended with {2 * plan} MB")

# What a job takes besides its work: Slurm knows whole seconds.
of_jobs = sum(job["EndTime"] - job["StartTime"] for job in completed)
of_work = sum(float(path.read_text().splitlines()[1].split("\t")[0]) for path in jobs.glob("*.tsv"))
print(f"a job takes {(of_jobs - of_work) / len(completed):.1f} s besides")
