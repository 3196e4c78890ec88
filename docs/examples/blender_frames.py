#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""blender -b SCENE.blend -P blender_frames.py: frames by Cycles with two seeds and the Vector pass, a_0001.exr and
b_0001.exr and so on. Then:

    covary denoise a_####.exr b_####.exr -o out_####.exr --motion Vector --motion-scale 1,-1 --depth Depth

Vector's first two channels point to where a point was in the previous frame, in pixels, y upwards. Also runs outside
Blender (pip install bpy): python blender_frames.py SCENE.blend [SAMPLES [FRAMES]]
"""
import os
import sys

import bpy

arguments = [] if bpy.data.filepath else sys.argv[1:]
if arguments:
    bpy.ops.wm.open_mainfile(filepath=os.path.abspath(arguments[0]))
scene = bpy.context.scene
scene.render.engine = "CYCLES"
if len(arguments) > 1:
    scene.cycles.samples = int(arguments[1])
last = scene.frame_start + int(arguments[2]) - 1 if len(arguments) > 2 else scene.frame_end
scene.cycles.use_denoising = False  # covary denoises
scene.cycles.use_adaptive_sampling = False
scene.render.use_motion_blur = False  # Cycles has no Vector pass with it
for layer in scene.view_layers:
    layer.cycles.denoising_store_passes = True  # albedo and normal
    layer.use_pass_vector = layer.use_pass_z = True
image = scene.render.image_settings
if hasattr(image, "media_type"):
    image.media_type = "MULTI_LAYER_IMAGE"  # from Blender 5 on
image.file_format = "OPEN_EXR_MULTILAYER"
image.color_depth = "32"
for frame in range(scene.frame_start, last + 1):
    scene.frame_set(frame)
    for seed, name in enumerate("ab"):
        scene.cycles.seed = 2 * frame + seed  # no two renders share samples
        scene.render.filepath = os.path.abspath(f"{name}_{frame:04d}.exr")
        bpy.ops.render.render(write_still=True)
