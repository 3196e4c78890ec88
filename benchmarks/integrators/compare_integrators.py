#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Do two ways to render a scene have the same expected image, and how much noise does each have?

    compare_integrators.py --scenes DIR [--first "--integrator path"] [--second "--integrator controlled-path"] [NAME]

Welch's t-test over R independent images of each, not over pixels, tells whether the means of the image and of 8 x 8
blocks differ (../against_mitsuba/agreement.py). The images are the R groups of samples of one film, which share one
training. With --each-trained they are R renders, each with its own seed and training, whose samples are part of the
image. The noise is the variance over the images, relative to the squared mean + 0.01, averaged over pixels without the
largest 1 %. The ratio of noises says how many times fewer samples the second way needs, including its training samples.
`detects` is the smallest relative difference of the image means that is found with power 0.99. Needs
`pip install numpy scipy`.
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
    """The channels of one render, arrays (height, width) by name."""
    out = pathlib.Path(folder) / "image.exr"
    command = [options.covary, "render", str(scene), "-o", str(out), "--resolution", options.resolution, "--spp",
               str(spp), "--seed", str(seed), "--rfilter", "box", "--max-depth", str(options.max_depth), "--estimator",
               "none", "--no-preview", "--overwrite", "--quiet", *words]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    width, height = (int(side) for side in options.resolution.split("x"))
    return {name: numpy.array(values).reshape(height, width) for name, values in read_exr(out.read_bytes()).items()}


def images(options, scene, words, first_seed):
    """Independent images of a scene, an array (R, height, width, 3)."""
    with tempfile.TemporaryDirectory() as folder:
        if options.each_trained:
            renders = [render(options, scene, words, first_seed + i, options.spp, folder)
                       for i in range(options.images)]
            return numpy.stack([[channels[name] for name in "RGB"] for channels in renders]).transpose(0, 2, 3, 1)
        channels = render(options, scene, [*words, "--groups", str(options.images)], first_seed,
                          options.spp * options.images, folder)
        return numpy.stack([[channels[f"group{i:02}.{name}"] for name in "RGB"]
                            for i in range(options.images)]).transpose(0, 2, 3, 1)


def noise(images):
    """Trimmed mean of the relative variance of pixels over the seeds."""
    values = images.var(axis=0, ddof=1) / (images.mean(axis=0) ** 2 + 0.01)
    return numpy.sort(values.ravel())[: int(0.99 * values.size)].mean()


def compare(options, scene):
    # Other seeds on either side, so that the renders share no random numbers.
    sides = [images(options, scene, shlex.split(words), options.seed + 1000 * side)
             for side, words in enumerate((options.first, options.second))]
    return agreement(*sides, options.alpha), noise(sides[0]) / noise(sides[1])


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenes; all of the folder when absent")
    parser.add_argument("--scenes", required=True, metavar="DIR", help="folder with one sub-folder per scene")
    parser.add_argument("--covary", default="build/release/covary", metavar="PROGRAM")
    parser.add_argument("--first", default="--integrator path", help="options of the one side")
    parser.add_argument("--second", default="--integrator controlled-path", help="options of the other")
    parser.add_argument("--resolution", default="32x24", metavar="WxH")
    parser.add_argument("--spp", type=int, default=32, help="samples per pixel of each image")
    parser.add_argument("--seed", type=int, default=1, help="the first one")
    parser.add_argument("--max-depth", type=int, default=5)
    parser.add_argument("--images", type=int, default=16, metavar="R", help="independent images of each side")
    parser.add_argument("--each-trained", action="store_true",
                        help="renders of their own in place of one film's groups of samples")
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
