#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""denoise_mitsuba.py SCENE.xml [SAMPLES]: two renders by Mitsuba 3 with different seeds, a.exr and b.exr. Then:

    covary denoise a.exr b.exr -o out.exr
"""
import sys

import mitsuba as mi

mi.set_variant("scalar_rgb")  # "llvm_ad_rgb" where LLVM is installed: 2 to 8 times as fast
scene = mi.load_file(sys.argv[1])
samples = int(sys.argv[2]) if len(sys.argv) > 2 else 64
integrator = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,sh_normal:sh_normal", "image": scene.integrator()})
for seed, name in enumerate(("a.exr", "b.exr")):
    mi.render(scene, integrator=integrator, spp=samples, seed=seed)
    scene.sensors()[0].film().bitmap().write(name)
