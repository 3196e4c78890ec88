# SPDX-License-Identifier: Apache-2.0
"""Renders one scene with one Mitsuba variant in a separate process, because a process has only one variant, and its JIT
is warm after the first render. Called by against_mitsuba.py:

    mitsuba_worker.py seeds VARIANT SCENE.xml WIDTHxHEIGHT SPP DEPTH THREADS OUT_FOLDER SEED...
        writes OUT_FOLDER/seedNNN.npy (height, width, 3), one render per seed
    mitsuba_worker.py times VARIANT SCENE.xml WIDTHxHEIGHT SPP DEPTH THREADS OUT.json RENDERS
        writes the seconds of loading and of each of RENDERS renders (including read-back and EXR file)

DEPTH is 'own' or a number; THREADS 0 leaves the choice to Mitsuba (all cores).
"""
import json
import os
import pathlib
import resource
import sys
import time

import drjit
import mitsuba
import numpy

import scene_files


def load(scene, settings):
    text = scene_files.mitsuba_text(scene, settings)
    mitsuba.file_resolver().prepend(str(pathlib.Path(scene).resolve().parent))
    result = mitsuba.load_string(text)
    if mitsuba.variant().startswith("llvm"):
        drjit.sync_thread()
    return result


def render(scene, settings, seed):
    """The image as a NumPy array, which also waits for the JIT's threads."""
    return numpy.array(mitsuba.render(scene, seed=seed, spp=settings.spp))[..., :3]


def seeds(scene_file, settings, folder, numbers):
    scene = load(scene_file, settings)
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for number in numbers:
        image = render(scene, settings, int(number))
        temporary = folder / f"seed{int(number):03}.{os.getpid()}.tmp.npy"
        numpy.save(temporary, image.astype(numpy.float32))
        temporary.rename(folder / f"seed{int(number):03}.npy")


def times(scene_file, settings, out, renders):
    start = time.perf_counter()
    scene = load(scene_file, settings)
    result = {"load": time.perf_counter() - start, "render": []}
    for number in range(int(renders)):
        start = time.perf_counter()
        image = render(scene, settings, number)
        mitsuba.Bitmap(image).write(str(pathlib.Path(out).with_suffix(".exr")))
        result["render"].append(time.perf_counter() - start)
    result["peak_bytes"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    result["mitsuba"] = mitsuba.__version__
    pathlib.Path(out).write_text(json.dumps(result))


def main(arguments):
    what, variant, scene_file, size, spp, depth, threads, out, *rest = arguments
    mitsuba.set_variant(variant)
    if int(threads) > 0:
        drjit.set_thread_count(int(threads))
    width, height = map(int, size.split("x"))
    settings = scene_files.Settings(width, height, int(spp), None if depth == "own" else int(depth))
    if what == "seeds":
        seeds(scene_file, settings, out, rest)
    else:
        times(scene_file, settings, out, rest[0])


main(sys.argv[1:])
