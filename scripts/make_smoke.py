#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes scenes/smoke.vol: the extinction of a plume of smoke on a grid, a sum of random Gaussian puffs.

    make_smoke.py smoke.vol
"""
import math
import random
import struct
import sys

SIZE = (20, 32, 20)  # cells along x, y, z; the plume rises along y
PUFFS = 90


def puffs():
    """Centre, radius and weight of each: they drift, widen and thin out with height."""
    draw = random.Random(31)
    made = []
    for _ in range(PUFFS):
        height = draw.random() ** 0.8
        spread = 0.03 + 0.17 * height
        turn = 5 * height + draw.uniform(-0.8, 0.8)
        centre = (0.5 + spread * math.cos(turn) + draw.gauss(0, 0.04), 0.04 + 0.86 * height,
                  0.5 + spread * math.sin(turn) + draw.gauss(0, 0.04))
        radius = 0.035 + 0.06 * height * draw.uniform(0.6, 1.4)
        made.append((centre, radius, (1 - 0.75 * height) * draw.uniform(0.4, 1)))
    return made


def density(x, y, z, made):
    total = 0.0
    for (cx, cy, cz), radius, weight in made:
        squared = ((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2) / radius ** 2
        if squared < 16:
            total += weight * math.exp(-0.5 * squared)
    inside = min(x, y, z, 1 - x, 1 - y, 1 - z)  # nothing at the sides of the box
    return total * min(1.0, max(0.0, inside - 0.02) / 0.06)


def main():
    made = puffs()
    nx, ny, nz = SIZE
    values = [density((x + 0.5) / nx, (y + 0.5) / ny, (z + 0.5) / nz, made)
              for z in range(nz) for y in range(ny) for x in range(nx)]
    most = max(values)
    with open(sys.argv[1], "wb") as file:
        file.write(b"VOL\x03" + struct.pack("<5i6f", 1, nx, ny, nz, 1, 0, 0, 0, 1, 1, 1))
        file.write(struct.pack(f"<{len(values)}f", *(value / most for value in values)))


if __name__ == "__main__":
    main()
