# SPDX-License-Identifier: Apache-2.0
"""blender_gain.py [--resolution 160x96] [--spp 192] [--seeds 2] [--reference-spp 1024]

How much less error covary.blender has than Cycles in the closed room of tests/blender/room.py, at equal samples and at
equal processor time: against Cycles with its default sampler, without and with its denoiser. All have a box filter and
no clamp. Errors are relMSE in product form against two references, means over the seeds; times are processor seconds of
the whole process. Needs the Python packages covary and bpy."""
import argparse
import sys
import tempfile
import time
from pathlib import Path

import bpy
import covary
import covary.blender
import numpy

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests" / "blender"))
from covary import _cycles  # noqa: E402
from room import build_room  # noqa: E402

DEFAULT = "TABULATED_SOBOL" if bpy.app.version < (4, 2) else "AUTOMATIC"


def cycles(scene, spp, seed, sampler=DEFAULT, denoise=False):
    """A single render by Cycles; image and processor seconds."""
    with tempfile.TemporaryDirectory() as folder, _cycles.settings(scene):
        scene.cycles.sampling_pattern, scene.cycles.scrambling_distance = sampler, 1
        scene.cycles.samples, scene.cycles.seed, scene.cycles.use_denoising = spp, seed, denoise
        scene.render.filepath = str(Path(folder) / "image.exr")
        started = time.process_time()
        bpy.ops.render.render(write_still=True)
        seconds = time.process_time() - started
        return covary.read_image(scene.render.filepath), seconds


def ours(scene, spp, seed, **options):
    started = time.process_time()
    result = covary.blender.render(scene, spp, seed, **options)
    return result.image, time.process_time() - started


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resolution", default="160x96")
    parser.add_argument("--spp", type=int, default=192)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--reference-spp", type=int, default=1024)
    options = parser.parse_args()
    scene = build_room(bpy)
    scene.render.resolution_x, scene.render.resolution_y = map(int, options.resolution.split("x"))
    references = [cycles(scene, options.reference_spp, 5000 + n, "TABULATED_SOBOL")[0] for n in range(2)]
    cycles(scene, 4, 1)  # what the first render loads

    def show(name, spp, render):
        made = [render(seed) for seed in range(options.seeds)]
        error = numpy.mean([covary.metrics.relmse(image, *references) for image, _ in made])
        seconds = numpy.mean([taken for _, taken in made])
        print(f"| {name} | {spp} | {seconds:.1f} | {error:.5f} |", flush=True)
        return error, seconds

    print("| method | samples | processor seconds | relMSE |\n|---|---|---|---|")
    spp = options.spp
    _, seconds = show("covary, IICV", spp, lambda seed: ours(scene, spp, 10 + seed))
    show("covary, --denoise error", spp, lambda seed: ours(scene, spp, 10 + seed, denoise="error", oidn="off"))
    _, plain = show("Cycles", spp, lambda seed: cycles(scene, spp, 200 + seed))
    show("Cycles, its denoiser", spp, lambda seed: cycles(scene, spp, 200 + seed, denoise=True))
    longer = round(spp * seconds / plain)
    show("Cycles", longer, lambda seed: cycles(scene, longer, 300 + seed))
    show("Cycles, its denoiser", longer, lambda seed: cycles(scene, longer, 300 + seed, denoise=True))


main()
