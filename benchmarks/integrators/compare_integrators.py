#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Have two ways to render a scene the same expectation? And how much noise has each?

    compare_integrators.py --scenes DIR [--first "--integrator path"] [--second "--integrator controlled-path"] [NAME]

Renders every scene of DIR in a small frame with R seeds of each, and tests by Welch's t over the renders, not the
pixels, whether the means of the image and of 8 x 8 blocks differ (../against_mitsuba/agreement.py). The noise is the
mean over blocks, relative to the squared mean + 0.01, of the variance over the seeds, without the largest 1 %: its
ratio says how many times fewer samples the second needs. `detects`: smallest relative difference of the image's mean
that is found with power 0.99. Needs `pip install numpy scipy`.
"""
import argparse
import pathlib
import shlex
import subprocess
import sys
import tempfile

import numpy

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "benchmarks/against_mitsuba"), str(ROOT / "tests/cli")]

import scene_files  # noqa: E402
from agreement import agreement  # noqa: E402
from exr_reader import read_exr  # noqa: E402


def render(options, scene, words, seed, spp, folder):
    """One image as an array (height, width, 3)."""
    out = pathlib.Path(folder) / "image.exr"
    width, height = (int(side) for side in options.resolution.split("x"))
    command = [options.covary, "render", str(scene), "-o", str(out), "--resolution", options.resolution, "--spp",
               str(spp), "--seed", str(seed), "--rfilter", "box", "--max-depth", str(options.max_depth), "--estimator",
               "none", "--no-preview", "--quiet", *words]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    channels = read_exr(out.read_bytes())
    return numpy.array([channels[name] for name in "RGB"]).T.reshape(height, width, 3)


def noise(images):
    """Trimmed mean of the relative variance of pixels over the seeds."""
    values = images.var(axis=0, ddof=1) / (images.mean(axis=0) ** 2 + 0.01)
    return numpy.sort(values.ravel())[: int(0.99 * values.size)].mean()


def compare(options, scene):
    sides = []
    with tempfile.TemporaryDirectory() as folder:
        for side, words in enumerate((options.first, options.second)):
            # Other seeds on either side, so that the renders share no random numbers.
            sides.append(numpy.stack([render(options, scene, shlex.split(words), seed + 1 + side * 1000, options.spp,
                                             folder) for seed in range(options.seeds)]))
    return agreement(*sides, options.alpha), noise(sides[0]) / noise(sides[1])


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenes; all of the folder when absent")
    parser.add_argument("--scenes", required=True, metavar="DIR", help="folder with one sub-folder per scene")
    parser.add_argument("--covary", default="build/release/covary", metavar="PROGRAM")
    parser.add_argument("--first", default="--integrator path", help="options of the one side")
    parser.add_argument("--second", default="--integrator controlled-path", help="options of the other")
    parser.add_argument("--resolution", default="32x24", metavar="WxH")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--max-depth", type=int, default=5)
    parser.add_argument("--seeds", type=int, default=16, help="renders of each side")
    parser.add_argument("--alpha", type=float, default=1e-3, help="false-positive probability of a scene's test")
    options = parser.parse_args(arguments)
    print("| scene | mean ratio | detects | largest t of blocks | differs | noise ratio |\n|---|---|---|---|---|---|")
    n_differ = 0
    for name, scene in scene_files.find(options.scenes, options.names).items():
        result, ratio = compare(options, scene)
        differs = result.mean.rejects(options.alpha) or result.blocks.rejects(options.alpha)
        n_differ += differs
        print(f"| {name} | {result.ratio:.4f} ± {result.ratio_error:.4f} | {result.mean.detectable[-1]:.1%} | "
              f"{abs(result.blocks.t).max():.1f} of {result.blocks.tests} | {'yes' if differs else 'no'} | "
              f"{ratio:.2f} |", flush=True)
    return 1 if n_differ else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
