#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""denoise_mitsuba.py SCENE.xml [SAMPLES [RENDERS]] [NAME=VALUE ...]: two or more renders by Mitsuba 3 with different
seeds, a.exr, b.exr and so on; parameters of the scene, such as resx=480 resy=270, as for Mitsuba's -D. Then:

    covary denoise ?.exr -o out.exr
"""
import sys

import mitsuba as mi

numbers = [word for word in sys.argv[2:] if "=" not in word]
parameters = dict(word.split("=", 1) for word in sys.argv[2:] if "=" in word)
if len(sys.argv) < 2:
    sys.exit(__doc__)
mi.set_variant("scalar_rgb")  # "llvm_ad_rgb" where LLVM is installed: 2 to 8 times as fast
scene = mi.load_file(sys.argv[1], **parameters)
film = scene.sensors()[0].film()
samples = int(numbers[0]) if numbers else 64
if film.rfilter().radius() > 0.5:
    print('the pixel filter is wider than a pixel, which leaves blotches: write <rfilter type="box"/> in the <film>',
          file=sys.stderr)
integrator = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,sh_normal:sh_normal", "image": scene.integrator()})
for seed in range(int(numbers[1]) if len(numbers) > 1 else 2):
    name = f"{chr(ord('a') + seed)}.exr"
    print(f"{name}: {film.size()[0]} x {film.size()[1]} pixels, {samples} samples", file=sys.stderr)
    mi.render(scene, integrator=integrator, spp=samples, seed=seed)
    film.bitmap().write(name)
