# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth that a network guessed, an array per photograph, goes in beside what is measured.

usage: 03_network_depth.py SCENE VIEWS DEPTH_FOLDER OUT_MODEL

DEPTH_FOLDER holds VIEW.npy of the size of the photograph: inverse depth up to scale and offset.
"""
import sys
from pathlib import Path

import numpy as np

import cgs


def main(scene_folder: str, views: str, depth_folder: str, output: str) -> None:
    scene = cgs.read_scene(scene_folder, views=views)
    scene.load()
    scene.depth_kind = "disparity"
    for i in scene.input:
        view = scene.views[i]
        view.depth = np.load(Path(depth_folder) / f"{view.name}.npy")
    model = cgs.reconstruct(scene, preset="draft")
    model.save(output, overwrite=True)  # where a finished model is, too
    for name in model.input:
        origin = model.input_depth(name)["origin"]
        shares = [f"{(origin == k).mean():.0%} {kind}" for k, kind in enumerate(cgs.DEPTH_ORIGIN)]
        print(f"{name}: {', '.join(shares)}")


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
