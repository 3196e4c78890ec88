#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""guiding_probes.py COVARY OUT.jpg DOOR.xml: what guided paths have learnt at three surfaces, for
docs/methods/guiding.md. COVARY: the program; DOOR.xml: Veach's ajar door, which is not part of the repository. Needs
`pip install numpy matplotlib pillow`.

Rows: the floor and the back wall (rough metal) of scenes/glossy-box.xml, and the floor in front of the door. From the
left: incident radiance; density of the mixture of BSDF and guiding; control variate (red: positive, blue: negative), to
which a multiple of the density is added, which has no effect, such that its integral is 0. Maps show all directions,
azimuth to the right, +y at the top; brightness is raised to the power 1/3 and ends at the 99.8th percentile."""
import sys

import numpy as np
from probes import ROOT, probe, save

HEIGHT = 96


def tone(image):
    return np.clip(image / np.percentile(image, 99.8), 0, 1) ** (1 / 3)


def signed(control, density):
    """The grey control variate without its part in proportion to the density, as colours."""
    area = np.sin(np.pi * (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None]
    grey, density = control.mean(axis=2), density.mean(axis=2)
    grey = grey - density * (area * grey).sum() / (area * density).sum()
    strength = np.clip(np.abs(grey) / np.percentile(np.abs(grey), 99.5), 0, 1) ** (1 / 2)
    return np.where(grey[..., None] > 0, [0.84, 0.2, 0.25], [0.1, 0.45, 0.75]) * strength[..., None]


def main(covary, out, door):
    box = ROOT / "scenes/glossy-box.xml"
    no_lights = ["--set", "nee=off", "--set", "guiding-train=64"]
    places = [("box, floor", (box, "128x128", "64,117", no_lights)),
              ("box, metal", (box, "128x128", "64,42", no_lights)),
              ("door, floor", (door, "160x90", "80,78", ["--set", "guiding-train=32"]))]
    rows = []
    for title, (scene, resolution, pixel, options) in places:
        radiance, density, control = probe(covary, scene, pixel, HEIGHT, "--resolution", resolution, "--samples", "64",
                                           "--set", "cv=rgb", *options)
        rows.append((title, [tone(radiance), tone(density), signed(control, density)]))
    save(rows, ("radiance", "density", "control"), (12, 6.1), out)


if __name__ == "__main__":
    main(*sys.argv[1:])
