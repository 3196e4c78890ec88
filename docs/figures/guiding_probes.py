#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""guiding_probes.py COVARY OUT.jpg DOOR.xml: what guided paths have learnt at three surfaces, for
docs/methods/guiding.md. COVARY: the program; DOOR.xml: Veach's ajar door, which is not part of the repository. Needs
`pip install numpy matplotlib pillow`.

Rows: the floor and the back wall, of rough metal, of scenes/glossy-box.xml, and the floor before the door. From the
left: radiance that arrives; density of the mixture of BSDF and guide; control variate (red: positive, blue: negative),
a multiple of the density added for which its integral is 0, since such multiples have no effect. All directions,
azimuth to the right, +y above; brightness by a power of 1/3, up to the 99.8th percentile."""
import pathlib
import subprocess
import sys
import tempfile

import matplotlib
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/cli"))
matplotlib.use("Agg")
from exr_reader import read_exr  # noqa: E402
from matplotlib import pyplot  # noqa: E402

HEIGHT = 96


def probe(covary, scene, resolution, pixel, options):
    """Radiance, density and control in all directions."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "probe.exr"
        subprocess.run([covary, "probe", str(scene), "--resolution", resolution, "--pixel", pixel, "--height",
                        str(HEIGHT), "--samples", "64", "--cv", "rgb", *options, "-o", str(out)], check=True)
        channels = read_exr(out.read_bytes())
    image = np.array([channels[c] for c in "RGB"]).T.reshape(HEIGHT, 3, 2 * HEIGHT, 3)
    return [image[:, i] for i in range(3)]


def tone(image):
    return np.clip(image / np.percentile(image, 99.8), 0, 1) ** (1 / 3)


def signed(control, density):
    """Grey control without its part in proportion to the density, as colours."""
    area = np.sin(np.pi * (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None]
    grey, density = control.mean(axis=2), density.mean(axis=2)
    grey = grey - density * (area * grey).sum() / (area * density).sum()
    strength = np.clip(np.abs(grey) / np.percentile(np.abs(grey), 99.5), 0, 1) ** (1 / 2)
    return np.where(grey[..., None] > 0, [0.84, 0.2, 0.25], [0.1, 0.45, 0.75]) * strength[..., None]


def main(covary, out, door):
    box = ROOT / "scenes/glossy-box.xml"
    no_lights = ["--nee", "off", "--guide-train", "64"]
    rows = [("box, floor", (box, "128x128", "64,117", no_lights)), ("box, metal", (box, "128x128", "64,42", no_lights)),
            ("door, floor", (door, "160x90", "80,78", ["--guide-train", "32"]))]
    figure, axes = pyplot.subplots(3, 3, figsize=(12, 6.1))
    for (title, where), row in zip(rows, axes):
        radiance, density, control = probe(covary, *where)
        for axis, image, name in zip(row, (tone(radiance), tone(density), signed(control, density)),
                                     ("radiance", "density", "control")):
            axis.imshow(image, aspect="auto")
            axis.set_xticks([]), axis.set_yticks([])
            if row is axes[0]:
                axis.set_title(name, fontsize=10)
        row[0].set_ylabel(title, fontsize=9)
    figure.tight_layout()
    figure.savefig(out, dpi=75)


if __name__ == "__main__":
    main(*sys.argv[1:])
