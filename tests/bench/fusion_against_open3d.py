#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints a table of our fusion of depth frames beside Open3D's, on the same frames.

usage: fusion_against_open3d.py build/release/bin/fusion_bench MESH

60 frames of 640 x 480 pixels are cast from MESH (the armadillo, say) on a ring around it and fused with voxels of a 400th of its diagonal.
Every program runs in a process of its own, three times, of which the quickest counts. Accuracy is the mean distance of the surface from
MESH, completeness that of MESH from the surface, both as shares of the diagonal. Without Open3D (python3-open3d) its rows are left out, and
that is said.
"""
import os
import resource
import subprocess
import sys
import tempfile
import time

# Open3D's threads would spin while they wait, which counts as work.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

FRAMES, WIDTH, HEIGHT = 60, 640, 480
VOXEL = 1 / 400
TRUNCATION = 4 * VOXEL


def frames(folder):
    import numpy as np

    depth = np.fromfile(os.path.join(folder, "depth.bin"), np.float32).reshape(FRAMES, HEIGHT, WIDTH)
    numbers = np.array(open(os.path.join(folder, "cameras.txt")).read().split(), float).reshape(FRAMES, 20)
    return depth, numbers[0, :4], numbers[:, 4:].reshape(FRAMES, 4, 4)


def timed(work):
    wall, cpu = time.time(), time.process_time()
    result = work()
    return result, time.time() - wall, time.process_time() - cpu


def scalable(folder):
    import open3d as o3d

    depth, (fx, fy, cx, cy), poses = frames(folder)
    # Its pixel centres are whole numbers.
    camera = o3d.camera.PinholeCameraIntrinsic(WIDTH, HEIGHT, fx, fy, cx - 0.5, cy - 0.5)
    volume = o3d.pipelines.integration.ScalableTSDFVolume(
        VOXEL, TRUNCATION, o3d.pipelines.integration.TSDFVolumeColorType.NoColor)
    color = o3d.geometry.Image((depth[0] * 0).astype("uint8"))

    def integrate():
        for image, pose in zip(depth, poses):
            rgbd = o3d.geometry.RGBDImage.create_from_color_and_depth(
                color, o3d.geometry.Image(image), 1.0, 1000.0, False)
            volume.integrate(rgbd, camera, pose)

    _, *fusing = timed(integrate)
    mesh, *extracting = timed(volume.extract_triangle_mesh)
    return fusing, extracting, mesh


def blocks(folder):
    import open3d as o3d

    depth, (fx, fy, cx, cy), poses = frames(folder)
    device = o3d.core.Device("CPU:0")
    grid = o3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight"), (o3d.core.float32, o3d.core.float32), ((1), (1)), VOXEL, 16, 3000, device)
    camera = o3d.core.Tensor([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]], o3d.core.float64)

    def integrate():
        for image, pose in zip(depth, poses):
            picture = o3d.t.geometry.Image(o3d.core.Tensor(image[..., None]))
            extrinsic = o3d.core.Tensor(pose)
            found = grid.compute_unique_block_coordinates(picture, camera, extrinsic, 1.0, 1000.0, 4.0)
            grid.integrate(found, picture, camera, extrinsic, 1.0, 1000.0, 4.0)

    _, *fusing = timed(integrate)
    # What one frame saw is surface, as in the others.
    mesh, *extracting = timed(lambda: grid.extract_triangle_mesh(weight_threshold=1.0))
    return fusing, extracting, mesh.to_legacy()


def open3d_row(name, folder):
    import open3d as o3d

    fusing, extracting, mesh = {"scalable": scalable, "blocks": blocks}[name](folder)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
    o3d.io.write_triangle_mesh(os.path.join(folder, "open3d.ply"), mesh)
    print(*fusing, *extracting, peak, len(mesh.triangles), "", sep="\t")


def row(name, command, surface, judge):
    runs = [subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip("\n").split("\t")
            for _ in range(3)]
    best = min(runs, key=lambda run: float(run[1]))
    wall, cpu, surface_wall, surface_cpu = (float(field) for field in best[:4])
    accuracy, completeness, parts = subprocess.run(
        [*judge, surface], check=True, capture_output=True, text=True).stdout.split()
    print(f"{name:28} {1000 * cpu / FRAMES:9.1f} {1000 * wall / FRAMES:9.1f} {surface_cpu:9.2f} {surface_wall:9.2f} "
          f"{max(int(run[4]) for run in runs):7} {int(best[5]):9} {float(accuracy):9.1e} {float(completeness):9.1e} "
          f"{parts:>6}   {best[6]}", flush=True)


def main():
    if len(sys.argv) == 4 and sys.argv[1] == "open3d":
        return open3d_row(*sys.argv[2:])
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    bench, mesh = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([bench, "frames", mesh, folder], check=True)
        print(f"{'':28} {'CPU':>9} {'wall':>9} {'CPU':>9} {'wall':>9} {'memory':>7} {'':9} {'':9} {'complete-':>9}")
        print(f"{'':28} {'ms/frame':>9} {'ms/frame':>9} {'surface s':>9} {'surface s':>9} {'MiB':>7} {'faces':>9} "
              f"{'accuracy':>9} {'ness':>9} {'parts':>6}")
        judge = [bench, "judge", mesh]
        ours = os.path.join(folder, "ours.ply")
        for name, mib in [("ours", 256), ("ours, a frame at a time", 1)]:
            row(name, [bench, "fuse", folder, str(VOXEL), str(mib)], ours, judge)
        try:
            import open3d  # noqa: F401
        except ImportError as error:
            print(f"SKIPPED: the comparison with Open3D ({error})")
            return
        for name, kind in [("Open3D ScalableTSDFVolume", "scalable"), ("Open3D VoxelBlockGrid", "blocks")]:
            row(name, [sys.executable, __file__, "open3d", kind, folder], os.path.join(folder, "open3d.ply"), judge)


if __name__ == "__main__":
    main()
