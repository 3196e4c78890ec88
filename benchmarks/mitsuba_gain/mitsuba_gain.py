# SPDX-License-Identifier: Apache-2.0
"""mitsuba_gain.py SCENE.xml… [--resolution 160x90] [--spp 48] [--seeds 3] [--reference-spp 1024]

How much less error covary.mitsuba has than Mitsuba's `path`, at equal samples and at equal processor time, and covary's
IICV than covary's `path`, on the same scenes. Errors are relMSE in product form against two references by Mitsuba (by
covary for its own renders), means over the seeds; gains have standard errors. Times are processor seconds of the whole
process after a first call that compiles. Needs the Python package covary, Mitsuba 3 and, if LLVM is not found,
DRJIT_LIBLLVM_PATH."""
import argparse
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import covary
import covary.mitsuba
import mitsuba as mi
import numpy


def load(path, width, height):
    """The scene at this size with a box filter, as covary.mitsuba renders it."""
    tree = ET.parse(path)
    for film in tree.iter("film"):
        for child in list(film):
            if child.tag == "rfilter" or child.get("name") in ("width", "height", "component_format"):
                film.remove(child)
        ET.SubElement(film, "rfilter", type="box")
        for name, value in (("width", width), ("height", height)):
            ET.SubElement(film, "integer", name=name, value=str(value))
    mi.file_resolver().prepend(str(Path(path).resolve().parent))
    return mi.load_string(ET.tostring(tree.getroot(), encoding="unicode"))


def timed(function, *arguments, **keywords):
    started = time.process_time()
    result = function(*arguments, **keywords)
    return result, time.process_time() - started


def path(scene, spp, seed):
    return numpy.array(mi.render(scene, spp=spp, seed=seed))


def relmse(images, references):
    return numpy.array([covary.metrics.relmse(image, *references) for image in images])


def gain(plain, ours):
    """Ratio of the mean errors, with its standard error to first order."""
    ratio = plain.mean() / ours.mean()
    relative = [errors.std(ddof=1) / errors.mean() / len(errors) ** 0.5 for errors in (plain, ours)]
    return f"{ratio:.2f} ± {ratio * numpy.hypot(*relative):.2f}"


def mitsuba_gains(scene, options):
    references = [path(scene, options.reference_spp, 1000 + n) for n in range(2)]
    ours, plain, seconds, plain_seconds = [], [], 0.0, 0.0
    covary.mitsuba.render(scene, options.spp, seed=50, estimator="iicv"), path(scene, options.spp, 50)  # compile
    for seed in range(options.seeds):
        result, taken = timed(covary.mitsuba.render, scene, options.spp, seed=100 + seed, estimator="iicv")
        ours.append(result.image)
        seconds += taken
        image, taken = timed(path, scene, options.spp, 200 + seed)
        plain.append(image)
        plain_seconds += taken
    longer = max(1, round(options.spp * seconds / plain_seconds))
    same_time = [path(scene, longer, 300 + seed) for seed in range(options.seeds)]
    error = relmse(ours, references)
    return relmse(plain, references), error, relmse(same_time, references), longer


def own_gain(file, options):
    scene = covary.Scene.load(file, resolution=options.resolution)
    references = [covary.render(scene, options.reference_spp, "none", seed=1000 + n, filter="box").image
                  for n in range(2)]
    errors = [relmse([covary.render(scene, options.spp, name, seed=100 + seed, filter="box").image
                      for seed in range(options.seeds)], references) for name in ("none", "iicv")]
    return gain(*errors)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--resolution", default="160x90")
    parser.add_argument("--spp", type=int, default=48)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--reference-spp", type=int, default=1024)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    options = parser.parse_args()
    options.resolution = tuple(map(int, options.resolution.split("x")))
    mi.set_variant(options.variant)
    print("| scene | path | IICV | gain, equal samples | gain, equal time | covary's own gain |\n"
          "|---|---|---|---|---|---|")
    for file in options.scenes:
        plain, ours, same_time, longer = mitsuba_gains(load(file, *options.resolution), options)
        name = Path(file).parent.name if Path(file).stem.startswith("scene") else Path(file).stem
        print(f"| {name} | {plain.mean():.4f} | {ours.mean():.4f} | {gain(plain, ours)} | {gain(same_time, ours)} "
              f"({longer} samples) | {own_gain(file, options)} |", flush=True)


main()
