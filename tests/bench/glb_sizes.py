#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints how large a mesh becomes as .glb by cgs and by other encoders, beside the errors each leaves.

usage: glb_sizes.py build/release/bin/cgs MESH [FOLDER]

FOLDER is where `npm install gltfpack @gltf-transform/core @gltf-transform/extensions draco3dgltf meshoptimizer`
was run; default: the current one. Every file is read by glTF-Transform, which shares no code with cgs but the two
codecs, and held against floats. Errors: of positions in parts of the extent, of normals in degrees, of colours in
levels of 255 as sRGB; the largest of each. All encoders get the same bits: positions 14, normals as named,
colours 11. Where a program is missing, its rows stay empty, and that is said.
"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np
from scipy.spatial import cKDTree

READ = r'''
import {createRequire} from 'module';
import fs from 'fs';
const require = createRequire(process.cwd() + '/x.js');
const {NodeIO} = require('@gltf-transform/core');
const {ALL_EXTENSIONS} = require('@gltf-transform/extensions');
const {MeshoptDecoder} = require('meshoptimizer');
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
  'draco3d.decoder': await require('draco3dgltf').createDecoderModule(), 'meshopt.decoder': MeshoptDecoder});
const [file, out] = process.argv.slice(2);
const doc = await io.read(file);
const columns = {POSITION: [], NORMAL: [], COLOR_0: []}, faces = [], names = new Set();
let first = 0;
for (const node of doc.getRoot().listNodes()) {
  const m = node.getWorldMatrix();
  for (const part of node.getMesh() ? node.getMesh().listPrimitives() : []) {
    part.listSemantics().forEach((name) => names.add(name));
    const count = part.getAttribute('POSITION').getCount();
    for (const [name, values] of Object.entries(columns)) {
      const accessor = part.getAttribute(name), e = [];
      for (let i = 0; i < count; i++) {
        if (accessor) accessor.getElement(i, e); else e.splice(0, 3, NaN, NaN, NaN);
        let [x, y, z] = e;
        if (name === 'POSITION') [x, y, z] = [0, 1, 2].map((r) => m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r]);
        values.push(x, y, z);
      }
    }
    const index = part.getIndices().getArray();
    for (let i = 0; i < index.length; i++) faces.push(first + index[i]);
    first += count;
  }
}
for (const [name, values] of Object.entries(columns)) fs.writeFileSync(`${out}.${name}`, Float64Array.from(values));
fs.writeFileSync(`${out}.faces`, Uint32Array.from(faces));
console.log(JSON.stringify([...names].sort()));
'''

TRANSFORM = r'''
import {createRequire} from 'module';
const require = createRequire(process.cwd() + '/x.js');
const {NodeIO} = require('@gltf-transform/core');
const {ALL_EXTENSIONS, KHRDracoMeshCompression} = require('@gltf-transform/extensions');
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
  'draco3d.encoder': await require('draco3dgltf').createEncoderModule()});
const [file, out, speed] = process.argv.slice(2);
const doc = await io.read(file);
doc.createExtension(KHRDracoMeshCompression).setRequired(true).setEncoderOptions({
  method: KHRDracoMeshCompression.EncoderMethod.EDGEBREAKER, encodeSpeed: +speed, decodeSpeed: +speed,
  quantizationBits: {POSITION: 14, NORMAL: 10, COLOR: 11, TEX_COORD: 12, GENERIC: 12}});
await io.write(out, doc);
'''


class Bench:
    def __init__(self, cgs, npm, folder):
        self.cgs, self.npm, self.folder = cgs, npm, folder
        for name, text in (('read.mjs', READ), ('transform.mjs', TRANSFORM)):
            (folder / name).write_text(text)
        self.has_reader = all((npm / 'node_modules' / name).exists() for name in
                              ('@gltf-transform/extensions', 'draco3dgltf', 'meshoptimizer'))

    def run(self, *command):
        done = subprocess.run([str(part) for part in command], cwd=self.npm, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError((done.stderr or done.stdout).strip().splitlines()[-1])
        return done.stdout

    def read(self, path):
        if path.suffix == '.drc':
            return self.read_drc(path)
        names = json.loads(self.run('node', self.folder / 'read.mjs', path, path))
        columns = {name: np.fromfile(f'{path}.{name}').reshape(-1, 3) for name in ('POSITION', 'NORMAL', 'COLOR_0')}
        return names, columns, np.fromfile(f'{path}.faces', np.uint32).reshape(-1, 3)

    def read_drc(self, path):
        self.run('draco_decoder', '-i', path, '-o', f'{path}.obj')
        rows = [line.split() for line in open(f'{path}.obj')]
        positions = np.array([row[1:4] for row in rows if row and row[0] == 'v'], float)
        nothing = np.full_like(positions, np.nan)
        return [], {'POSITION': positions, 'NORMAL': nothing, 'COLOR_0': nothing}, None

    def ours(self, mesh, name, encoding):
        out = self.folder / f'{name}.glb'
        self.run(self.cgs, 'convert', mesh, out, '--glb-encoding', encoding, '--simplify', '0', '-q')
        return out


def coded(linear):
    linear = np.clip(linear, 0, 1)
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def errors(truth, found):
    """Largest errors of positions (both ways), normals and colours; nan where either states none."""
    tree = cKDTree(found['POSITION'])
    # Of the places that rounding may have brought together, the one that says the same counts.
    distance, near = tree.query(truth['POSITION'], k=4)
    back, _ = cKDTree(truth['POSITION']).query(found['POSITION'])
    extent = np.ptp(truth['POSITION'], axis=0).max()
    position = max(distance[:, 0].max(), back.max())
    usable = distance <= 2 * position + 1e-12 * extent
    cosine = np.einsum('ikc,ic->ik', found['NORMAL'][near], truth['NORMAL'])
    cosine /= np.linalg.norm(found['NORMAL'][near], axis=2)
    normal = np.degrees(np.arccos(np.clip(np.where(usable, cosine, -1).max(axis=1).min(), -1, 1)))
    off = np.abs(coded(found['COLOR_0'][near]) - coded(truth['COLOR_0'])[:, None]).max(axis=2)
    return position / extent, normal, np.where(usable, off, np.inf).min(axis=1).max()


def write_bare(path, columns, faces):
    """The mesh with nothing but places, normals, colours and faces; vertices at one place are one."""
    places, first, number = np.unique(columns['POSITION'].astype('<f4'), axis=0, return_index=True, return_inverse=True)
    has_colors = not np.isnan(columns['COLOR_0']).any()
    fields = [('place', '<f4', 3), ('normal', '<f4', 3)] + [('color', 'u1', 3)] * has_colors
    rows = np.zeros(len(places), fields)
    rows['place'] = places
    rows['normal'] = columns['NORMAL'][first]
    if has_colors:
        rows['color'] = np.round(coded(columns['COLOR_0'][first]))
    corners = np.zeros(len(faces), [('n', 'u1'), ('corner', '<u4', 3)])
    corners['n'] = 3
    corners['corner'] = number.reshape(-1)[faces]
    header = ['ply', 'format binary_little_endian 1.0', f'element vertex {len(rows)}']
    header += [f'property float {a}' for a in ('x', 'y', 'z', 'nx', 'ny', 'nz')]
    header += [f'property uchar {c}' for c in ('red', 'green', 'blue') if has_colors]
    header += [f'element face {len(corners)}', 'property list uchar uint vertex_indices', 'end_header', '']
    path.write_bytes('\n'.join(header).encode() + rows.tobytes() + corners.tobytes())


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    cgs, mesh = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
    npm = pathlib.Path(sys.argv[3] if len(sys.argv) > 3 else '.').resolve()
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(cgs, npm, pathlib.Path(folder))
        if not bench.has_reader:
            sys.exit('the measuring reader is missing: ' + __doc__.split('\n\n')[2].strip())
        full = bench.ours(mesh, 'full', 'plain')
        names, full_columns, faces = bench.read(full)
        bare_mesh = bench.folder / 'bare.ply'
        write_bare(bare_mesh, full_columns, faces)
        plain = bench.ours(bare_mesh, 'plain', 'plain')
        _, columns, _ = bench.read(plain)
        print(f'{mesh.name}: {len(faces)} triangles; it states {", ".join(names)}')
        print(f'{"":34}{"bytes":>12}{"position":>12}{"normal":>9}{"colour":>8}')

        def row(title, make, truth):
            try:
                path = make()
                size = f'{path.stat().st_size:12,}'
            except (RuntimeError, FileNotFoundError) as why:
                print(f'{title:34}{"":>12}   skipped: {why}')
                return
            try:
                position, normal, color = errors(truth, bench.read(path)[1])
                part = f'1 / {1 / position:.0f}' if position > 0 else '0'
                print(f'{title:34}{size}{part:>12}{normal:9.2f}{color:8.2f}', flush=True)
            except RuntimeError as why:
                print(f'{title:34}{size}   not read: {why}', flush=True)

        def packed(name, *options):
            out = bench.folder / f'{name}.glb'
            if not (npm / 'node_modules/gltfpack').exists():
                raise FileNotFoundError('npm install gltfpack')
            bench.run('node', npm / 'node_modules/gltfpack/cli.js', '-i', plain, '-o', out, *options)
            return out

        def transformed(speed):
            out = bench.folder / f'transformed{speed}.glb'
            bench.run('node', bench.folder / 'transform.mjs', plain, out, speed)
            return out

        def draco_encoder():
            if not shutil.which('draco_encoder'):
                raise FileNotFoundError('no draco_encoder on the path')
            out = bench.folder / 'a.drc'
            bench.run('draco_encoder', '-i', bare_mesh, '-o', out, '-qp', '14', '-qn', '10', '-cl', '10')
            return out

        bits = ('-vp', '14', '-vn', '8', '-vc', '11')
        for encoding in ('draco', 'meshopt', 'quantized'):
            row(f'cgs {encoding}', lambda: bench.ours(bare_mesh, encoding, encoding), columns)
        row('glTF-Transform draco, its speed', lambda: transformed(5), columns)
        row('glTF-Transform draco, smallest', lambda: transformed(0), columns)
        row('draco_encoder, smallest (no .glb)', draco_encoder, full_columns)
        row('gltfpack -cc', lambda: packed('cc', '-cc', *bits), columns)
        row('gltfpack -c', lambda: packed('c', '-c', *bits), columns)
        row('gltfpack', lambda: packed('q', *bits), columns)
        row('gltfpack -cc -noq', lambda: packed('noq', '-cc', '-noq'), columns)
        for encoding in ('draco', 'meshopt', 'quantized'):
            row(f'cgs {encoding}, all it states', lambda: bench.ours(mesh, 'all', encoding), full_columns)


if __name__ == '__main__':
    main()
