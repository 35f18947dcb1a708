# SPDX-License-Identifier: GPL-3.0-or-later
# A scene: how much it needs, then all of `cgs run`. Ends with results/NAME/report.json or, as `cgs
# batch` has it, with results/NAME/failure.txt, which says why not.

if not os.path.isdir(config["scenes"]):
    raise WorkflowError(f"{config['scenes']} is no folder; say where the scenes are: --config scenes=FOLDER")
SCENES = sorted(entry.name for entry in os.scandir(config["scenes"]) if entry.is_dir() and entry.name[0] != ".")
if not SCENES:
    raise WorkflowError(f"{config['scenes']} has no folders; each scene is one")


wildcard_constraints:
    scene="[^/]+"


def folder_of(wildcards):
    return os.path.join(config["scenes"], wildcards.scene)


rule plan:
    input:
        lambda wildcards: folders_of(folder_of(wildcards))
    output:
        os.path.join(JOBS, "{scene}.plan.json")
    log:
        os.path.join(JOBS, "{scene}.plan.log")
    benchmark:
        os.path.join(JOBS, "{scene}.plan.tsv")
    params:
        scene=folder_of,
        options=OPTIONS,
        tool=PLAN,
        folder=os.path.join(RESULTS, "{scene}"),
    threads: config["threads"]
    resources:
        mem_mb=lambda wildcards, attempt: 1000 * attempt,
        minutes=lambda wildcards, attempt: config["minutes"] * attempt,
    shell:
        PLANS


# --overwrite is for other options than before; it keeps what they do not change, and the cameras of the plan.
rule scene:
    input:
        plan=os.path.join(JOBS, "{scene}.plan.json")
    output:
        os.path.join(RESULTS, "{scene}", "report.json")
    log:
        os.path.join(JOBS, "{scene}.log")
    benchmark:
        os.path.join(JOBS, "{scene}.run.tsv")
    params:
        scene=folder_of,
        options=OPTIONS,
        folder=os.path.join(RESULTS, "{scene}"),
        attempts=os.path.join(JOBS, "{scene}.attempts"),  # Snakemake keeps the log of the last alone
    threads: config["threads"]
    resources:
        mem_mb=of_plan("mem_mb"),
        minutes=of_plan("minutes"),
    shell:
        says_why("{CGS:q} run {params.scene:q} {params.options} --overwrite --threads {threads} "
                 + MEMORY_LIMIT + " -o {params.folder:q}")


def write_page():
    """results/index.html over all that has ended, well or not; `cgs batch` finds it done."""
    ended = [scene for scene in SCENES
             if any(os.path.exists(os.path.join(RESULTS, scene, file)) for file in ("report.json", "failure.txt"))]
    folders = [os.path.join(config["scenes"], scene) for scene in ended]
    if folders:
        # Nothing is computed, so whatever the runs needed, it fits. It takes a second or two per scene.
        shell("{CGS:q} batch {folders:q} {OPTIONS} --memory-limit 1000G -o {RESULTS:q}")
