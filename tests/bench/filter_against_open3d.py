#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints a table of the operations of `cgs filter` beside Open3D's, on the same files.

usage: filter_against_open3d.py build/release/bin/filter_bench

Best of three runs each, fewer where they take more than half a minute. Without Open3D (python3-open3d) its columns stay empty, and that is said.
"""
import os
import subprocess
import sys
import tempfile
import time

# Open3D's threads would spin while they wait, which counts as work.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
os.environ.setdefault("OMP_NUM_THREADS", str(os.cpu_count()))

DIAGONAL = 3.4


def timed(work):
    wall, cpu = 1e300, 1e300
    begin = time.time()
    for _ in range(3):
        start, cpu_start = time.time(), time.process_time()
        result = work()
        cpu = min(cpu, time.process_time() - cpu_start)
        wall = min(wall, time.time() - start)
        if time.time() - begin > 30:
            break
    return wall, cpu, result


def kept(indices, count):
    outliers = sum(1 for i in indices if i < count // 50)
    return f"{outliers} outliers missed, {count - count // 50 - (len(indices) - outliers)} others dropped"


def open3d_rows(folder):
    """Name of our row -> (work, what came out)."""
    import numpy as np
    import open3d as o3d

    cloud = o3d.io.read_point_cloud(os.path.join(folder, "cloud.ply"))
    mesh = o3d.io.read_triangle_mesh(os.path.join(folder, "mesh.ply"))
    count = len(cloud.points)

    def simplification():
        out = mesh.simplify_quadric_decimation(100_000)
        return f"{len(out.triangles)} faces"

    def normals():
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30))
        return f"{len(cloud.normals)} normals"

    def taubin():
        return f"{len(mesh.filter_smooth_taubin(10).triangles)} faces"

    def clusters():
        return f"{1 + np.asarray(cloud.cluster_dbscan(DIAGONAL / 280, 10)).max()} clusters"

    return {
        "statistical outliers 1M (20, 2)": lambda: kept(cloud.remove_statistical_outlier(20, 2.0)[1], count),
        "radius outliers 1M (16, diagonal/200)": lambda: kept(
            cloud.remove_radius_outlier(16, DIAGONAL / 200)[1], count),
        "normals 1M (30 neighbours)": normals,
        "voxel down-sampling 1M (diagonal/200)": lambda: f"{len(cloud.voxel_down_sample(DIAGONAL / 200).points)} points",
        "DBSCAN 1M (diagonal/280, 10)": clusters,
        "Taubin 1M triangles, 10 times": taubin,
        "simplification 1M to 100k": simplification,
    }


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        ours = subprocess.run([sys.argv[1], folder], check=True, capture_output=True, text=True).stdout
        try:
            theirs = open3d_rows(folder)
        except ImportError as error:
            print(f"SKIPPED: the comparison with Open3D ({error}); only our times follow")
            theirs = {}
        print(f"{'operation':40} {'ours wall':>10} {'ours CPU':>10} {'o3d wall':>10} {'o3d CPU':>10} {'CPU ratio':>10}")
        for line in ours.splitlines():
            if line.startswith("#"):
                print(line)
                continue
            name, wall, cpu, result = line.split("\t")
            row = f"{name:40} {float(wall):10.2f} {float(cpu):10.2f}"
            if name in theirs:
                o3d_wall, o3d_cpu, o3d_result = timed(theirs[name])
                row += f" {o3d_wall:10.2f} {o3d_cpu:10.2f} {o3d_cpu / float(cpu):9.1f}x"
                result += f" | {o3d_result}"
            print(f"{row}   {result}", flush=True)


if __name__ == "__main__":
    main()
