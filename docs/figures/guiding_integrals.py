#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""guiding_integrals.py COVARY OUT.jpg: single integrals of docs/methods/guiding.md, as Figs. 3, 5 and 6 of Hua et al.
2023. COVARY: the program. Needs `pip install numpy matplotlib pillow`.

Rows are the skies of scenes/plane-under-sky.xml. From the left: the integrand, sky times BSDF and cosine; the density
of half BSDF, half guide; the control variate with one coefficient for all channels, and with one for each. Directions
above the plane, azimuth to the right, the zenith above. A control is shown with that multiple of the density added for
which its integral is that of the integrand: such a multiple has no effect."""
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

SKIES = {"colours": "colour noise", "uniform": "uniform sky", "sun": "sun and sky"}
HEIGHT = 128
REFLECTANCE = 0.5
COS = np.cos(np.pi * (np.arange(HEIGHT // 2) + 0.5) / HEIGHT)[:, None, None]
AREA = 2 * np.pi**2 / (2 * HEIGHT**2) * np.sqrt(1 - COS**2)  # of a pixel, solid angle


def probe(covary, sky, kind):
    """Integrand, density and control over the upper hemisphere."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "probe.exr"
        subprocess.run([covary, "probe", str(ROOT / "scenes/plane-under-sky.xml"), "-D", f"sky={sky}", "--pixel",
                        "16,16", "--nee", "off", "--guide-leaf", "300000", "--guide-train", "98", "--cv", kind,
                        "--cv-train", "98", "--height", str(HEIGHT), "--samples", "16", "-o", str(out)], check=True)
        channels = read_exr(out.read_bytes())
    image = np.array([channels[c] for c in "RGB"]).T.reshape(HEIGHT, 3, 2 * HEIGHT, 3)[: HEIGHT // 2]
    radiance, density, control = (image[:, i] for i in range(3))
    return radiance * COS * REFLECTANCE / np.pi, density, control


def with_integral(control, density, integrand):
    missing = (AREA * (integrand - control)).sum(axis=(0, 1)) / (AREA * density).sum(axis=(0, 1))
    return control + missing * density


def main(covary, out):
    figure, axes = pyplot.subplots(3, 4, figsize=(13, 3.1))
    for (sky, title), row in zip(SKIES.items(), axes):
        integrand, density, mono = probe(covary, sky, "mono")
        rgb = probe(covary, sky, "rgb")[2]
        pictures = [integrand, density * integrand.mean() / density.mean(), with_integral(mono, density, integrand),
                    with_integral(rgb, density, integrand)]
        scale = np.percentile(integrand, 97 if sky == "sun" else 100)
        for axis, picture, name in zip(row, pictures, ("integrand", "density", "control, mono", "control, RGB")):
            axis.imshow(np.clip(picture / scale, 0, 1) ** (1 / 2.2), aspect="auto")
            axis.set_xticks([]), axis.set_yticks([])
            if sky == "colours":
                axis.set_title(name, fontsize=10)
        row[0].set_ylabel(title, fontsize=9)
    figure.tight_layout()
    figure.savefig(out, dpi=75)


if __name__ == "__main__":
    main(*sys.argv[1:])
