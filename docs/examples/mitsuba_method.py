# SPDX-License-Identifier: Apache-2.0
"""Mitsuba 3 as a renderer of `covary experiment --renderer "mitsuba=python3 mitsuba_method.py"`: path tracing or, with
the argument `denoised`, what covary makes of Mitsuba's samples. It renders the scene, seed, budget and crop that it
finds in its environment."""
import os
import sys

import covary.mitsuba
import mitsuba as mi

spp, seed = int(os.environ["COVARY_SPP"]), int(os.environ["COVARY_SEED"])
width, height = int(os.environ["COVARY_WIDTH"]), int(os.environ["COVARY_HEIGHT"])
x, y, crop_width, crop_height = map(int, os.environ["COVARY_CROP"].split(","))
mi.set_variant("llvm_ad_rgb")  # or cuda_ad_rgb
scene = mi.load_file(os.environ["COVARY_SCENE"])
film = mi.traverse(scene.sensors()[0])
film["film.size"], film["film.crop_size"], film["film.crop_offset"] = (width, height), (crop_width, crop_height), (x, y)
film.update()
if "denoised" in sys.argv:
    image = covary.mitsuba.render(scene, spp=spp, seed=seed).image
else:
    image = mi.TensorXf(mi.render(scene, spp=spp, seed=seed)).numpy()[..., :3]
covary.write_image(os.environ["COVARY_OUTPUT"], image)
