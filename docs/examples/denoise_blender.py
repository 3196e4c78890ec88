#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""blender -b SCENE.blend -P denoise_blender.py: two renders by Cycles with different seeds, a.exr and b.exr. Then:

    covary denoise a.exr b.exr -o out.exr

Also runs outside Blender (pip install bpy): python denoise_blender.py SCENE.blend [SAMPLES]
"""
import os
import sys

import bpy

arguments = [] if bpy.data.filepath else sys.argv[1:]
if not arguments and not bpy.data.filepath:
    sys.exit(__doc__)
if arguments:
    bpy.ops.wm.open_mainfile(filepath=os.path.abspath(arguments[0]))
scene = bpy.context.scene
scene.render.engine = "CYCLES"
if len(arguments) > 1:
    scene.cycles.samples = int(arguments[1])
scene.cycles.use_denoising = False  # covary denoises
scene.cycles.use_adaptive_sampling = False
for layer in scene.view_layers:
    layer.cycles.denoising_store_passes = True  # albedo and normal
if hasattr(scene.render.image_settings, "media_type"):  # from Blender 5.0 on
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
scene.render.image_settings.color_depth = "32"
for seed, name in enumerate(("a.exr", "b.exr")):
    scene.cycles.seed = seed
    scene.render.filepath = os.path.abspath(name)
    bpy.ops.render.render(write_still=True)
