#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs a card of known colours, runs `cgs run`, and holds what others show against it.

usage: grey_card_test.py CGS FOLDER

The card has a ramp of greys, 18 % grey and saturated colours, on a wall of fine texture that tells
where it stands. Where a program is missing, its test is skipped.
"""
import base64
import io
import json
import pathlib
import shutil
import struct
import subprocess
import sys
import time
import unittest

import numpy as np
from PIL import Image

CGS, FOLDER = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
OUT = FOLDER / 'run'
SIZE = (320, 240)
FOCAL = 330.0
DISTANCE = 2.0
PATCH = 0.17  # [m]
SAFE = 0.45  # the part of a patch, from its middle, that neither blocks of JPEG nor pixels of its rim reach

# 18 % grey is 118 in sRGB.
COLORS = [(16,) * 3, (48,) * 3, (80,) * 3, (118,) * 3, (160,) * 3, (192,) * 3, (224,) * 3, (243,) * 3,
          (255, 0, 0), (0, 255, 0), (0, 0, 255), (0, 255, 255), (255, 0, 255), (255, 255, 0),
          (200, 30, 40), (40, 160, 60), (50, 70, 180), (230, 150, 60), (95, 60, 110), (190, 140, 120)]
COLUMNS = 5

# Levels of 255 that the median of a patch and its worst pixel may be off. What is rendered or fused is held to its
# medians.
TEXTURE = 1, 3
VERTICES = 1, 255
PAGE = 1, 255
BLENDER_SHOWS = 2, 255


def middle(patch):
    """Where the middle of a patch is on the wall [m]."""
    column, row = patch % COLUMNS, patch // COLUMNS
    return np.array([(column - (COLUMNS - 1) / 2) * 1.3 * PATCH, (row - 1.5) * 1.3 * PATCH])


def wall(x, y, texture):
    """sRGB-coded colour of places on the wall."""
    scale = 160  # texels per metre
    columns = np.clip(((x + 2) * scale).astype(int), 0, texture.shape[1] - 1)
    rows = np.clip(((y + 2) * scale).astype(int), 0, texture.shape[0] - 1)
    out = texture[rows, columns].astype(float)
    for i, color in enumerate(COLORS):
        at = middle(i)
        inside = (np.abs(x - at[0]) < PATCH / 2) & (np.abs(y - at[1]) < PATCH / 2)
        out[inside] = color
    return out


def cameras():
    """Places before the wall and turns about y; axes +x right, +y down, +z forward."""
    for x, y, turn in ((-0.3, 0.0, 0.08), (0.0, 0.05, 0.0), (0.3, -0.03, -0.08)):
        c, s = np.cos(turn), np.sin(turn)
        yield np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.array([x, y, -DISTANCE])


def photograph(rotation, place, texture):
    """Mean of 3 x 3 rays per pixel."""
    total = np.zeros((SIZE[1], SIZE[0], 3))
    for dy in (1 / 6, 3 / 6, 5 / 6):
        for dx in (1 / 6, 3 / 6, 5 / 6):
            u, v = np.meshgrid(np.arange(SIZE[0]) + dx, np.arange(SIZE[1]) + dy)
            ray = np.stack([(u - SIZE[0] / 2) / FOCAL, (v - SIZE[1] / 2) / FOCAL, np.ones_like(u)], -1)
            ray = ray @ rotation.T
            t = -place[2] / ray[..., 2]
            total += wall(place[0] + t * ray[..., 0], place[1] + t * ray[..., 1], texture)
    return np.round(total / 9).astype(np.uint8)


def make_capture(folder):
    texture = np.random.default_rng(7).integers(70, 190, (640, 640, 3))
    (folder / 'images').mkdir(parents=True)
    frames = []
    for i, (rotation, place) in enumerate(cameras()):
        Image.fromarray(photograph(rotation, place, texture)).save(folder / f'images/view_{i}.png')
        pose = np.eye(4)
        pose[:3, :3] = rotation @ np.diag([1, -1, -1])  # transforms.json: +y up, looks along -z
        pose[:3, 3] = place
        frames.append({'file_path': f'images/view_{i}.png', 'transform_matrix': pose.tolist()})
    (folder / 'transforms.json').write_text(json.dumps(
        {'fl_x': FOCAL, 'fl_y': FOCAL, 'cx': SIZE[0] / 2, 'cy': SIZE[1] / 2, 'w': SIZE[0], 'h': SIZE[1],
         'frames': frames}))


def setUpModule():
    shutil.rmtree(FOLDER, ignore_errors=True)
    make_capture(FOLDER / 'capture')
    subprocess.run([CGS, 'run', FOLDER / 'capture', '--assume-unit', 'm', '--set', 'steps=0', '--up', '0', '-1', '0',
                    '--glb-encoding', 'plain', '-q', '-o', OUT], check=True)


class Glb:
    """A file of floats, as glTF 2.0 says."""

    def __init__(self, path):
        data = path.read_bytes()
        length = struct.unpack('<I', data[12:16])[0]
        self.json = json.loads(data[20:20 + length])
        self.binary = data[28 + length:]

    def view(self, index):
        view = self.json['bufferViews'][index]
        return self.binary[view.get('byteOffset', 0):view.get('byteOffset', 0) + view['byteLength']]

    def accessor(self, index):
        accessor = self.json['accessors'][index]
        kind = {5126: '<f4', 5125: '<u4', 5123: '<u2'}[accessor['componentType']]
        width = {'SCALAR': 1, 'VEC2': 2, 'VEC3': 3}[accessor['type']]
        return np.frombuffer(self.view(accessor['bufferView']), kind)[:accessor['count'] * width].reshape(-1, width)

    def image(self, material):
        texture = self.json['materials'][material]['pbrMetallicRoughness']['baseColorTexture']['index']
        source = self.json['images'][self.json['textures'][texture]['source']]
        return np.asarray(Image.open(io.BytesIO(self.view(source['bufferView']))).convert('RGB'), dtype=float)

    def in_world(self, positions):
        positions = positions + self.json['nodes'][0]['translation']
        extras = self.json['asset']['extras']
        return positions @ np.array(extras['gltf_from_world']).reshape(3, 3) + extras['origin_in_world']


def patch_at(places):
    """Of places on the wall: the patch in whose safe part each lies, else -1."""
    out = np.full(len(places), -1)
    for i in range(len(COLORS)):
        off = np.abs(places[:, :2] - middle(i)).max(axis=1)
        out[(off < SAFE * PATCH / 2) & (np.abs(places[:, 2]) < PATCH)] = i
    return out


def faults(patches, colors, typical, worst):
    """What is wrong with shown colours: patches that are missing, whose median is more than `typical` levels off the
    card in a channel, or of which a single pixel is more than `worst` levels off."""
    out = []
    for i, color in enumerate(COLORS):
        found = colors[patches == i]
        if len(found) == 0:
            out.append(f'{color} is not there')
            continue
        median = np.median(found, axis=0)
        if np.abs(median - color).max() > typical:
            out.append(f'{color} is shown as {median}')
        off = np.abs(found - color).max(axis=1)
        if off.max() > worst:
            out.append(f'a pixel of {color} is shown as {found[off.argmax()]}')
    return out


def texture_samples(glb):
    """Patches and colours at four places of every textured face."""
    patches, colors = [], []
    for primitive in glb.json['meshes'][0]['primitives']:
        if 'TEXCOORD_0' not in primitive['attributes']:
            continue
        assert 'COLOR_0' not in primitive['attributes']  # it would tint the texture
        faces = glb.accessor(primitive['indices']).reshape(-1, 3)
        image = glb.image(primitive['material'])
        corners = glb.accessor(primitive['attributes']['TEXCOORD_0'])[faces]
        places = glb.in_world(glb.accessor(primitive['attributes']['POSITION']).astype(float))[faces]
        for share in ((1 / 3, 1 / 3, 1 / 3), (0.8, 0.1, 0.1), (0.1, 0.8, 0.1), (0.1, 0.1, 0.8)):
            at = np.einsum('k,fkc->fc', share, corners) * [image.shape[1], image.shape[0]]
            at = np.clip(at.astype(int), 0, [image.shape[1] - 1, image.shape[0] - 1])
            colors.append(image[at[:, 1], at[:, 0]])
            patches.append(patch_at(np.einsum('k,fkc->fc', share, places)))
    return np.concatenate(patches), np.concatenate(colors)


class GreyCard(unittest.TestCase):
    def expect(self, patches, colors, typical, worst):
        self.assertEqual(faults(patches, colors, typical, worst), [])

    def test_the_texture_of_the_asset(self):
        self.expect(*texture_samples(Glb(OUT / 'web/asset.glb')), *TEXTURE)

    def test_planted_faults_are_reported(self):
        patches, colors = texture_samples(Glb(OUT / 'web/asset.glb'))
        light = colors / 255
        linear = np.where(light <= 0.04045, light / 12.92, ((light + 0.055) / 1.055) ** 2.4)
        coded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
        spot = colors.copy()
        spot[np.flatnonzero(patches == 3)[0]] += TEXTURE[1] + 1
        for name, shown, least in (('decoded twice', 255 * linear, 7), ('coded twice', 255 * coded, 7),
                                   ('brighter by 2', np.minimum(colors + 2, 255), 12),
                                   ('darker by 2', np.maximum(colors - 2, 0), 12),
                                   ('red and blue swapped', colors[:, ::-1], 8),
                                   ('one pixel of 18 % grey', spot, 1)):
            with self.subTest(name):
                self.assertGreaterEqual(len(faults(patches, shown, *TEXTURE)), least)
        with self.subTest('a patch is missing'):
            self.assertEqual(len(faults(np.where(patches == 5, -1, patches), colors, *TEXTURE)), 1)

    def test_the_colours_of_vertices(self):
        lines = (OUT / 'mesh/watertight.ply').read_bytes().split(b'end_header\n', 1)
        header = lines[0].decode('latin-1').splitlines()
        kinds = {'float': '<f4', 'double': '<f8', 'uchar': 'u1', 'ushort': '<u2', 'int': '<i4', 'uint': '<u4'}
        first = next(i for i, line in enumerate(header) if line.startswith('element vertex'))
        fields = []
        for line in header[first + 1:]:
            if not line.startswith('property'):
                break
            fields.append((line.split()[2], kinds[line.split()[1]]))
        rows = np.frombuffer(lines[1], np.dtype(fields), int(header[first].split()[2]))
        places = np.stack([rows[a].astype(float) for a in 'xyz'], -1)
        colors = np.stack([rows[c].astype(float) for c in ('red', 'green', 'blue')], -1)
        self.expect(patch_at(places), colors, *VERTICES)

    @unittest.skipUnless(shutil.which('blender'), 'no Blender')
    def test_blender(self):
        glb = Glb(OUT / 'web/asset.glb')
        axes = np.array(glb.json['asset']['extras']['gltf_from_world']).reshape(3, 3)
        blender_from_gltf = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
        to_blender = blender_from_gltf @ axes
        rotation, place = list(cameras())[1]
        pose = np.eye(4)
        pose[:3, :3] = to_blender @ rotation @ np.diag([1, -1, -1])
        pose[:3, 3] = to_blender @ (place - glb.json['asset']['extras']['origin_in_world'])
        shot = {'file': str(OUT / 'web/asset.glb'), 'picture': str(FOLDER / 'blender.png'), 'size': SIZE,
                'lens': FOCAL / SIZE[0], 'pose': pose.tolist()}
        done = subprocess.run(['blender', '-b', '--factory-startup', '--python-exit-code', '1', '--python-expr',
                               BLENDER, '--', json.dumps(shot)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout[-2000:] + done.stderr[-2000:])
        self.expect_picture(np.asarray(Image.open(FOLDER / 'blender.png').convert('RGB'), dtype=float), *BLENDER_SHOWS)

    def test_the_page_in_a_browser(self):
        try:
            picture = browser_picture(OUT / 'report.html', 'view_1')
        except ImportError as missing:
            self.skipTest(str(missing))
        picture.save(FOLDER / 'browser.png')
        scale = min(picture.width / SIZE[0], picture.height / SIZE[1])
        left, top = (picture.width - scale * SIZE[0]) / 2, (picture.height - scale * SIZE[1]) / 2
        picture = picture.crop((left, top, left + scale * SIZE[0], top + scale * SIZE[1]))
        self.expect_picture(np.asarray(picture, dtype=float), *PAGE)

    def expect_picture(self, picture, typical, worst):
        """As `expect`, of a picture that the middle camera takes, of any size."""
        rotation, place = list(cameras())[1]
        height, width = picture.shape[:2]
        u, v = np.meshgrid((np.arange(width) + 0.5) / width * SIZE[0], (np.arange(height) + 0.5) / height * SIZE[1])
        ray = np.stack([(u - SIZE[0] / 2) / FOCAL, (v - SIZE[1] / 2) / FOCAL, np.ones_like(u)], -1) @ rotation.T
        places = (place - place[2] / ray[..., 2:] * ray).reshape(-1, 3)
        self.expect(patch_at(places), picture.reshape(-1, 3), typical, worst)


BLENDER = '''
import json, sys
import numpy
numpy.bool = bool  # Debian: the importer of Blender 3.4 asks for a name that numpy 1.24 dropped
import bpy, mathutils
shot = json.loads(sys.argv[sys.argv.index('--') + 1])
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=shot['file'])
images = [node.image for material in bpy.data.materials if material.use_nodes
          for node in material.node_tree.nodes if node.type == 'TEX_IMAGE']
assert images and all(image.colorspace_settings.name == 'sRGB' for image in images), images
scene = bpy.context.scene
camera = bpy.data.objects.new('camera', bpy.data.cameras.new('camera'))
scene.collection.objects.link(camera)
camera.matrix_world = mathutils.Matrix(shot['pose'])
camera.data.lens = shot['lens'] * camera.data.sensor_width
scene.camera = camera
scene.render.engine = 'CYCLES'
scene.cycles.samples = 4
scene.cycles.use_denoising = False
scene.view_settings.view_transform = 'Standard'
scene.render.dither_intensity = 0
scene.render.resolution_x, scene.render.resolution_y = shot['size']
scene.render.filepath = shot['picture']
bpy.ops.render.render(write_still=True)
'''


def browser_picture(page, button):
    """What the canvas of a report shows after a button was pressed."""
    from selenium import webdriver
    from selenium.common.exceptions import WebDriverException
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.by import By
    options = Options()
    for argument in ('--headless=new', '--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
                     '--force-color-profile=srgb', '--window-size=1300,1250'):
        options.add_argument(argument)
    try:
        driver = webdriver.Chrome(service=Service('/usr/bin/chromedriver'), options=options)
    except WebDriverException as failure:
        raise ImportError(f'no browser: {failure.msg}') from failure
    try:
        driver.get(page.as_uri())
        viewer = driver.find_element(By.ID, 'viewer')
        for _ in range(600):
            if viewer.get_attribute('data-state'):
                break
            time.sleep(0.1)
        for text in ('Photographs', button):
            viewer.find_element(By.XPATH, f'.//button[text()="{text}"]').click()
        driver.execute_async_script(
            'const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done));')
        png = base64.b64decode(driver.find_element(By.ID, 'viewer-canvas').screenshot_as_base64)
        return Image.open(io.BytesIO(png)).convert('RGB')
    finally:
        driver.quit()


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
