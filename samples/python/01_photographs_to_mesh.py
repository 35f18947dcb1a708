# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs to a closed mesh, and its volume with what it rests on.

usage: 01_photographs_to_mesh.py SCENE VIEWS OUT.ply
"""
import sys

import cgs


def main(scene_folder: str, views: str, output: str) -> None:
    scene = cgs.read_scene(scene_folder, views=views, assume_unit="m")
    model = cgs.reconstruct(
        scene, preset="draft", progress=lambda stage, done: print(f"\r{stage} {done:.0%}", end="")
    )
    print()
    for line in model.coverage:
        print(line)
    model.fuse().watertight().save(output)
    mesh = cgs.read_mesh(output)  # as others will measure it
    volume = mesh.measure(volume=True)["volume"]
    print(f"volume {volume['value']} +- {volume['sigma']} {volume['unit']}")
    assert mesh.provenance is not None
    for label, name in enumerate(cgs.PROVENANCE):
        print(f"{(mesh.provenance == label).mean():.1%} of the faces: {name}")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
