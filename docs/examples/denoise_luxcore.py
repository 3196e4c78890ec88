#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""denoise_luxcore.py RENDER.cfg [SAMPLES [RENDERS]]: two or more renders by LuxCore (pip install pyluxcore) with
different seeds, and their albedo and normal: a.exr, a.albedo.exr, a.normal.exr, and the same for b. Then:

    covary denoise a.exr b.exr --albedo a.albedo.exr --normal a.normal.exr -o out.exr
"""
import sys
import time

import pyluxcore

if len(sys.argv) < 2:
    sys.exit(__doc__)
pyluxcore.Init()
LAYERS = (("RGB", ""), ("ALBEDO", ".albedo"), ("AVG_SHADING_NORMAL", ".normal"))
for seed, name in enumerate("abcdefghijkl"[:int(sys.argv[3]) if len(sys.argv) > 3 else 2], start=1):
    settings = pyluxcore.Properties(sys.argv[1])
    settings.DeleteAll(settings.GetAllNames("film.outputs."))
    settings.DeleteAll(settings.GetAllNames("film.imagepipelines."))  # no denoiser, no tone curve
    settings.Set(pyluxcore.Property("renderengine.seed", seed))
    settings.Set(pyluxcore.Property("sampler.type", "SOBOL"))
    settings.Set(pyluxcore.Property("batch.haltspp", int(sys.argv[2]) if len(sys.argv) > 2 else 64))
    settings.Set(pyluxcore.Property("batch.haltthreshold", -1.0))  # all pixels get as many
    for i, (kind, end) in enumerate(LAYERS):
        settings.Set(pyluxcore.Property(f"film.outputs.{i}.type", kind))
        settings.Set(pyluxcore.Property(f"film.outputs.{i}.filename", f"{name}{end}.exr"))
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(settings))
    session.Start()
    while not session.HasDone():
        time.sleep(0.1)
        session.UpdateStats()
    session.Stop()
    session.GetFilm().Save()
