#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""mitsuba_frames.py SCENE.xml PATH.json FRAMES [SAMPLES] [NAME=VALUE ...]: frames by Mitsuba 3 along a camera path, as
`covary render --camera-path` reads it, with two seeds: a_0001.exr and b_0001.exr and so on. Then:

    covary denoise a_####.exr b_####.exr -o out_####.exr

Mitsuba has no motion layer. This script makes the layers Motion and Depth from Mitsuba's positions, for a scene in
which only the camera moves. Between keys, rotations are interpolated nearly evenly, but not exactly as covary does.
Needs numpy.
"""
import json
import sys

import mitsuba as mi
import numpy

mi.set_variant("scalar_rgb")  # "llvm_ad_rgb" where LLVM is installed: 2 to 8 times as fast


def camera_at(path, time):
    """The matrix from camera to world space."""
    keys = path["keyframes"]
    matrices = [numpy.array(key["to_world"], float).reshape(4, 4) for key in keys]
    times = [key["time"] for key in keys]
    matrix = numpy.array([[numpy.interp(time, times, [m[i, j] for m in matrices]) for j in range(4)]
                          for i in range(4)])
    left, _, right = numpy.linalg.svd(matrix[:3, :3])
    matrix[:3, :3] = left @ right  # the nearest rotation
    return matrix


def projected(points, to_world, width, height, fov):
    """Pixel coordinates (x to the right, y down) and the distance from the camera; x of the camera points to the left,
    y up, and `fov` is the horizontal field of view."""
    local = (points - to_world[:3, 3]) @ numpy.linalg.inv(to_world[:3, :3]).T
    scale = width / 2 / numpy.tan(numpy.radians(fov) / 2) / numpy.maximum(local[..., 2], 1e-6)
    return width / 2 - scale * local[..., 0], height / 2 - scale * local[..., 1], numpy.linalg.norm(local, axis=-1)


def motion_layers(points, hit, now, before, fov):
    """Motion.X, .Y, .Z and Depth (docs/sequences.md, "Depth and motion")."""
    height, width = points.shape[:2]
    x, y, depth = projected(points, now, width, height, fov)
    old_x, old_y, old_depth = projected(points, before, width, height, fov)
    return [numpy.where(hit, value, 0) for value in (old_x - x, old_y - y, old_depth - depth, depth)]


def main(scene_file, path_file, frames, samples=16, **parameters_of_scene):
    path = json.load(open(path_file))
    rate = path.get("frames_per_second", 1)
    scene = mi.load_file(scene_file, **parameters_of_scene)
    sensor = scene.sensors()[0]
    parameters = mi.traverse(sensor)
    if sensor.film().rfilter().radius() > 0.5:
        print("the pixel filter is wider than a pixel, which leaves blotches: write <rfilter type=\"box\"/> in the "
              "<film>", file=sys.stderr)
    fov = float(numpy.asarray(parameters["x_fov"]).ravel()[0])
    integrator = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,sh_normal:sh_normal,p:position",
                               "image": scene.integrator()})
    for frame in range(1, frames + 1):
        now, before = (camera_at(path, n / rate) for n in (frame, frame - 1))
        parameters["to_world"] = mi.ScalarTransform4f(now)
        parameters.update()
        for seed, name in enumerate("ab"):
            mi.render(scene, sensor=sensor, integrator=integrator, spp=samples, seed=2 * frame + seed)
            bitmap = sensor.film().bitmap()
            names = [field.name for field in bitmap.struct_()]
            pixels = numpy.array(bitmap, numpy.float32)
            points = numpy.stack([pixels[..., names.index(f"p.{c}")] for c in "XYZ"], -1).astype(float)
            layers = motion_layers(points, numpy.abs(points).sum(-1) > 0, now, before, fov)
            image = numpy.concatenate([pixels, numpy.stack(layers, -1).astype(numpy.float32)], -1)
            names += ["Motion.X", "Motion.Y", "Motion.Z", "Depth"]
            mi.Bitmap(image, mi.Bitmap.PixelFormat.MultiChannel, names).write(f"{name}_{frame:04d}.exr")


if __name__ == "__main__":
    words = sys.argv[3:]
    main(sys.argv[1], sys.argv[2], *(int(word) for word in words if "=" not in word),
         **dict(word.split("=", 1) for word in words if "=" in word))
