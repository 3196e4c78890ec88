#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Gains of Table 1, Fig. 9 and the columns of Vévoda in Hua et al. 2023, beside the published ones. Needs numpy. Five
scenes at the published size take some three hours of processor time for ten runs of each method.

Every run is an image of 128 samples, of which methods with control take 8 for training, which are part of it. The error
is the variance between the runs of a method, relative to the squared mean of all methods' images + 0.01, without the
largest 0.1 % of the values, and, in brackets, with them. The gain is the error without control over that with it."""
import argparse
import subprocess
import sys
from pathlib import Path

import numpy

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "cli"))
from exr_reader import read_exr  # noqa: E402

COMMON = ("--rfilter", "box", "--max-depth", "5", "--integrator", "controlled-path", "--estimator", "none", "--set",
          "lights=triangle", "--no-preview", "--quiet")
METHODS = {"no control": ("--set", "cv=off"), "as published": ("--cv-paper",),
           "Vévoda": ("--cv-paper", "--set", "cv=vevoda"), "absolute": ("--cv-paper", "--set", "cv-variance=absolute")}
GRIDS = {"grid 16": ("--cv-paper", "--set", "cv-grid=16"),
         "grid 256": ("--cv-paper", "--set", "cv-grid=256")}
PUBLISHED = {
    "cms-diningroom2": {"as published": 2.20, "Vévoda": 1.35}, "cms-rgbsofa": {"as published": 2.17, "Vévoda": 1.95},
    "cms-bathroom": {"as published": 1.03, "Vévoda": 1.03}, "cms-veachmis": {"as published": 1.78, "Vévoda": 1.09},
    "cms-modernhall": {"as published": 3.52, "Vévoda": 1.34, "grid 16": 1.51, "grid 256": 1.23}}


def read_image(path):
    channels = read_exr(path.read_bytes())
    return numpy.array([channels[c] for c in "RGB"], float)


def relative_variances(images, mean):
    """Unbiased variance of an image, from independent ones, relative to the squared mean + 0.01."""
    return numpy.var(images, axis=0, ddof=1) / (mean ** 2 + 0.01)


def mean_without_largest(values, dropped):
    kept = round(values.size * (1 - dropped))
    return numpy.sort(values, axis=None)[:kept].mean()


def gains(images, dropped):
    """The error without control, and by how much each method divides it. `images`: of each method's runs."""
    mean = numpy.mean([image for runs in images.values() for image in runs], axis=0)
    errors = {method: mean_without_largest(relative_variances(runs, mean), dropped) for method, runs in images.items()}
    return errors["no control"], {method: errors["no control"] / error for method, error in errors.items()}


def render(options, scene, method, words, run):
    path = options.folder / f"{scene}-{method}-{options.size}-{options.spp}-{run}.exr"
    if not path.exists():
        seed = 1000 * (1 + [*METHODS, *GRIDS].index(method)) + run
        subprocess.run([options.covary, "render", options.scenes / scene / "scene.xml", *COMMON, *words, "--spp",
                        str(options.spp), "--resolution", options.size, "--seed", str(seed), "-o", path], check=True)
    return read_image(path)


def main(options):
    options.folder.mkdir(exist_ok=True)
    for scene in options.scene or PUBLISHED:
        methods = METHODS | (GRIDS if scene == "cms-modernhall" else {})
        images = {method: [render(options, scene, method, words, run) for run in range(options.runs)]
                  for method, words in methods.items() if method in (options.method or methods)}
        error, trimmed = gains(images, 0.001)
        everything = gains(images, 0)[1]
        print(f"{scene}: relMSE without control {error:.4f}")
        for method in images:
            published = PUBLISHED[scene].get(method)
            print(f"    {method}: {trimmed[method]:.2f} ({everything[method]:.2f})" +
                  (f", published {published}" if published else ""), flush=True)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("covary")
    parser.add_argument("scenes", type=Path, help="folder of the scenes")
    parser.add_argument("folder", type=Path, help="for the renders, which are kept and used again")
    parser.add_argument("scene", nargs="*", help="default: " + ", ".join(PUBLISHED))
    parser.add_argument("--method", action="append", choices=[*METHODS, *GRIDS],
                        help="may be repeated, and must include 'no control'; default: all")
    parser.add_argument("--runs", type=int, default=10, help="of each method, at least 2; default: 10, as published")
    parser.add_argument("--size", default="640x480", help="of the frame; default: 640x480, as published")
    parser.add_argument("--spp", type=int, default=128, help="samples per pixel; default: 128, as published")
    return parser.parse_args()


if __name__ == "__main__":
    main(arguments())
