# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a depth sensor, as arrays from wherever they come, to a volume and the surface in it.

usage: 02_depth_frames_to_mesh.py SCENE OUT.vdb OUT.ply
"""
import sys

import cgs

SENSOR_SIGMA = 0.005  # of the depth: what a structured-light sensor is off by


def main(scene_folder: str, volume_file: str, mesh_file: str) -> None:
    scene = cgs.read_scene(scene_folder, all_views=True, depth_kind="metric", assume_unit="m")
    scene.load()
    frames = [scene.views[i] for i in scene.input]
    depths = [frame.depth for frame in frames if frame.depth is not None]
    volume = cgs.fuse(
        [frame.camera for frame in frames],
        depths,
        colors=[frame.image for frame in frames if frame.image is not None],
        sigmas=[SENSOR_SIGMA * depth for depth in depths],
        metres_per_unit=1,
    )
    volume.save(volume_file)
    mesh = volume.surface()
    mesh.save(mesh_file)
    print(f"{len(frames)} frames, voxels of {volume.voxel_size} m, {len(mesh.faces)} faces")
    # The arrays are those that trimesh and Open3D take:
    #   trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_colors=mesh.colors)
    #   open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(mesh.vertices),
    #                                open3d.utility.Vector3iVector(mesh.faces.astype("int32")))
    # and back: cgs.Mesh(other.vertices, other.faces)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
