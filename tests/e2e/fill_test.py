#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What somebody paints into holes comes back tagged, and changes nothing that photographs show.

usage: fill_test.py CGS CAPTURE FOLDER

Trains a model of three of the photographs, paints its holes by a script, and looks at what the
program makes of it, bytes and pixels. The files are parsed here, not by the program.
"""
import hashlib
import json
import pathlib
import shutil
import struct
import subprocess
import sys
import unittest

import numpy as np
from PIL import Image

CGS, CAPTURE, FOLDER = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
INPUTS = ['view_01', 'view_03', 'view_05']
PAINT = (40, 200, 90)
EVIDENCE = ['gaussians.ply', 'cameras.json', *(f'priors/{name}.exr' for name in INPUTS)]


def cgs(*words, code=0):
    done = subprocess.run([CGS, *map(str, words)], capture_output=True, text=True, cwd=FOLDER)
    assert done.returncode == code, f'{words}: {done.returncode} {done.stderr}'
    return done


def told(*words):
    return json.loads(cgs(*words, '--json').stdout)


def pixels(path):
    return np.asarray(Image.open(FOLDER / path).convert('RGB')).astype(int)


def is_set(path):
    return pixels(path)[..., 0] > 127


def splats(path):
    """Comments and properties of a PLY file of floats."""
    data = (FOLDER / path).read_bytes()
    head, body = data.split(b'end_header\n', 1)
    lines = head.decode().splitlines()
    names = [line.split()[2] for line in lines if line.startswith('property float')]
    values = np.frombuffer(body, '<f4').reshape(-1, len(names))
    comments = [line.removeprefix('comment ') for line in lines if line.startswith('comment ')]
    return comments, dict(zip(names, values.T))


def paint(folder, color=PAINT):
    for mask in sorted((FOLDER / folder).glob('*_mask.png')):
        path = mask.with_name(mask.name.replace('_mask', ''))
        picture = pixels(path)
        picture[is_set(mask)] = color
        Image.fromarray(picture.astype(np.uint8)).save(path)


class FillTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(FOLDER, ignore_errors=True)
        FOLDER.mkdir(parents=True)
        cgs('train', CAPTURE, '--views', ','.join(INPUTS), '--preset', 'draft', '-o', 'model')
        cls.holes = told('render', 'model', '--holes', '-o', 'holes')
        shutil.copytree(FOLDER / 'holes', FOLDER / 'unpainted')
        paint('holes')
        cls.fill = told('fill', 'model', 'holes', '-o', 'filled')
        for model in ('model', 'filled'):
            cls.views = told('render', model, '-o', f'views_{model}')

    def test_few_cameras_see_the_holes(self):
        self.assertLessEqual(len(self.holes['views']), 6)
        enough = self.holes['covered_fraction'] >= 0.95 or len(self.holes['views']) == 6
        self.assertTrue(enough, self.holes)
        self.assertGreater(self.holes['covered_fraction'], 0.6)
        names = [row['img_name'] for row in json.loads((FOLDER / 'holes/cameras.json').read_text())]
        self.assertEqual(names, [view['name'] for view in self.holes['views']])
        for view in self.holes['views']:
            share = is_set(f"unpainted/{view['name']}_mask.png").mean()
            self.assertAlmostEqual(share, view['hole_fraction'], places=9)

    def test_everything_made_up_is_tagged_with_its_file(self):
        comments, made_up = splats('filled/fill.ply')
        self.assertEqual(len(made_up['x']), self.fill['splats'])
        self.assertTrue((made_up['synthetic'] >= 1).all() and (made_up['provenance'] == 0).all())
        for k, view in enumerate(self.fill['views'], 1):
            digest = hashlib.sha256((FOLDER / 'holes' / view['file']).read_bytes()).hexdigest()
            self.assertEqual(view['sha256'], digest)
            self.assertIn(f"synthetic {k} sha256:{digest} {view['file']}", comments)
            self.assertEqual(int((made_up['synthetic'] == k).sum()), view['lifted'])
            parts = view['lifted'] + view['filled_before'] + view['unplaced'] + view['shone_through']
            self.assertEqual(parts, view['hole_pixels'])
        holes = sum(view['hole_pixels'] - view['filled_before'] for view in self.fill['views'])
        self.assertGreater(self.fill['splats'], 0.5 * holes)

    def test_the_program_paints_where_nobody_does(self):
        made = told('fill', 'model', '-o', 'by_itself')
        comments, made_up = splats('by_itself/fill.ply')
        self.assertEqual(len(made_up['x']), made['splats'])
        self.assertGreater(made['splats'], 0.2 * self.fill['splats'])
        self.assertTrue((made_up['synthetic'] >= 1).all() and (made_up['provenance'] == 0).all())
        for k, view in enumerate(made['views'], 1):
            self.assertEqual(view['file'], f"surroundings/{view['name']}.png")
            digest = hashlib.sha256((FOLDER / 'by_itself' / view['file']).read_bytes()).hexdigest()
            self.assertEqual(view['sha256'], digest)
            self.assertIn(f"synthetic {k} sha256:{digest} {view['file']}", comments)
            parts = ('lifted', 'filled_before', 'left_open', 'unplaced', 'shone_through')
            self.assertEqual(sum(view[part] for part in parts), view['hole_pixels'])
        for name in EVIDENCE:
            same = (FOLDER / 'model' / name).read_bytes() == (FOLDER / 'by_itself' / name).read_bytes()
            self.assertTrue(same, name)
        self.assertEqual(told('evaluate', 'model'), told('evaluate', 'by_itself'))
        before = (FOLDER / 'by_itself/fill.ply').read_bytes()  # with the hashes of the pictures
        pictures = FOLDER / 'by_itself/surroundings'
        (pictures / f"hole_{len(made['views']) + 1}.png").write_bytes(b'of an earlier fill')
        cgs('fill', 'model', '-o', 'by_itself', '-w', '--threads', 1)
        self.assertEqual(len(list(pictures.iterdir())), len(made['views']))
        self.assertEqual((FOLDER / 'by_itself/fill.ply').read_bytes(), before)
        cgs('fill', 'model', 'holes', '-o', 'by_itself', '-w')
        self.assertFalse(pictures.exists())

    def test_no_model_is_replaced_by_accident(self):
        before = (FOLDER / 'filled/fill.ply').read_bytes()
        said = cgs('fill', 'model', 'holes', '-o', 'filled', code=2).stderr
        self.assertIn('--overwrite', said)
        cgs('fill', 'model', 'holes', '-o', 'filled', '-w')
        self.assertEqual((FOLDER / 'filled/fill.ply').read_bytes(), before)

    def test_the_model_tells_of_it(self):
        self.assertIsNone(told('info', 'model')['synthetic'])
        made_up = told('info', 'filled')['synthetic']
        self.assertEqual(made_up, told('info', 'filled/fill.ply')['synthetic'])
        self.assertEqual(made_up['splats'], self.fill['splats'])

    def test_evidence_keeps_its_bits(self):
        for name in EVIDENCE:
            same = (FOLDER / 'model' / name).read_bytes() == (FOLDER / 'filled' / name).read_bytes()
            self.assertTrue(same, name)
        self.assertEqual(told('evaluate', 'model'), told('evaluate', 'filled'))
        for model in ('model', 'filled'):
            (FOLDER / f'mesh_{model}').mkdir()
            cgs('convert', model, f'mesh_{model}/mesh.obj')
        a, b = ((FOLDER / f'mesh_{model}/mesh.obj').read_bytes() for model in ('model', 'filled'))
        self.assertEqual(a, b)

    def test_pictures_differ_in_holes_alone(self):
        changed = 0
        for view in self.views:
            name = view['name']
            for ending in ('exr', 'hole.png', 'depth.png'):
                a, b = (FOLDER / f'views_{m}/{name}.{ending}' for m in ('model', 'filled'))
                self.assertEqual(a.read_bytes(), b.read_bytes(), f'{name}.{ending}')
            before, after = (pixels(f'views_{m}/{name}.color.png') for m in ('model', 'filled'))
            differs = (before != after).any(axis=2)
            self.assertFalse((differs & ~is_set(f'views_model/{name}.hole.png')).any(), name)
            self.assertTrue(name not in INPUTS or np.abs(before - after).max() <= 1, name)
            self.assertTrue(name not in INPUTS or view['synthetic_fraction'] == 0, name)
            changed += differs.sum()
        self.assertGreater(changed, 100)

    def test_a_painted_view_shows_what_was_painted(self):
        cgs('render', 'filled', '--path', 'holes/cameras.json', '-o', 'again')
        shown, holes = pixels('again/frame_0000.png'), is_set('unpainted/hole_1_mask.png')
        seen = (pixels('unpainted/hole_1.png') == shown).all(axis=2)
        self.assertTrue(seen[~holes].all())
        close = (np.abs(shown - np.array(PAINT)).max(axis=2) < 16)[holes].mean()
        self.assertGreater(close, 0.4)  # the rest goes over into the colours at the seams
        cgs('render', 'filled', '--path', 'holes/cameras.json', '--fill', 'none', '-o', 'black')
        empty = pixels('black/frame_0000.png')[holes]
        self.assertLess((np.abs(empty - np.array(PAINT)).max(axis=1) < 16).mean(), 0.02)

    def test_tags_go_where_splats_go(self):
        for name in ('all.ply', 'all.glb'):
            made = told('convert', 'filled', name, '--as', 'splats')['output']['synthetic']
            self.assertEqual(made['splats'], self.fill['splats'])
            self.assertEqual(made['sources'][0]['sha256'], self.fill['views'][0]['sha256'])
            self.assertEqual(told('info', name)['synthetic'], made)
        comments, both = splats('all.ply')
        self.assertEqual(int((both['synthetic'] > 0).sum()), self.fill['splats'])
        data = (FOLDER / 'all.glb').read_bytes()
        scene = json.loads(data[20:20 + struct.unpack('<I', data[12:16])[0]])
        self.assertIn('_SYNTHETIC', scene['meshes'][0]['primitives'][0]['attributes'])
        self.assertEqual(len(scene['asset']['extras']['synthetic_sources']), len(self.fill['views']))
        lost = cgs('convert', 'filled', 'all.spz').stderr
        self.assertIn('mark of what is synthetic', lost)
        self.assertIn('left out: no mesh', cgs('convert', 'all.ply', 'of_splats.obj', '--virtual-views',
                                               '6', '--virtual-size', '64').stderr)
        cgs('convert', 'filled/fill.ply', 'none.obj', code=3)

    def test_changed_pixels_and_unpainted_pictures_are_refused(self):
        self.assertIn('none of its', cgs('fill', 'model', 'unpainted', '-o', 'no', code=3).stderr)
        shutil.copytree(FOLDER / 'holes', FOLDER / 'changed')
        picture = pixels('changed/hole_1.png')
        seen = np.argwhere(~is_set('changed/hole_1_mask.png'))[:30]
        picture[tuple(seen.T)] ^= 8
        Image.fromarray(picture.astype(np.uint8)).save(FOLDER / 'changed/hole_1.png')
        said = cgs('fill', 'model', 'changed', '-o', 'no', code=3).stderr
        self.assertIn('hole_1.png', said)
        self.assertIn('pixels outside of the mask (30) differ', said)
        self.assertIn('allowed: none', said)
        self.assertEqual(len(said.strip().splitlines()), 1, said)
        self.assertFalse((FOLDER / 'no').exists())
        cgs('render', 'model', '--holes', '-o', 'holes', code=2)  # would overwrite what was painted

    def test_same_bits_for_any_number_of_threads(self):
        for threads in (1, 2, 3, 4):
            cgs('fill', 'model', 'holes', '-o', 'again_filled', '-w', '--threads', threads)
            same = (FOLDER / 'again_filled/fill.ply').read_bytes() == (FOLDER / 'filled/fill.ply').read_bytes()
            self.assertTrue(same, threads)
        cgs('render', 'model', '--holes', '-o', 'once_more', '--threads', 1)
        for path in sorted((FOLDER / 'unpainted').iterdir()):
            self.assertEqual(path.read_bytes(), (FOLDER / 'once_more' / path.name).read_bytes(), path.name)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
