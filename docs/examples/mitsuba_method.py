# SPDX-License-Identifier: Apache-2.0
"""Mitsuba 3 as a renderer of `covary experiment --renderer "mitsuba=python3 mitsuba_method.py"`: its image or, with the
argument `denoised`, what covary makes of its samples. It renders the scene, seed, budget and crop that it finds in its
environment, and says how long that took: like other methods' time, without the start of the program and loading the
scene, but with compiling Mitsuba's kernels where they are not in its cache."""
import os
import sys
import time

import covary.mitsuba
import drjit
import mitsuba as mi

if "COVARY_SPP" not in os.environ:
    sys.exit("mitsuba_method.py renders a number of samples: give --spp instead of --time")
spp, seed = int(os.environ["COVARY_SPP"]), int(os.environ["COVARY_SEED"])
width, height = int(os.environ["COVARY_WIDTH"]), int(os.environ["COVARY_HEIGHT"])
x, y, crop_width, crop_height = map(int, os.environ["COVARY_CROP"].split(","))
mi.set_variant("llvm_ad_rgb")  # or cuda_ad_rgb
if threads := int(os.environ["COVARY_THREADS"]):
    drjit.set_thread_count(threads)
    covary.set_threads(threads)
scene = mi.load_file(os.environ["COVARY_SCENE"])
film = mi.traverse(scene.sensors()[0])
film["film.size"], film["film.crop_size"], film["film.crop_offset"] = (width, height), (crop_width, crop_height), (x, y)
film.update()

if "Box" not in repr(scene.sensors()[0].film().rfilter()):
    sys.exit('the film needs <rfilter type="box"/>, as the images that it is compared with have')

began, of_processor = time.perf_counter(), time.process_time()
if "denoised" in sys.argv:
    image = covary.mitsuba.render(scene, spp=spp, seed=seed).image
else:
    image = mi.TensorXf(mi.render(scene, spp=spp, seed=seed)).numpy()[..., :3]
print("seconds", time.perf_counter() - began)
print("processor_seconds", time.process_time() - of_processor)
covary.write_image(os.environ["COVARY_OUTPUT"], image)
