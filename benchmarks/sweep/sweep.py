#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Does a picture depend on how its scene is written?

    sweep.py [--scenes 200] [--first 0] [--integrators path bdpt controlled-path guided-path] [--variants NAME...]

Random scenes (random_scenes.py) are rendered as they are, and moved, scaled, mirrored, and with the triangles and
vertices of their meshes in another order; scene i with integrator i modulo their number. The images must agree: t-tests
over the groups of samples, of the differences of the image mean and of 4 x 4 blocks of 8 x 8 pixels. The seeds are the
same, so that the noise cancels where the samples do not change. A pair with p < 0.01 in its 17 tests (Sidak) is
rendered again with 16 times the samples and another seed; it differs if p < 0.001 over all tests of all pairs rendered
again, and if the difference is above the variant's tolerance. Scenes of such pairs stay in --work; exit code 1 if there
are any for which covary did not warn that floats are too far apart. Needs NumPy and SciPy.
"""
import argparse
import pathlib
import shutil
import subprocess
import sys

import numpy
from scipy import stats

import random_scenes

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/cli")]

from exr_reader import read_exr  # noqa: E402

GROUPS, SIZE, BLOCK = 16, 32, 8


class RenderError(Exception):
    pass


def render(options, scene, integrator, spp, seed):
    """Grey images of the groups of samples, (groups, height, width), and whether covary warns that floats are too far
    apart where the scene stands."""
    out = scene.with_suffix(".exr")
    command = [options.covary, "render", str(scene), "-o", str(out), "--integrator", integrator, "--spp", str(spp),
               "--seed", str(seed), "--groups", str(GROUPS), "--threads", "1", "--estimator", "none", "--denoise",
               "none", "--no-preview", "--overwrite"]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        raise RenderError(f"{scene}: {run.stderr.strip()}")
    channels = read_exr(out.read_bytes())
    grey = numpy.stack([sum(numpy.array(channels[f"group{g:02}.{c}"]) for c in "RGB").reshape(SIZE, SIZE) / 3
                        for g in range(GROUPS)])
    return grey, "where floats are" in run.stderr


def means(grey):
    """Of the image and its blocks, (groups, 1 + blocks)."""
    n = SIZE // BLOCK
    blocks = grey.reshape(GROUPS, n, BLOCK, n, BLOCK).mean(axis=(2, 4)).reshape(GROUPS, n * n)
    return numpy.hstack([grey.mean(axis=(1, 2))[:, None], blocks])


def compare(first, other, variant):
    """The p-values of the pair's tests, and the relative differences."""
    a, b = means(first), means(other[:, :, ::-1] if variant.mirrors else other)
    difference = (b - a).mean(axis=0)
    error = (b - a).std(axis=0, ddof=1) / GROUPS ** 0.5
    level = numpy.maximum(a.mean(axis=0), b.mean(axis=0))
    with numpy.errstate(divide="ignore", invalid="ignore"):
        p = 2 * stats.t.sf(abs(difference) / error, GROUPS - 1)
        relative = numpy.where(level > 0, difference / level, 0)
    p[(difference == 0) | (abs(relative) < variant.tolerance)] = 1
    return p, relative


def sidak(p, n_tests):
    """The probability that the smallest of so many p-values is at most `p`."""
    return -numpy.expm1(n_tests * numpy.log1p(-min(p, 1 - 1e-16)))


class Sweep:
    def __init__(self, options):
        self.options = options
        self.work = pathlib.Path(options.work)
        self.variants = [v for v in random_scenes.variants() if v.name == "first" or v.name in options.variants]

    def pairs(self, index, spp, seed, variants):
        """Yields (variant, p-values, relative differences, whether covary warns) for a scene."""
        folder = self.work / f"scene{index}"
        folder.mkdir(parents=True, exist_ok=True)
        integrator = self.options.integrators[index % len(self.options.integrators)]
        first = None
        for variant in variants:
            scene = random_scenes.write_scene(index, variant, folder, integrator == "path")
            if not scene:
                continue
            image, warned = render(self.options, scene, integrator, spp, seed)
            if first is None:
                first = image
            else:
                yield variant, *compare(first, image, variant), warned

    def run(self):
        suspects, n_pairs, failed = {}, 0, 0
        for index in range(self.options.first, self.options.first + self.options.scenes):
            try:
                for variant, p, _, _ in self.pairs(index, self.options.spp, 1, self.variants):
                    n_pairs += 1
                    if sidak(p.min(), len(p)) < 0.01:
                        suspects.setdefault(index, []).append(variant)
            except RenderError as error:
                failed += 1
                print(error, file=sys.stderr)
            if index not in suspects:
                shutil.rmtree(self.work / f"scene{index}")
        print(f"{n_pairs} pairs of {self.options.scenes} scenes, {sum(map(len, suspects.values()))} rendered again",
              flush=True)
        return self.run_again(suspects) + failed

    def run_again(self, suspects):
        n_tests = 17 * sum(map(len, suspects.values()))
        n_differ = 0
        for index, variants in suspects.items():
            differs = False
            again = self.pairs(index, 16 * self.options.spp, 2, [self.variants[0], *variants])
            for variant, p, relative, warned in again:
                at = p.argmin()
                if sidak(p[at], n_tests) < 1e-3:
                    differs = True
                    n_differ += not warned
                    integrator = self.options.integrators[index % len(self.options.integrators)]
                    where = "image" if at == 0 else f"block ({(at - 1) % 4}, {(at - 1) // 4})"
                    print(f"scene {index} ({integrator}) {variant.name}: {where} {relative[at]:+.2%}, image "
                          f"{relative[0]:+.2%}, p = {p[at]:.1e}{', of which covary warns' if warned else ''}",
                          flush=True)
            if not differs:
                shutil.rmtree(self.work / f"scene{index}")
        print(f"{n_differ} pairs differ without a warning")
        return n_differ


def main(arguments):
    names = [variant.name for variant in random_scenes.variants()][1:]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=200, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="I", help="number of the first scene")
    parser.add_argument("--integrators", nargs="+", default=["path", "bdpt", "controlled-path", "guided-path"])
    parser.add_argument("--variants", nargs="+", default=names, choices=names, metavar="NAME", help=", ".join(names))
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--covary", default="build/release/covary", metavar="PROGRAM")
    parser.add_argument("--work", default="sweep_out", metavar="DIR")
    return 1 if Sweep(parser.parse_args(arguments)).run() else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
