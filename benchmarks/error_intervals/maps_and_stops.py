# SPDX-License-Identifier: Apache-2.0
"""Where errors are told to be, and where renders to a wanted error end, against the truth.

    maps    the error map of a single render, StdError^2 over brightness, against the mean error of many seeds: rank
            correlation (Spearman) over 16 x 9 regions of the image
    stops   true relMSE over the goal of --until relmse=GOAL

Scenes are those of scenes/ ("room"), or of --scenes ("kitchen"). Errors are in product form over two references, and
relative to the denoised references (docs/notes/error-estimates.md tells why). Films stay in --work. Needs NumPy, and
Open Image Denoise where COVARY_OIDN or the environment has it.
"""
import argparse
import json
import math
import os
import sys
from pathlib import Path

import numpy

HERE = Path(__file__).resolve().parent
sys.path.append(os.fspath(HERE.parent / "denoising"))
from denoising import Scene, geometric_mean, read_image  # noqa: E402
from layers import read_layers  # noqa: E402

REGIONS = (16, 9)
OWN = HERE.parent.parent / "scenes"
#: Wanted errors that take a hundred samples or some, so that there is a second look
GOALS = {"room": 0.0008, "glossy-box": 0.0009, "materials": 0.0012, "box": 0.0007,
         "kitchen": 0.0045, "house": 0.0013, "staircase": 0.002, "bathroom2": 0.004}


class Measured(Scene):
    """A scene whose errors are measured."""

    def __init__(self, options, name):
        if (OWN / f"{name}.xml").exists():
            self.options, self.name, self.path = options, name, OWN / f"{name}.xml"
            self.folder = options.work / name
            self.folder.mkdir(parents=True, exist_ok=True)
            self.resolution = f"{options.width}x{round(options.width * 9 / 16)}"
        else:
            super().__init__(options, name)
        guide = self.folder / "guide.exr"
        if not guide.exists():
            self.run("denoise", *self.references(), "-o", guide, "--quiet", "--force")
        self.weight = 1 / (read_image(guide).mean(2, keepdims=True)**2 + 0.01)
        self.truth = [read_image(path) for path in self.references()]

    def error_map(self, image):
        """Squared error of each pixel, relative, without that of the references."""
        return (self.weight * (image - self.truth[0]) * (image - self.truth[1])).mean(2)


def regions(errors):
    """Means over REGIONS."""
    return numpy.array([part.mean() for rows in numpy.array_split(errors, REGIONS[1], 0)
                        for part in numpy.array_split(rows, REGIONS[0], 1)])


def spearman(a, b):
    """Correlation of ranks; equal values get ranks in their order."""
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


def stops(options, scene):
    goal = options.goal or GOALS[scene.name]
    found = []
    for seed in options.seeds:
        facts = scene.folder / "until.json"
        image = scene.folder / "until.exr"
        scene.run("render", scene.path, "--resolution", scene.resolution, "--until", f"relmse={goal}", "--spp", 2000,
                  "--seed", seed, "--no-preview", "--quiet", "--overwrite", "-o", image, "--json", facts)
        told = json.loads(facts.read_text())
        true = scene.error_map(read_image(image)).mean()
        found.append(true / goal)
        print(f"{scene.name}, goal {goal}, seed {seed}: {told['samples_per_pixel']:g} samples, told over goal "
              f"{told['predicted_relmse'] / goal:.2f}, true over goal {true / goal:.2f}", flush=True)
    print(f"{scene.name}: {geometric_mean(found):.2f} in the geometric mean", flush=True)
    return found


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
    parser.add_argument("--reference-spp", type=int, default=512, help="of each of two references")
    parser.add_argument("--width", type=int, default=160, help="pixels of the longer side")
    options = parser.parse_args()
    options.turned = False
    options.seeds = options.seeds or range(1, 21 if options.what == "maps" else 4)
    if options.what == "maps":
        for name in options.names:
            maps(options, Measured(options, name))
        return
    found = [ratio for name in options.names for ratio in stops(options, Measured(options, name))]
    print(f"all: {geometric_mean(found):.2f} in the geometric mean, {min(found):.2f} to {max(found):.2f}, "
          f"{math.exp(numpy.std(numpy.log(found))):.2f} times or over")


if __name__ == "__main__":
    main()
