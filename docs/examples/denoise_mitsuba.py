#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""denoise_mitsuba.py SCENE.xml [SAMPLES [RENDERS]]: two or more renders by Mitsuba 3 with different seeds, a.exr, b.exr
and so on. Then:

    covary denoise ?.exr -o out.exr
"""
import sys

import mitsuba as mi

if len(sys.argv) < 2:
    sys.exit(__doc__)
mi.set_variant("scalar_rgb")  # "llvm_ad_rgb" where LLVM is installed: 2 to 8 times as fast
scene = mi.load_file(sys.argv[1])
samples = int(sys.argv[2]) if len(sys.argv) > 2 else 64
integrator = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,sh_normal:sh_normal", "image": scene.integrator()})
for seed in range(int(sys.argv[3]) if len(sys.argv) > 3 else 2):
    mi.render(scene, integrator=integrator, spp=samples, seed=seed)
    scene.sensors()[0].film().bitmap().write(f"{chr(ord('a') + seed)}.exr")
