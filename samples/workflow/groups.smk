# SPDX-License-Identifier: GPL-3.0-or-later
# A large scene, as "A facade of hundreds" in docs/photographs.md has it by hand: its photographs are cut into
# groups, a job trains each, and what they measured becomes one volume and its meshes. Ends with mesh/ or with
# groups/failure.txt or, of a group, groups/NAME/failure.txt, which says why not.

LARGE = config["large"]
if not os.path.isdir(LARGE):
    raise WorkflowError(f"{LARGE} is no folder; say where the large scene is: --config large=FOLDER")
VOLUME = os.path.join(config["output"], "all.vdb")
VOXEL = "" if config["voxel"] in ("", None) else f"--voxel-size {shlex.quote(str(config['voxel']))} "

# Which of `options` these commands take. Training is given all but those of fuse and mesh: it refuses what it
# does not know.
TAKEN = {
    "split": ("--allow-external", "--chunk", "--depth", "--depth-kind", "--depth-scale", "--focal", "--lenses",
              "--old-photographs", "--refine-poses"),
    "fuse": ("--estimated",),
    "mesh": ("--simplify",),
}


def options_of(command):
    options = []  # each with its values, which may be numbers below 0
    for word in shlex.split(OPTIONS):
        if not options or re.match("--?[a-z]", word):
            options.append([])
        options[-1].append(word)

    def is_taken(option):
        name = option[0].split("=")[0]
        if command == "train":
            return name not in TAKEN["fuse"] + TAKEN["mesh"]
        return name in TAKEN[command]
    return shlex.join(word for option in options if is_taken(option) for word in option)


def of_groups(*path):
    """A file of each group, once it is known which there are."""
    def files(wildcards):
        with open(checkpoints.split.get().output[0], encoding="utf-8") as file:
            groups = json.load(file)["groups"]
        return [os.path.join(*path).format(group=group["name"]) for group in groups]
    return files


wildcard_constraints:
    group="group_[0-9]+"


# Models of groups that were cut in another way are of no use, and would not be replaced.
checkpoint split:
    input:
        folders_of(LARGE)
    output:
        os.path.join(GROUPS, "groups.json")
    log:
        os.path.join(JOBS, "groups", "split.log")
    benchmark:
        os.path.join(JOBS, "groups", "split.tsv")
    params:
        options=options_of("split"),
        size=config["size"],
        folder=GROUPS,
        attempts=os.path.join(JOBS, "groups", "split.attempts"),
    threads: config["threads"]
    resources:
        mem_mb=lambda wildcards, attempt: 1000 * attempt,
        minutes=lambda wildcards, attempt: config["minutes"] * attempt,
    shell:
        says_why("rm -rf {params.folder:q}/group_* && {CGS:q} split {LARGE:q} {params.options} --size {params.size} "
                 "--threads {threads} -o {params.folder:q}")


# Of a run, which does more than train: it makes a volume and its meshes of the group's photographs, too. Where
# voxels are chosen, the volume of all groups has no more of them.
rule plan_group:
    input:
        os.path.join(GROUPS, "groups.json")
    output:
        os.path.join(JOBS, "groups", "{group}.plan.json")
    log:
        os.path.join(JOBS, "groups", "{group}.plan.log")
    benchmark:
        os.path.join(JOBS, "groups", "{group}.plan.tsv")
    params:
        scene=LARGE,
        options=lambda wildcards: '--views "$(cat {})" {}'.format(
            shlex.quote(os.path.join(GROUPS, wildcards.group, "views.txt")), options_of("train")),
        tool=PLAN,
        folder=os.path.join(GROUPS, "{group}"),
    threads: config["threads"]
    resources:
        mem_mb=lambda wildcards, attempt: 1000 * attempt,
        minutes=lambda wildcards, attempt: config["minutes"] * attempt,
    shell:
        PLANS


# All three files: it takes a folder with one of them, but no checkpoint, for a model that is not to be replaced.
rule train:
    input:
        plan=os.path.join(JOBS, "groups", "{group}.plan.json")
    output:
        [os.path.join(GROUPS, "{group}", "model", file) for file in ("training.json", "cameras.json", "gaussians.ply")]
    log:
        os.path.join(JOBS, "groups", "{group}.log")
    benchmark:
        os.path.join(JOBS, "groups", "{group}.run.tsv")
    params:
        options=options_of("train"),
        folder=os.path.join(GROUPS, "{group}"),
        attempts=os.path.join(JOBS, "groups", "{group}.attempts"),
    threads: config["threads"]
    resources:
        mem_mb=of_plan("mem_mb"),
        minutes=of_plan("minutes"),
    shell:
        says_why('{CGS:q} train {LARGE:q} --views "$(cat {params.folder:q}/views.txt)" {params.options} '
                 "--threads {threads} " + MEMORY_LIMIT + " -o {params.folder:q}/model")


rule fuse:
    input:
        plan=of_groups(JOBS, "groups", "{group}.plan.json"),
        models=of_groups(GROUPS, "{group}", "model", "training.json"),
    output:
        VOLUME
    log:
        os.path.join(JOBS, "groups", "fuse.log")
    benchmark:
        os.path.join(JOBS, "groups", "fuse.tsv")
    params:
        models=lambda wildcards, input: [os.path.dirname(file) for file in input.models],
        options=VOXEL + options_of("fuse"),
        folder=GROUPS,
        attempts=os.path.join(JOBS, "groups", "fuse.attempts"),
    threads: config["threads"]
    resources:
        mem_mb=of_plan("mem_mb"),
        minutes=of_plan("minutes"),
    shell:
        says_why("{CGS:q} fuse {params.models:q} {params.options} --threads {threads} "
                 + MEMORY_LIMIT + " -o {output:q}")


rule mesh:
    input:
        plan=of_groups(JOBS, "groups", "{group}.plan.json"),
        volume=VOLUME,
    output:
        directory(MESH)
    log:
        os.path.join(JOBS, "groups", "mesh.log")
    benchmark:
        os.path.join(JOBS, "groups", "mesh.tsv")
    params:
        options=options_of("mesh"),
        folder=GROUPS,
        attempts=os.path.join(JOBS, "groups", "mesh.attempts"),
    threads: config["threads"]
    resources:
        mem_mb=of_plan("mem_mb"),
        minutes=of_plan("minutes"),
    shell:
        says_why("{CGS:q} mesh {input.volume:q} {params.options} --threads {threads} "
                 + MEMORY_LIMIT + " -o {output:q}")
