# SPDX-License-Identifier: GPL-3.0-or-later
"""A scan of any program, cleaned, closed and certified; where it changed, in colour.

usage: 04_clean_and_certify.py SCAN OUT.ply
"""
import sys

import numpy as np

import cgs


def main(scan_file: str, output: str) -> None:
    scan = cgs.read_mesh(scan_file)
    closed = scan.filter("repair", "largest=1", "watertight")
    proof = closed.certificate()
    print("certified" if proof["passed"] else "fails", f"genus {proof['genus']}")
    distance = closed.compare(scan)["distance"]
    far = np.clip(np.abs(distance) / (np.abs(distance).max() + 1e-30), 0, 1)
    closed.colors = np.stack([far, 1 - far, np.zeros_like(far)], axis=1)
    closed.save(output)
    print(f"moved by up to {np.abs(distance).max()}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
