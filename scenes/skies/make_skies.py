#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""make_skies.py DIR: the sky images of scenes/plane-under-sky.xml, latitude-longitude images around the y axis, in half
precision.

    colours.exr   soft patches of saturated colours of about the same brightness
    sea.exr       half blue and half green, of the same brightness
    uniform.exr   one colour everywhere
    sun.exr       a sky that brightens towards the horizon and around a sun of 4.4 degrees"""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/cli"))
from exr_writer import HALF, exr  # noqa: E402

WIDTH, HEIGHT = 128, 64


def direction(azimuth, height):
    """Unit vector; degrees."""
    a, h = math.radians(azimuth), math.radians(height)
    return math.cos(h) * math.cos(a), math.sin(h), math.cos(h) * math.sin(a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


PATCHES = [(direction(20, 35), (3.0, 0.1, 0.1)), (direction(95, 30), (0.1, 0.1, 4.0)),
           (direction(165, 40), (2.0, 1.6, 0.1)), (direction(235, 30), (0.1, 2.6, 0.3)),
           (direction(305, 45), (2.0, 0.1, 2.4)), (direction(60, 80), (0.1, 2.2, 2.2))]
SUN = direction(60, 50)


def colours(w):
    total = [0.02, 0.02, 0.02]
    for centre, colour in PATCHES:
        shape = 1 / (1 + math.exp((math.degrees(math.acos(min(1, dot(w, centre)))) - 24) / 3))
        total = [t + shape * c for t, c in zip(total, colour)]
    return total


def sea(w):
    green = 1 / (1 + math.exp(-8 * w[0]))
    return [0.1, 0.2 + 1.8 * green, 0.2 + 1.8 * (1 - green)]


def uniform(_):
    return [0.8, 1.0, 1.4]


def sun(w):
    angle = math.degrees(math.acos(min(1, dot(w, SUN))))
    horizon = math.exp(-3 * max(w[1], 0))
    glow = math.exp(-angle / 12)
    disc = 400 if angle < 2.2 else 0
    return [0.15 + 0.5 * horizon + 1.2 * glow + disc, 0.3 + 0.45 * horizon + 1.1 * glow + 0.95 * disc,
            0.7 + 0.3 * horizon + 0.9 * glow + 0.85 * disc]


def image(sky):
    """Pixels as envmap reads them: u = atan2(x, -z) / 2 pi, v from +y down."""
    values = []
    for y in range(HEIGHT):
        for x in range(WIDTH):
            turn, polar = 2 * math.pi * (x + 0.5) / WIDTH, math.pi * (y + 0.5) / HEIGHT
            values.append(sky((math.sin(polar) * math.sin(turn), math.cos(polar), -math.sin(polar) * math.cos(turn))))
    return {name: [value[i] for value in values] for i, name in enumerate("RGB")}


def main(folder):
    for sky in (colours, sea, uniform, sun):
        path = pathlib.Path(folder) / f"{sky.__name__}.exr"
        path.write_bytes(exr(image(sky), (WIDTH, HEIGHT), types=dict.fromkeys("RGB", HALF)))


if __name__ == "__main__":
    main(*sys.argv[1:])
