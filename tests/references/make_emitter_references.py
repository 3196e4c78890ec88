#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes emitters.json: what emitters of Mitsuba 3 send towards points and along directions.

Usage: make_emitter_references.py [emitters.json]      (needs the Python packages mitsuba 3.9 and numpy)

Images are random numbers from a fixed seed, stored in the JSON as they are.
"""
import json
import os
import sys
import tempfile

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)
rng = np.random.default_rng(11)


def digits(values):
    """Enough digits for single precision."""
    return [float(f"{x:.8g}") for x in np.array(values).ravel()]


def towards(emitter, points):
    """Direction, distance and weight (value over density) of sample_direction; meaningful for lights with deltas."""
    result = []
    for p in points:
        it = mi.Interaction3f()
        it.p = list(map(float, p))
        ds, weight = emitter.sample_direction(it, [0.3, 0.7])
        result.append({"d": digits(ds.d), "dist": digits(ds.dist)[0], "weight": digits(weight)})
    return result


def radiance(emitter, directions):
    """Radiance arriving along rays that leave the scene in these directions."""
    result = []
    for d in directions:
        si = mi.SurfaceInteraction3f()
        si.wi = list(map(float, -d))
        result.append(digits(emitter.eval(si)))
    return result


def suns():
    """Directions of the sun at places and times."""
    tokyo, santiago = {"latitude": 35.6894, "longitude": 139.6917, "timezone": 9}, {"latitude": -33.45,
                                                                                    "longitude": -70.67, "timezone": -4}
    result = []
    for parameters in ({}, {"hour": 6.5}, {**tokyo, "year": 2024, "month": 2, "day": 29, "hour": 12, "minute": 10},
                       {**santiago, "month": 12, "day": 21, "hour": 8, "minute": 30, "second": 20},
                       {**santiago, "year": 1999, "month": 6, "hour": 16}):
        sky = mi.load_dict({"type": "sunsky", **parameters})
        result.append({"parameters": parameters, "direction": digits(mi.traverse(sky)["sun_direction"])})
    return result


def skies(rotation):
    """Radiance of skies along directions all over the sky, and close to the sun."""
    result = []
    for sun, parameters in (([0.3, -0.2, 0.6], {}), ([-0.8, 0.5, 0.2], {"turbidity": 7.3, "sun_aperture": 3.0}),
                            ([0.1, 0.9, 0.03], {"turbidity": 1.0, "sky_scale": 2.0, "sun_scale": 0.5}),
                            ([0, 0, 1], {"turbidity": 10.0, "complex_sun": True}),
                            ([0.5, 0.1, 0.02], {"complex_sun": True, "sun_aperture": 5.0}),
                            ([0.4, 0.3, 0.5], {"sun_scale": 0.0, "albedo": {"type": "rgb", "value": [0.9, 0.4, 0.1]}})):
        settings = {"type": "sunsky", "sun_direction": sun, **parameters}
        if "sky_scale" in parameters:
            settings["to_world"] = rotation
            sun = digits(rotation @ mi.ScalarVector3f(sun))
            settings["sun_direction"] = sun
        frame = mi.Frame3f(mi.ScalarVector3f(sun) / np.linalg.norm(sun))
        half = np.radians(parameters.get("sun_aperture", 0.5358) / 2)
        near = [np.array(frame.to_world([x * np.sin(half), y * np.sin(half), 1.0]))
                for x, y in ((0.01, 0.02), (0.5, 0), (-0.3, 0.6), (0, -0.9), (0.97, 0), (0.8, 0.8), (-1.5, 0.3))]
        directions = np.concatenate([rng.normal(size=(24, 3)) * [1, 1, 0.5], near])
        directions = directions / np.linalg.norm(directions, axis=1)[:, None]
        result.append({"sun": sun, "parameters": parameters, "rotated": "sky_scale" in parameters,
                       "directions": [digits(d) for d in directions],
                       "radiance": radiance(mi.load_dict(settings), directions)})
    return result


def main():
    target = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)),
                                                                 "emitters.json")
    directions = rng.normal(size=(40, 3))
    directions = np.concatenate([directions, [[0, 0, 1], [0, 0, -1], [1, 0, 0], [-1, 0, 0],
                                              [1e-3, 0, 1], [-1e-3, 0, -1], [0.05, 1, 0.02], [0.06, -1, -0.02]]])
    directions = (directions / np.linalg.norm(directions, axis=1)[:, None]).round(7)
    points = (rng.random((24, 3)) * 4 - 2).round(4)
    output = {"generator": f"mitsuba {mi.__version__} scalar_rgb", "points": points.tolist(),
              "directions": directions.tolist()}

    rotation = mi.ScalarTransform4f().rotate([0.36, 0.48, -0.8], 50)  # a unit vector: Mitsuba does not normalise it
    mirrored = rotation @ mi.ScalarTransform4f().scale([-1, 1, 1])
    output["rotation"] = {"axis": [0.36, 0.48, -0.8], "angle": 50}
    output["envmap"] = []
    with tempfile.TemporaryDirectory() as folder:
        for height, width in ((5, 8), (1, 1), (2, 3), (16, 7)):
            image = (rng.random((height, width, 3)) ** 4 * 10).astype(np.float32)
            path = os.path.join(folder, "e.exr")
            mi.Bitmap(image).write(path)
            for name, to_world in (("none", None), ("rotation", rotation), ("mirrored", mirrored)):
                settings = {"type": "envmap", "filename": path, "scale": 1.5}
                if to_world is not None:
                    settings["to_world"] = to_world
                output["envmap"].append({"width": width, "height": height, "pixels": digits(image), "to_world": name,
                                         "radiance": radiance(mi.load_dict(settings), directions)})

        output["point"] = towards(mi.load_dict({"type": "point", "position": [0.3, -0.4, 0.5],
                                                "intensity": {"type": "rgb", "value": [1, 2, 3]}}), points)
        output["directional"] = towards(mi.load_dict({"type": "directional", "direction": [0.3, -0.4, 0.5],
                                                      "irradiance": {"type": "rgb", "value": [1, 2, 3]}}), points[:2])
        image = rng.random((4, 6, 3)).astype(np.float32)
        path = os.path.join(folder, "t.exr")
        mi.Bitmap(image).write(path)
        output["spot_texture"] = {"width": 6, "height": 4, "pixels": digits(image)}
        output["spot"] = []
        for cutoff, beam, textured in ((60, 20, False), (75, None, True), (40, 40, False)):
            settings = {"type": "spot", "intensity": {"type": "rgb", "value": [1, 2, 3]}, "cutoff_angle": cutoff,
                        "to_world": mi.ScalarTransform4f().look_at(origin=[0.1, 0.2, 3], target=[0, 0, 0],
                                                                   up=[0, 1, 0])}
            if beam is not None:
                settings["beam_width"] = beam
            if textured:
                settings["texture"] = {"type": "bitmap", "filename": path, "raw": True}
            output["spot"].append({"cutoff_angle": cutoff, "beam_width": beam, "textured": textured,
                                   "towards": towards(mi.load_dict(settings), points)})
    output["suns"] = suns()
    output["skies"] = skies(rotation)
    with open(target, "w") as file:
        json.dump(output, file, indent=None, separators=(",", ":"))
        file.write("\n")
    print(f"{target}: {os.path.getsize(target)} bytes")


if __name__ == "__main__":
    main()
