#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python module against the program, against truth that is computed here, and as one uses it.

usage: module_test.py PROGRAM CAPTURE WORK_FOLDER     (PYTHONPATH has the module)
"""
import gc
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
import unittest
import warnings
from pathlib import Path

import numpy as np
from PIL import Image

import cgs

PROGRAM, CAPTURE, WORK = sys.argv[1:4]
VIEWS = "view_01,view_02,view_03"


def program(*words):
    """What a command prints as JSON."""
    done = subprocess.run([PROGRAM, *map(str, words), "--json"], check=True, capture_output=True)
    return json.loads(done.stdout)


def ball_depth(camera, radius=1.0):
    """Depth of a ball around (0, 0, 0), row by row."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width] + 0.5
    rays = np.stack(
        [(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones_like(u)], axis=-1
    )
    pose = camera.world_from_cam
    rays = rays @ pose[:3, :3].T
    a = (rays**2).sum(-1)
    b = rays @ pose[:3, 3]
    inside = b**2 - a * (pose[:3, 3] @ pose[:3, 3] - radius**2)
    with np.errstate(invalid="ignore"):
        return np.where(inside >= 0, (-b - np.sqrt(inside)) / a, np.inf)


def looking_at_zero(direction, up=(0, 1, 0), distance=4.0):
    z = -np.asarray(direction, float)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    pose[:3, 3] = -distance * z
    return cgs.Camera(128, 128, 150, 150, 64, 64, pose)


def six_cameras():
    out = []
    for axis in range(3):
        for sign in (-1, 1):
            direction = np.zeros(3)
            direction[axis] = sign
            out.append(looking_at_zero(direction, up=(0, 1, 0) if axis != 1 else (1, 0, 0)))
    return out


class Reconstruction(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = cgs.read_scene(CAPTURE, views=VIEWS, assume_unit="m")
        cls.model = cgs.reconstruct(cls.scene, preset="draft", settings={"steps": 4})
        cls.folder = Path(WORK) / "trained"
        program("train", CAPTURE, "--views", VIEWS, "--assume-unit", "m", "--preset", "draft",
                "--set", "steps=4", "-o", cls.folder)  # fmt: skip

    def test_gives_the_bits_of_the_program(self):
        saved = Path(WORK) / "saved"
        self.model.save(saved)
        splats = "gaussians.ply"
        self.assertEqual((saved / splats).read_bytes(), (self.folder / splats).read_bytes())
        with self.assertRaisesRegex(cgs.InvalidInput, "holds a finished model; .*say overwrite=True"):
            self.model.save(saved)
        self.model.save(saved, overwrite=True)
        again = cgs.read_model(self.folder)
        self.assertEqual(again.input, ["view_01", "view_02", "view_03"])
        np.testing.assert_allclose(again.splats.positions, self.model.splats.positions, rtol=1e-6)

    def test_fuses_and_closes_as_the_program(self):
        volume, meshes = Path(WORK) / "v.vdb", Path(WORK) / "meshes"
        program("fuse", self.folder, "-o", volume)
        program("mesh", volume, "--simplify", "0", "-o", meshes)
        mesh = cgs.read_model(self.folder).fuse().watertight()
        mesh.save(Path(WORK) / "closed.ply")
        closed = meshes / "watertight.ply"
        self.assertEqual((Path(WORK) / "closed.ply").read_bytes(), closed.read_bytes())
        # Files of splats round their colours.
        unsaved = self.model.fuse().watertight()
        np.testing.assert_array_equal(unsaved.vertices, mesh.vertices)
        np.testing.assert_array_equal(unsaved.faces, mesh.faces)
        np.testing.assert_allclose(unsaved.colors, mesh.colors, atol=1e-6)
        self.assertTrue(mesh.certificate()["passed"])
        figures = cgs.read_mesh(closed).measure(volume=True, distance=((0, 0, 4), (1, 0, 4)))
        told = program("measure", closed, "--volume", "--distance", "0,0,4", "1,0,4")["figures"]
        self.assertEqual(figures, told)

    def test_fuses_several_models_as_the_program(self):
        other = Path(WORK) / "other"
        program("train", CAPTURE, "--views", "view_02,view_04", "--assume-unit", "m", "--preset",
                "draft", "--set", "steps=0", "-o", other)  # fmt: skip
        joined = Path(WORK) / "joined.vdb"
        program("fuse", self.folder, other, "-o", joined)
        models = [cgs.read_model(folder) for folder in (self.folder, other)]
        mesh = cgs.fuse_models(models).surface()
        told = cgs.read_volume(joined).surface()
        np.testing.assert_array_equal(mesh.vertices, told.vertices)
        np.testing.assert_array_equal(mesh.faces, told.faces)
        with self.assertRaises(cgs.InvalidInput):
            cgs.fuse_models([])
        with self.assertRaisesRegex(cgs.InvalidInput, "number 1, but is None"):
            cgs.fuse_models([self.model, None])

    def test_takes_photographs_as_the_program(self):
        scene = cgs.read_scene(CAPTURE, views=VIEWS, old_photographs=True, refine_poses=True)
        model = cgs.reconstruct(scene, preset="draft", settings={"steps": 0})
        saved, folder = Path(WORK) / "old_saved", Path(WORK) / "old"
        model.save(saved)
        program("train", CAPTURE, "--views", VIEWS, "--old-photographs", "--refine-poses", "--preset",
                "draft", "--set", "steps=0", "-o", folder)  # fmt: skip
        splats = "gaussians.ply"
        self.assertEqual((saved / splats).read_bytes(), (folder / splats).read_bytes())
        plain = cgs.reconstruct(self.scene, preset="draft", settings={"steps": 0})
        self.assertFalse(np.array_equal(plain.splats.positions, model.splats.positions))
        with self.assertRaisesRegex(cgs.InvalidInput, "without cameras"):
            cgs.read_scene(CAPTURE, each_lens=True)

    def test_loads_all_that_depth_files_state(self):
        places = []
        for name, is_loaded in (("d.png", False), ("d.png", True), ("d.npy", False)):
            folder = Path(WORK) / f"depth_{name[2:]}_{is_loaded}"
            shutil.copytree(CAPTURE, folder)
            (folder / "depth").mkdir()
            for view in self.model.input:
                depth = 1000 * self.model.input_depth(view)["depth"]
                file = folder / "depth" / (view + name[1:])
                if name.endswith("png"):  # 16 bits: whole millimetres
                    Image.fromarray(np.nan_to_num(depth, posinf=0).astype(np.uint16)).save(file)
                else:
                    np.save(file, np.nan_to_num(depth / 1000, posinf=0))
            scene = cgs.read_scene(folder, views=VIEWS)
            if is_loaded:
                scene.load()
            model = cgs.reconstruct(scene, preset="draft", settings={"steps": 0})
            places.append(model.splats.positions)
        np.testing.assert_array_equal(places[0], places[1])
        self.assertFalse(np.array_equal(places[0], places[2]))  # which states no unit

    def test_medium_is_one_that_is_known(self):
        with self.assertRaisesRegex(cgs.InvalidInput, "none or water"):
            cgs.reconstruct(self.scene, medium="mist")

    def test_renders_what_the_program_writes(self):
        name = self.model.held_out[0]
        picture = self.model.render(self.model.cameras[name])
        height, width = picture.alpha.shape
        self.assertEqual(picture.color.shape, (height, width, 3))
        self.assertEqual(picture.normal.shape, (height, width, 3))
        told = program("render", self.folder, "--views", name, "-o", Path(WORK) / "views")
        self.assertAlmostEqual(picture.is_hole.mean(), told[0]["hole_fraction"], places=12)
        self.assertTrue(set(np.unique(picture.hole)) <= set(range(len(cgs.HOLE))))
        seen = ~picture.is_hole & np.isfinite(picture.depth)
        self.assertTrue((picture.depth[seen] > 0).all())

    def test_tells_what_input_views_know(self):
        known = self.model.input_depth("view_02")
        measured = known["origin"] == cgs.DEPTH_ORIGIN.index("measured")
        self.assertGreater(measured.mean(), 0.5)
        self.assertTrue(np.isfinite(known["sigma"][measured]).all())
        with self.assertRaises(cgs.InvalidInput):
            self.model.input_depth(self.model.held_out[0])

    def test_evaluates_as_the_program(self):
        told = program("evaluate", self.folder)
        self.assertEqual(cgs.read_model(self.folder).evaluate()["mean"], told["mean"])

    def test_is_evaluated_by_several_threads_at_once(self):
        model = cgs.read_model(self.folder)
        alone = model.evaluate()
        told = [None] * 4

        def evaluate(i):
            told[i] = model.evaluate()

        threads = [threading.Thread(target=evaluate, args=(i,)) for i in range(len(told))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(told, [alone] * len(told))

    def test_takes_pictures_from_arrays(self):
        scene = cgs.read_scene(CAPTURE, views=VIEWS)
        scene.load()
        for i in scene.input:
            scene.views[i].image = scene.views[i].image[:, :, ::-1]  # blue for red
        model = cgs.reconstruct(scene, settings={"steps": 0})
        of_file = self.model.render(self.model.cameras["view_02"]).color.mean((0, 1))
        of_array = model.render(model.cameras["view_02"]).color.mean((0, 1))
        np.testing.assert_allclose(of_array, of_file[::-1], atol=0.02)


class LongWork(unittest.TestCase):
    def work(self, progress=None):
        scene = cgs.read_scene(CAPTURE, views=VIEWS)
        return cgs.reconstruct(scene, settings={"steps": 100000}, progress=progress)

    def test_stops_at_control_c(self):
        sent = []

        def interrupt():
            sent.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

        timer = threading.Timer(2, interrupt)
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            self.work()
        self.assertLess(time.monotonic() - sent[0], 3)  # a second on a machine that does no more

    def test_lets_other_threads_run(self):
        count = calls = 0

        def stop_after_many(stage, done):
            nonlocal calls
            calls += 1
            if count > 50:
                raise StopIteration

        is_done = threading.Event()

        def others():
            nonlocal count
            while not is_done.wait(0.01):
                count += 1

        thread = threading.Thread(target=others)
        thread.start()
        with self.assertRaises(StopIteration):
            self.work(stop_after_many)
        is_done.set()
        thread.join()
        self.assertGreater(count, 50)
        # While a callback runs others may run, too, which is no sign that the work let them.
        self.assertGreater(count, 2 * calls)

    def test_tells_how_far_it_is(self):
        told = []

        def listen(stage, done):
            told.append((stage, done))
            if done > 0.21:
                raise StopIteration

        with self.assertRaises(StopIteration):
            self.work(listen)
        self.assertEqual({stage for stage, _ in told}, {"depth and Gaussians"})
        self.assertEqual([done for _, done in told], sorted(done for _, done in told))


class Arrays(unittest.TestCase):
    def test_are_views_that_live_on(self):
        mesh = cgs.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        self.assertIsNone(mesh.colors)
        mesh.colors = np.full((3, 3), 0.5)
        mesh.colors[1] = (1, 0, 0)
        self.assertEqual(mesh.colors[1].tolist(), [1, 0, 0])
        self.assertTrue(np.shares_memory(mesh.faces, mesh.faces))
        faces = mesh.faces
        del mesh
        gc.collect()
        self.assertEqual(faces.tolist(), [[0, 1, 2]])

    def test_of_replaced_arrays_live_on(self):
        mesh = cgs.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        mesh.colors = np.full((3, 3), 0.5)
        colors = mesh.colors
        mesh.colors = np.full((3, 3), 0.25)
        np.testing.assert_array_equal(colors, mesh.colors)  # memory that is still there
        scene = cgs.read_scene(CAPTURE, views=VIEWS)
        scene.load()
        view = scene.views[scene.input[0]]
        image = view.image
        before = image.copy()
        view.image = 1 - image
        np.testing.assert_allclose(image, 1 - before, atol=1e-6)
        scene.load()
        np.testing.assert_array_equal(image, before)
        with self.assertRaisesRegex(ValueError, "read-only"):
            mesh.faces[0, 0] = 7

    def test_keep_all_digits_far_from_zero(self):
        corner = np.array([4.5e5, 5.4e6, 300])  # a survey's coordinates
        points = corner + np.array([[0, 0, 0], [0.125, 0, 0], [0, 0.125, 0]])
        np.testing.assert_array_equal(cgs.Mesh(points, [[0, 1, 2]]).vertices, points)

    def test_that_do_not_fit_are_refused(self):
        with self.assertRaisesRegex(cgs.InvalidInput, r"vertices must have the shape \(N, 3\)"):
            cgs.Mesh(np.zeros((3, 2)))
        with self.assertRaisesRegex(cgs.InvalidInput, "below 3, but is 3"):
            cgs.Mesh(np.eye(3), [[0, 1, 3]])
        for wrong, why in (
            ([[0, 1, 2**32 + 2]], "below 3, but is 4294967298"),
            ([[0, 1, -1]], "below 3, but is -1"),
            ([[0, 1, 2.9]], "must be integers, but is float64"),
            ("faces", "must be integers"),
        ):
            with self.assertRaisesRegex(cgs.InvalidInput, why):
                cgs.Mesh(np.eye(3), wrong)
        for wrong, why in (([258], "below 6, but is 258"), ([2.9], "integers"), ([1, 1], "1 rows")):
            with self.assertRaisesRegex(cgs.InvalidInput, why):
                cgs.Mesh(np.eye(3), [[0, 1, 2]], provenance=wrong)
        for faces in ([[0, 1, 2]], np.array([[0, 1, 2]], np.uint8), np.array([[0, 1, 2]], np.uint64)):
            mesh = cgs.Mesh(np.eye(3), faces, provenance=[2])
            self.assertEqual((mesh.faces.tolist(), mesh.provenance.tolist()), ([[0, 1, 2]], [2]))
        self.assertEqual(len(cgs.Mesh(np.eye(3), np.empty((0, 3))).faces), 0)
        with self.assertRaisesRegex(cgs.InvalidInput, "finite"):
            cgs.Mesh([[0, 0, np.nan]])
        scene = cgs.read_scene(CAPTURE, views=VIEWS)
        for wrong in ([0, -1], [0, 10000], [1, 1]):
            with self.assertRaises(cgs.InvalidInput):
                scene.input = wrong
        held_out = scene.held_out
        scene.input = [*scene.input, held_out[0]]
        self.assertEqual(scene.held_out, held_out[1:])
        for kind in ("metric", "depth", "disparity", "auto"):
            scene.depth_kind = kind
            self.assertEqual(scene.depth_kind, kind)
        camera = cgs.Camera(4, 3, 2, 2, 2, 1.5)
        with self.assertRaisesRegex(cgs.InvalidInput, r"\(3, 4\) of its camera, but is \(4, 3\)"):
            cgs.fuse([camera], [np.ones((4, 3))])
        with self.assertRaisesRegex(cgs.InvalidInput, "a rotation"):
            camera.world_from_cam = 2 * np.eye(4)

    def test_that_were_checked_cannot_be_changed(self):
        mesh = cgs.Mesh(np.eye(3), [[0, 1, 2]], provenance=[2])
        with self.assertRaisesRegex(ValueError, "read-only"):
            mesh.provenance[0] = 200

    def test_and_numbers_that_are_not_finite_are_refused(self):
        for unit in (np.inf, np.nan, -1):
            with self.assertRaisesRegex(cgs.InvalidInput, "metres_per_unit"):
                cgs.Mesh(np.eye(3), [[0, 1, 2]], metres_per_unit=unit)
        with self.assertRaisesRegex(cgs.InvalidInput, "principal point"):
            cgs.Camera(4, 3, 2, 2, np.nan, 1.5)
        with self.assertRaisesRegex(cgs.InvalidInput, "focal lengths"):
            cgs.Camera(4, 3, 2, np.inf, 2, 1.5)
        right = {"positions": [0, 0, 4], "scales": [1, 1, 1], "rotations": [1, 0, 0, 0],
                 "opacities": 0.5, "sh": [[1, 0, -1]]}  # fmt: skip
        for name, wrong in (
            ("positions", [0, 0, np.inf]),
            ("scales", [1, 1, -1]),
            ("scales", [0, 0, 0]),
            ("rotations", [0, 0, 0, 0]),
            ("opacities", 2),
            ("sh", [[np.nan, 0, 0]]),
        ):
            with self.assertRaisesRegex(cgs.InvalidInput, name):
                cgs.Splats(**{key: [value] for key, value in (right | {name: wrong}).items()})
        splats = cgs.Splats(**{key: [value] for key, value in right.items()})
        camera = cgs.Camera(4, 3, 2, 2, 2, 1.5)
        camera.cx = np.nan
        with self.assertRaisesRegex(cgs.InvalidInput, "principal point"):
            splats.render(camera)


class Volumes(unittest.TestCase):
    def test_of_a_ball_have_its_size(self):
        cameras = six_cameras()
        volume = cgs.fuse(
            cameras, [ball_depth(c) for c in cameras], voxel_size=0.02, metres_per_unit=0.001
        )
        ball = volume.watertight()
        radii = np.linalg.norm(ball.vertices, axis=1)
        self.assertLess(np.abs(radii - 1).max(), 0.02)
        figure = ball.measure(volume=True, unit="mm")["volume"]
        self.assertEqual(figure["unit"], "mm^3")
        self.assertAlmostEqual(figure["value"], 4 / 3 * np.pi, delta=0.02)
        volume.save(Path(WORK) / "ball.vdb")
        again = cgs.read_volume(Path(WORK) / "ball.vdb")
        self.assertEqual(again.voxel_size, volume.voxel_size)
        np.testing.assert_array_equal(again.watertight().vertices, ball.vertices)


class Meshes(unittest.TestCase):
    def test_are_filtered_as_by_the_program(self):
        cameras = six_cameras()
        scan = cgs.fuse(cameras, [ball_depth(c) for c in cameras], voxel_size=0.1).surface()
        file, out = Path(WORK) / "scan.ply", Path(WORK) / "filtered.ply"
        scan.save(file)
        operations = ["largest=1", "taubin=5", "simplify=0.01"]
        program("filter", file, out, *(w for op in operations for w in ("--op", op)))
        cgs.read_mesh(file).filter(*operations).save(Path(WORK) / "ours.ply")
        self.assertEqual((Path(WORK) / "ours.ply").read_bytes(), out.read_bytes())

    def test_are_compared_with_signs(self):
        def square(z):
            return cgs.Mesh([[0, 0, z], [1, 0, z], [1, 1, z], [0, 1, z]], [[0, 1, 2], [0, 2, 3]])

        distance = square(0.25).compare(square(0))["distance"]
        np.testing.assert_allclose(distance, 0.25)
        np.testing.assert_allclose(square(-0.25).compare(square(0))["distance"], -0.25)
        points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        with_unit = cgs.Mesh(points, [[0, 1, 2]], metres_per_unit=1)
        with self.assertRaisesRegex(cgs.InvalidInput, "how long a unit"):
            with_unit.compare(square(0))


@unittest.skipUnless(importlib.util.find_spec("open3d"), "Open3D is not installed")
class ExchangeWithOpen3d(unittest.TestCase):
    """As samples/python/02_depth_frames_to_mesh.py says."""

    @classmethod
    def setUpClass(cls):
        import open3d

        cls.open3d = open3d
        cameras = six_cameras()
        depth = [ball_depth(camera) for camera in cameras]
        cls.mesh = cgs.fuse(cameras, depth, voxel_size=0.05).surface()

    def theirs(self, mesh):
        utility = self.open3d.utility
        return self.open3d.geometry.TriangleMesh(
            utility.Vector3dVector(mesh.vertices),
            utility.Vector3iVector(mesh.faces.astype("int32")),
        )

    def test_of_meshes_keeps_every_number(self):
        theirs = self.theirs(self.mesh)
        area = self.mesh.measure(area=True)["area"]["value"]
        self.assertAlmostEqual(theirs.get_surface_area(), area, delta=1e-6 * area)
        again = cgs.Mesh(np.asarray(theirs.vertices), np.asarray(theirs.triangles))
        np.testing.assert_array_equal(again.vertices, self.mesh.vertices)
        np.testing.assert_array_equal(again.faces, self.mesh.faces)

    def test_of_what_they_simplified_can_be_measured(self):
        theirs = self.theirs(self.mesh).simplify_quadric_decimation(2000)
        mesh = cgs.Mesh(np.asarray(theirs.vertices), np.asarray(theirs.triangles))
        self.assertLessEqual(len(mesh.faces), 2000)
        distances = mesh.compare(self.mesh)["distance"]
        self.assertLess(np.nanmax(np.abs(distances)), 0.05)

    def test_of_points_keeps_every_number(self):
        points = self.open3d.utility.Vector3dVector(self.mesh.vertices)
        cloud = self.open3d.geometry.PointCloud(points)
        again = cgs.Mesh(np.asarray(cloud.points))
        np.testing.assert_array_equal(again.vertices, self.mesh.vertices)


class Splats(unittest.TestCase):
    def one(self):
        return cgs.Splats(
            positions=[[0, 0, 4]],
            scales=[[0.5, 0.5, 0.5]],
            rotations=[[1, 0, 0, 0]],
            opacities=[0.8],
            sh=[[[1, 0, -1]]],
        )

    def test_are_drawn_as_the_equation_says(self):
        splats = self.one()
        picture = splats.render(cgs.Camera(33, 33, 30, 30, 16.5, 16.5), background=(0, 0, 0))
        self.assertAlmostEqual(float(picture.alpha[16, 16]), 0.8, places=5)
        expected = np.clip(0.28209479 * np.array([1, 0, -1]) + 0.5, 0, 1)
        np.testing.assert_allclose(picture.color[16, 16], expected, atol=1e-5)
        variance = (0.5 * 30 / 4) ** 2 + 0.3  # of the picture, with its blur [pixels^2]
        self.assertAlmostEqual(
            float(picture.alpha[16, 18]), 0.8 * np.exp(-(2**2) / 2 / variance), places=3
        )
        self.assertIsNone(picture.hole)

    def test_are_drawn_before_a_background(self):
        camera = cgs.Camera(33, 33, 30, 30, 16.5, 16.5)
        plain = self.one().render(camera)
        white = self.one().render(camera, background=(1, 1, 1))
        covered = plain.alpha >= 0.5
        self.assertTrue(covered[16, 16])
        np.testing.assert_array_equal(white.color[covered], plain.color[covered])
        expected = plain.color + (1 - plain.alpha)[..., None]
        np.testing.assert_allclose(white.color[~covered], expected[~covered].clip(0, 1), atol=1e-6)
        np.testing.assert_array_equal(white.filled, plain.filled)
        with self.assertRaisesRegex(ValueError, "background"):
            self.one().render(camera, background=(0, np.nan, 0))

    def test_come_back_from_their_file(self):
        splats = self.one()
        splats.save(Path(WORK) / "one.ply")
        again = cgs.read_splats(Path(WORK) / "one.ply")
        np.testing.assert_allclose(again.positions, splats.positions)
        np.testing.assert_allclose(again.scales, splats.scales, rtol=1e-6)
        np.testing.assert_allclose(again.sh, splats.sh, atol=1e-6)
        self.assertEqual(len(again), 1)


class Program(unittest.TestCase):
    def test_takes_options_as_words(self):
        mesh = Path(WORK) / "square.ply"
        cgs.Mesh([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]).save(mesh)
        told = cgs.program.measure(mesh, area=True, distance=[(0, 0, 0), (2, 0, 0)])
        self.assertEqual(told, program("measure", mesh, "--area", "--distance", "0,0,0", "2,0,0"))
        for no in (False, 0, np.False_, None):
            self.assertEqual(list(cgs.program.measure(mesh, area=True, volume=no)["figures"]), ["area"])
        out = Path(WORK) / "moved.ply"
        cgs.program.filter(mesh, out, op=["translate=1,0,0", "scale=2"])
        self.assertEqual(cgs.read_mesh(out).vertices.min(0).tolist(), [2, 0, 0])

    def test_explains_itself(self):
        self.assertIn("Example: cgs run", cgs.program.run.__doc__)
        self.assertIn("--assume-unit", cgs.program.measure.__doc__)


class Errors(unittest.TestCase):
    def test_have_the_words_and_the_code_of_the_program(self):
        with self.assertRaises(cgs.BadInput) as raised:
            cgs.read_mesh("nowhere.ply")
        self.assertEqual(str(raised.exception), "OPEN: nowhere.ply: No such file or directory")
        self.assertEqual((raised.exception.exit_code, raised.exception.defect), (3, "OPEN"))
        self.assertIsInstance(raised.exception, ValueError)
        with self.assertRaises(cgs.InvalidInput) as misuse:
            cgs.program.measure("nowhere.ply", aera=True)
        self.assertIn("takes no aera", str(misuse.exception))
        with self.assertRaises(OSError):
            cgs.Mesh(np.eye(3), [[0, 1, 2]]).save("/proc/no/such/folder/mesh.ply")

    def test_warnings_can_be_made_errors(self):
        folder = Path(WORK) / "without"
        shutil.copytree(CAPTURE, folder, ignore=shutil.ignore_patterns("truth"))
        next((folder / "images").glob("view_05*")).unlink()
        with self.assertWarnsRegex(UserWarning, "missing"):
            cgs.read_scene(folder)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaisesRegex(UserWarning, "missing"):
                cgs.read_scene(folder)


if __name__ == "__main__":
    shutil.rmtree(WORK, ignore_errors=True)
    Path(WORK).mkdir(parents=True)
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
