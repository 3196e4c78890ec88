#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""guiding_integrals.py COVARY OUT.jpg: single integrals of docs/methods/guiding.md, as Figs. 3, 5 and 6 of Hua et al.
2023. COVARY: the program. Needs `pip install numpy matplotlib pillow`.

Rows are the skies of scenes/plane-under-sky.xml. From the left: the integrand, sky times BSDF and cosine; the density
of the mixture of half BSDF, half guiding; the control variate with one coefficient for all channels, and with one per
channel. Maps show the hemisphere above the plane, azimuth to the right, zenith at the top. A multiple of the density is
added to each control variate, which has no effect, such that its integral is that of the integrand."""
import sys

import numpy as np
from probes import ROOT, probe, save

SKIES = {"colours": "colour noise", "uniform": "uniform sky", "sun": "sun and sky"}
HEIGHT = 128
REFLECTANCE = 0.5
COS = np.cos(np.pi * (np.arange(HEIGHT // 2) + 0.5) / HEIGHT)[:, None, None]
AREA = 2 * np.pi**2 / (2 * HEIGHT**2) * np.sqrt(1 - COS**2)  # of a pixel, solid angle


def integrals(covary, sky, kind):
    """Integrand, density and control over the upper hemisphere."""
    images = probe(covary, ROOT / "scenes/plane-under-sky.xml", "16,16", HEIGHT, "-D", f"sky={sky}", "--set", "nee=off",
                   "--set", "guiding-leaf=300000", "--set", "guiding-train=98", "--set",
                   f"cv={kind}", "--set", "cv-train=98",
                   "--samples", "16")
    radiance, density, control = (image[: HEIGHT // 2] for image in images)
    return radiance * COS * REFLECTANCE / np.pi, density, control


def with_integral(control, density, integrand):
    missing = (AREA * (integrand - control)).sum(axis=(0, 1)) / (AREA * density).sum(axis=(0, 1))
    return control + missing * density


def main(covary, out):
    rows = []
    for sky, title in SKIES.items():
        integrand, density, mono = integrals(covary, sky, "mono")
        rgb = integrals(covary, sky, "rgb")[2]
        pictures = [integrand, density * integrand.mean() / density.mean(), with_integral(mono, density, integrand),
                    with_integral(rgb, density, integrand)]
        scale = np.percentile(integrand, 97 if sky == "sun" else 100)
        rows.append((title, [np.clip(picture / scale, 0, 1) ** (1 / 2.2) for picture in pictures]))
    save(rows, ("integrand", "density", "control, mono", "control, RGB"), (13, 3.1), out)


if __name__ == "__main__":
    main(*sys.argv[1:])
