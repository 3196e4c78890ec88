# SPDX-License-Identifier: Apache-2.0
"""Compares error maps, and where renders with a target error stop, with the truth.

    maps    the error map of a single render, StdError^2 over brightness, against the mean error of many seeds: rank
            correlation (Spearman) over 16 x 9 regions of the image
    stops   true relMSE over the goal of --until relmse=GOAL, and the bounds that the interval gives

Scenes are those of scenes/ ("room"), variants of them ("room-turned"), or those of --scenes ("kitchen"). Errors are in
product form over two references, and relative to the denoised references (docs/notes/error-estimates.md explains why).
Films stay in --work. Needs NumPy, and Open Image Denoise where COVARY_OIDN or the environment has it.
"""
import argparse
import itertools
import json
import math
import os
import sys
from pathlib import Path
from typing import NamedTuple

import numpy

HERE = Path(__file__).resolve().parent
sys.path.append(os.fspath(HERE.parent / "denoising"))
from denoising import Scene, geometric_mean, read_image  # noqa: E402
from layers import read_layers  # noqa: E402
from variants import VARIANTS, write_variant  # noqa: E402

REGIONS = (16, 9)
#: Of renders that tell which error so many samples have; errors over a goal that bounds should have told
PILOT_SEED, MOST_OVER = 101, 1.5
OWN = HERE.parent.parent / "scenes"
#: Wanted errors that take a hundred samples or some, so that there is a second look
GOALS = {"room": 0.0008, "glossy-box": 0.0009, "materials": 0.0012, "box": 0.00008,
         "kitchen": 0.0045, "house": 0.0013, "staircase": 0.002, "bathroom2": 0.004}


class Measured(Scene):
    """A scene whose errors are measured."""

    def __init__(self, options, name):
        if name in VARIANTS or (OWN / f"{name}.xml").exists():
            self.options, self.name, self.path = options, name, OWN / f"{name}.xml"
            self.folder = options.work / name
            self.folder.mkdir(parents=True, exist_ok=True)
            if not self.path.exists():
                self.path, *parameters = write_variant(name, OWN, self.folder)
                assert not parameters, f"{name} has parameters"
            self.resolution = f"{options.width}x{round(options.width * 9 / 16)}"
        else:
            super().__init__(options, name)
        guide = self.folder / "guide.exr"
        if not guide.exists():
            self.run("denoise", *self.references(), "-o", guide, "--quiet", "--force")
        self.weight = 1 / (read_image(guide).mean(2, keepdims=True)**2 + 0.01)
        self.truth = [read_image(path) for path in self.references()]

    def error_map(self, image):
        """Relative squared error of each pixel, without that of the references."""
        return (self.weight * (image - self.truth[0]) * (image - self.truth[1])).mean(2)


def regions(errors):
    """Means over REGIONS."""
    return numpy.array([part.mean() for rows in numpy.array_split(errors, REGIONS[1], 0)
                        for part in numpy.array_split(rows, REGIONS[0], 1)])


def spearman(a, b):
    """Rank correlation; equal values get ranks in their order."""
    ranks = [numpy.argsort(numpy.argsort(values)) for values in (a, b)]
    return numpy.corrcoef(*ranks)[0, 1]


def maps(options, scene):
    for spp in options.spp:
        films = [scene.render("auto", spp, seed) for seed in options.seeds]
        images = [read_image(film) for film in films]
        truth = regions(sum(map(scene.error_map, images)) / len(images))
        found = []
        for film, image in zip(films, images, strict=True):
            squares = read_layers(film, "StdError")[0]**2
            found.append(spearman(regions((squares / (image.mean(2, keepdims=True)**2 + 0.01)).mean(2)), truth))
        halves = [regions(sum(map(scene.error_map, images[half::2]))) for half in (0, 1)]
        print(f"{scene.name}, {spp} samples, {len(films)} seeds: Spearman {numpy.mean(found):.2f} in the mean, "
              f"{min(found):.2f} to {max(found):.2f}; of the true map of one half of the seeds with the other's "
              f"{spearman(*halves):.2f}", flush=True)


class Stop(NamedTuple):
    """Where a render with a target error stopped: samples per pixel; then, relative to the target, the error, its
    prediction, and the bounds of the interval, None if none was given."""
    samples: float
    true: float
    told: float
    low: float | None
    high: float | None

    def text(self):
        bounds = f"{self.low:.2f} to {self.high:.2f}" if self.high else "no bounds"
        return f"{self.samples:g} samples, true over goal {self.true:.2f}, told {self.told:.2f}, {bounds}"


def stops(options, scene, spp):
    """A stop for each seed. If the scene has no target of its own, it is the error of a render of `spp` samples."""
    goal = options.goal or GOALS.get(scene.name)
    if not goal:
        goal = float(f"{scene.error_map(read_image(scene.render('auto', spp, PILOT_SEED))).mean():.2g}")
    noise = (scene.weight * (scene.truth[0] - scene.truth[1])**2 / 4).mean(2).std() / math.sqrt(scene.weight.size)
    found = []
    for seed in options.seeds:
        facts, image = scene.folder / "until.json", scene.folder / "until.exr"
        scene.run("render", scene.path, "--resolution", scene.resolution, "--until", f"relmse={goal}", "--spp", 2000,
                  "--seed", seed, "--no-preview", "--quiet", "--overwrite", "-o", image, "--json", facts)
        told = json.loads(facts.read_text())
        bounds = [told[f"predicted_relmse_{end}"] / goal if f"predicted_relmse_{end}" in told else None
                  for end in ("low", "high")]
        found.append(Stop(told["samples_per_pixel"], scene.error_map(read_image(image)).mean() / goal,
                          told["predicted_relmse"] / goal, *bounds))
        print(f"{scene.name}, goal {goal}, seed {seed}: {found[-1].text()}", flush=True)
    ratios = [stop.true for stop in found]
    print(f"{scene.name}, goal {goal}: {geometric_mean(ratios):.2f} in the geometric mean, {min(ratios):.2f} to "
          f"{max(ratios):.2f}, noise of the references {noise / goal:.2f}", flush=True)
    return found


def summary(found):
    """How well renders met their targets, and whether bounds warned of those that missed them by MOST_OVER or more."""
    ratios = [stop.true for stop in found]
    given = [stop for stop in found if stop.high]
    over = [stop for stop in found if stop.true > MOST_OVER]
    print(f"all: {geometric_mean(ratios):.2f} in the geometric mean, {min(ratios):.2f} to {max(ratios):.2f}, "
          f"{math.exp(numpy.std(numpy.log(ratios))):.2f} times or over; bounds of {len(given)} of {len(found)}, of "
          f"which {sum(stop.low <= stop.true <= stop.high for stop in given)} hold; {len(over)} above {MOST_OVER}, of "
          f"which bounds denied {sum(bool(stop.high and stop.high < MOST_OVER) for stop in over)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["maps", "stops"])
    parser.add_argument("names", nargs="*", default=["room", "glossy-box", "materials", "box"])
    parser.add_argument("--scenes", type=Path, default=OWN, help="folder with a folder for each scene")
    parser.add_argument("--work", type=Path, default=Path("maps-and-stops"), help="keeps films and images")
    parser.add_argument("--covary", default=os.fspath(HERE.parent.parent / "build/release/covary"))
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64], help="of maps")
    parser.add_argument("--seeds", type=int, nargs="+", help="default: 1 to 20 of maps, 1 to 3 of stops")
    parser.add_argument("--goal", type=float, help="in place of the scene's own")
    parser.add_argument("--goal-spp", type=int, nargs="+", default=[96],
                        help="where a scene has no goal: the error of so many samples; several numbers take turns")
    parser.add_argument("--reference-spp", type=int, default=512, help="of each of two references")
    parser.add_argument("--width", type=int, default=160, help="pixels of the longer side")
    options = parser.parse_args()
    options.turned = False
    options.seeds = options.seeds or range(1, 21 if options.what == "maps" else 4)
    if options.what == "maps":
        for name in options.names:
            maps(options, Measured(options, name))
        return
    turns = zip(options.names, itertools.cycle(options.goal_spp))
    summary([stop for name, spp in turns for stop in stops(options, Measured(options, name), spp)])


if __name__ == "__main__":
    main()
