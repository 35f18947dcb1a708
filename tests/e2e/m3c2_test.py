#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Holds `cgs compare --m3c2` against the definition of Lague et al. 2013, written out in numpy.

Usage: m3c2_test.py CGS FOLDER
"""
import json
import os
import subprocess
import sys

import numpy as np

CYLINDER, NORMAL_SCALE, DEPTH, REGISTRATION = 0.12, 0.3, 0.2, 0.001
SHIFT = 0.02


def write_cloud(path, points):
    with open(path, "w", encoding="ascii") as out:
        out.write("ply\nformat ascii 1.0\nelement vertex %d\n" % len(points))
        out.write("property double x\nproperty double y\nproperty double z\nend_header\n")
        np.savetxt(out, points, fmt="%.12g")


def read_fields(path):
    """The vertices of a binary little-endian PLY file as a structured array."""
    data = open(path, "rb").read()
    head, body = data.split(b"end_header\n", 1)
    kinds = {"float": "<f4", "double": "<f8", "uchar": "u1"}
    fields, count, here = [], 0, False
    for line in head.decode().splitlines():
        words = line.split()
        if words[0] == "element":
            here = words[1] == "vertex"
            count = int(words[2]) if here else count
        elif words[0] == "property" and here:
            fields.append((words[2], kinds[words[1]]))
    return np.frombuffer(body, np.dtype(fields), count)


def column(points, place, normal):
    along = (points - place) @ normal
    across = np.linalg.norm(points - place - along[:, None] * normal, axis=1)
    return along[(across <= CYLINDER / 2) & (np.abs(along) <= DEPTH)]


def by_definition(place, a, b):
    """Distance from b to a, and its level of detection."""
    near = a[np.linalg.norm(a - place, axis=1) <= NORMAL_SCALE / 2]
    normal = np.linalg.svd(near - near.mean(axis=0))[2][2]
    normal *= np.sign(normal[2])
    in_a, in_b = column(a, place, normal), column(b, place, normal)
    variance = in_a.var(ddof=1) / len(in_a) + in_b.var(ddof=1) / len(in_b)
    return in_a.mean() - in_b.mean(), 1.96 * (np.sqrt(variance) + REGISTRATION)


def surface(random, count, shift):
    """A wavy surface far from the origin, with noise that grows with x."""
    x, y = random.uniform(0, 1, (2, count))
    z = 0.05 * np.sin(5 * x) + 0.2 * y + shift + random.normal(0, 0.002 + 0.004 * x, count)
    return np.stack([x, y, z], axis=1) + [1000, 2000, 300]


def main():
    cgs, folder = sys.argv[1:]
    os.makedirs(folder, exist_ok=True)
    random = np.random.default_rng(3)
    a, b = surface(random, 5000, SHIFT), surface(random, 4000, 0)
    names = [os.path.join(folder, name) for name in ("a.ply", "b.ply", "change.ply")]
    write_cloud(names[0], a)
    write_cloud(names[1], b)
    report = json.loads(subprocess.run(
        [cgs, "compare", *names[:2], "--m3c2", "--assume-unit", "m", "--ply", names[2], "--json",
         "--cylinder", f"{CYLINDER}m", "--normal-scale", f"{NORMAL_SCALE}m",
         "--cylinder-depth", f"{DEPTH}m", "--registration-error", f"{REGISTRATION}m"],
        check=True, capture_output=True, text=True).stdout)
    fields = read_fields(names[2])
    assert len(fields) == len(a)
    # Cylinders that end at a point's very place differ by that point alone.
    worst = np.zeros(2)
    differing = 0
    for i in range(0, len(a), 10):
        found = np.array([fields["scalar_distance"][i], fields["scalar_detection"][i]])
        off = np.abs(found - by_definition(a[i], a, b))
        differing += off.max() > 1e-6
        worst = np.maximum(worst, off)
        significant = abs(found[0]) > found[1]
        assert fields["scalar_significant"][i] == significant
    print(f"500 places: largest difference of distance {worst[0]:.3g} m, of detection "
          f"{worst[1]:.3g} m; {differing} differ by more than 1e-6 m")
    assert differing <= 5 and worst.max() < 2e-3
    mean = report["distance"]["mean"]
    print(f"mean distance {mean:.5f} m")
    # Along the normal of a surface that leans by 0.2 in y and up to 0.25 in x.
    assert 0.9 * SHIFT < mean < SHIFT


if __name__ == "__main__":
    main()
