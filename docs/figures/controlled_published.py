#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""controlled_published.py COVARY SCENES FOLDER [SCENE...]: gains of Table 1, Fig. 9 and the columns of Vévoda in Hua
et al. 2023, 640 x 480 pixels, from one render of each method, which FOLDER keeps. Needs numpy; five scenes take some
ten minutes of processor time.

The variance of an image is that between its two groups, relative to the squared mean of all methods' images + 0.01,
without the largest 0.1 %. Images have 40 samples; gains are converted to 128 of which 8 are training samples, which are
part of the image: V = 1 / (120 / v + 8 / v0), with v and v0 the variance of a sample with and without control."""
import subprocess
import sys
from pathlib import Path

import numpy

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "cli"))
from exr_reader import header, read_exr  # noqa: E402

COMMON = ("--resolution", "640x480", "--rfilter", "box", "--max-depth", "5", "--integrator", "controlled-path",
          "--estimator", "none", "--spp", "40", "--groups", "2", "--lights", "triangle", "--no-preview", "--quiet")
METHODS = {"no control": ("--cv", "off"), "as published": ("--cv-paper",),
           "Vévoda": ("--cv-paper", "--cv", "vevoda"), "absolute": ("--cv-paper", "--cv-variance", "absolute")}
GRIDS = {"grid 16": ("--cv-paper", "--cv-grid", "16"),
         "grid 256": ("--cv-paper", "--cv-grid", "256", "--cv-memory", "4096")}
SCENES = ("cms-diningroom2", "cms-rgbsofa", "cms-bathroom", "cms-veachmis", "cms-modernhall")


class Groups:
    def __init__(self, path):
        data = path.read_bytes()
        channels = read_exr(data)
        self.groups = [numpy.array([channels[f"group{g:02}.{c}"] for c in "RGB"], float) for g in range(2)]
        self.samples = int(header(data)[0]["covary:samples"])
        self.mean = sum(self.groups) / 2

    def sample_variance(self, mean, dropped=0.001):
        variances = ((self.groups[0] - self.groups[1]) ** 2 / 4 / (mean ** 2 + 0.01)).ravel()
        kept = round(variances.size * (1 - dropped))
        return self.samples * numpy.partition(variances, kept - 1)[:kept].mean()


def main(covary, scenes, folder, *names):
    Path(folder).mkdir(exist_ok=True)
    for scene in names or SCENES:
        films = {}
        for seed, (method, options) in enumerate((METHODS | (GRIDS if "hall" in scene else {})).items(), 7):
            path = Path(folder) / f"{scene}-{method}.exr"
            if not path.exists():
                subprocess.run([covary, "render", f"{scenes}/{scene}/scene.xml", *COMMON, *options, "--seed", str(seed),
                                "-o", path], check=True)
            films[method] = Groups(path)
        mean = sum(film.mean for film in films.values()) / len(films)
        for dropped, what in ((0.001, "trimmed"), (0, "all")):
            plain = films["no control"].sample_variance(mean, dropped)
            print(f"{scene}, {what}: relMSE without control {plain / 128:.4f}", end="")
            for method, film in films.items():
                gain = (120 * plain / film.sample_variance(mean, dropped) + 8) / 128
                print(f"; {method} {gain:.2f}", end="" if method != list(films)[-1] else "\n")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
