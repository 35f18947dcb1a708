# SPDX-License-Identifier: GPL-3.0-or-later
"""A film of a model: from one input view to the next, what no photograph saw in magenta.

usage: 05_render_path.py MODEL OUT_FOLDER
"""
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import cgs

FRAMES = 5  # from one view to the next


def between(a: cgs.Camera, b: cgs.Camera, t: float) -> cgs.Camera:
    """The camera a part of the way from a to b, turned as far."""
    pose = a.world_from_cam
    pose[:3, 3] += t * (b.world_from_cam[:3, 3] - pose[:3, 3])
    u, _, v = np.linalg.svd((1 - t) * pose[:3, :3] + t * b.world_from_cam[:3, :3])
    pose[:3, :3] = u @ v
    return cgs.Camera(a.width, a.height, a.fx, a.fy, a.cx, a.cy, pose)


def main(model_folder: str, output: str) -> None:
    model = cgs.read_model(model_folder)
    cameras = [model.cameras[name] for name in model.input]
    Path(output).mkdir(parents=True, exist_ok=True)
    count = 0
    for a, b in zip(cameras, cameras[1:]):
        for t in np.linspace(0, 1, FRAMES, endpoint=False):
            picture = model.render(between(a, b, float(t)))
            pixels = picture.color.copy()
            if picture.is_hole is not None:
                pixels[picture.is_hole] = (1, 0, 1)
            Image.fromarray((255 * pixels + 0.5).astype("uint8")).save(
                Path(output) / f"frame_{count:04}.png"
            )
            count += 1
    print(f"{count} frames")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
