#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes textures.json: small images in every file format, and what Mitsuba 3 reads from them.

Usage: make_texture_references.py [textures.json]      (needs the Python packages mitsuba 3.9 and numpy)

The images are random numbers from a fixed seed. The files are stored in the JSON itself (base64), so that the test
reads the very bytes Mitsuba read.
"""
import base64
import json
import os
import sys
import tempfile

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)
rng = np.random.default_rng(7)


def write_tga(path, pixels, top_down):
    """Uncompressed 24-bit or 32-bit TGA of version 2."""
    height, width, channels = pixels.shape
    bgr = pixels[..., [2, 1, 0] + ([3] if channels == 4 else [])]
    if not top_down:
        bgr = bgr[::-1]
    header = bytearray(18)
    header[2] = 2
    header[12:16] = bytes([width & 255, width >> 8, height & 255, height >> 8])
    header[16] = 8 * channels
    header[17] = (0x20 if top_down else 0) | (8 if channels == 4 else 0)
    with open(path, "wb") as out:
        out.write(bytes(header) + bgr.tobytes() + bytes(8) + b"TRUEVISION-XFILE.\0")


def make_files(folder):
    byte = lambda h, w, c: rng.integers(0, 256, (h, w, c), dtype=np.uint8)
    half = rng.random((3, 4, 3)).astype(np.float16)
    smooth = (np.linspace(0, 1, 16)[None, :, None] * np.array([200, 120, 40]) + np.linspace(0, 50, 16)[:, None, None])
    pixels = {
        "rgb8.png": byte(3, 5, 3),
        "rgba8.png": byte(4, 4, 4),
        "grey8.png": byte(4, 3, 1),
        "grey_alpha8.png": byte(3, 3, 2),
        "rgb16.png": rng.integers(0, 65536, (3, 3, 3), dtype=np.uint16),
        "one_pixel.png": byte(1, 1, 3),
        "one_row.png": byte(1, 4, 3),
        "smooth.jpg": smooth.astype(np.uint8),
        "float.exr": (rng.random((3, 4, 3)) * 3).astype(np.float32),
        "half.exr": half,
        "grey.exr": rng.random((2, 5, 1)).astype(np.float32),
        "rgba.exr": rng.random((3, 3, 4)).astype(np.float32),
        "rgbe.hdr": (rng.random((4, 5, 3)) * 100).astype(np.float32),
        "float.pfm": rng.random((3, 4, 3)).astype(np.float32),
        "grey.pfm": rng.random((4, 3, 1)).astype(np.float32),
        "rgb.ppm": byte(3, 4, 3),
    }
    for name, values in pixels.items():
        mi.Bitmap(values).write(os.path.join(folder, name))
    write_tga(os.path.join(folder, "down.tga"), byte(3, 4, 3), True)
    write_tga(os.path.join(folder, "up.tga"), byte(3, 4, 4), False)
    return sorted(list(pixels) + ["down.tga", "up.tga"])


# rows of the upper left 2 x 3 part of to_uv: linear part and translation
TRANSFORMS = {
    "none": None,
    "flip": [[1, 0, 0], [0, -1, 1]],
    "affine": [[2.5, 0.3, 0.13], [-0.4, -1.7, 0.57]],
    "quarter": [[0, -1, 1], [1, 0, 0]],
}


def load(path, raw=False, filter_type="bilinear", wrap_mode="repeat", transform="none"):
    settings = {"type": "bitmap", "filename": path, "raw": raw, "filter_type": filter_type, "wrap_mode": wrap_mode,
                "format": "variant"}
    if TRANSFORMS[transform] is not None:
        (a, b, c), (d, e, f) = TRANSFORMS[transform]
        settings["to_uv"] = mi.ScalarTransform4f([[a, b, 0, c], [d, e, 0, f], [0, 0, 1, 0], [0, 0, 0, 1]])
    return mi.load_dict(settings)


def digits(values):
    """Enough digits for single precision."""
    return [float(f"{x:.8g}") for x in np.array(values).ravel()]


def query(texture, points, gradient):
    result = {"eval": [], "eval_1": [], "grad_1": []}
    for u, v in points:
        si = mi.SurfaceInteraction3f()
        si.uv = [float(u), float(v)]
        result["eval"].append(digits(texture.eval(si)))
        result["eval_1"].append(digits(texture.eval_1(si))[0])
        if gradient:
            result["grad_1"].append(digits(texture.eval_1_grad(si)))
    result["mean"] = float(texture.mean())
    return result


def main():
    target = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)),
                                                                 "textures.json")
    inside = rng.random((8, 2)).round(4)
    outside = (rng.random((8, 2)) * 8 - 4).round(4)
    points = np.concatenate([inside, outside, [[0, 0], [1, 1], [0, 1], [0.5, 0.5], [1e-4, 0.9999]]])
    output = {"generator": f"mitsuba {mi.__version__} scalar_rgb", "points": points.tolist(), "files": {}, "cases": [],
              "transforms": TRANSFORMS}
    with tempfile.TemporaryDirectory() as folder:
        for name in make_files(folder):
            path = os.path.join(folder, name)
            with open(path, "rb") as file:
                output["files"][name] = base64.b64encode(file.read()).decode()
            for raw in (False, True):
                output["cases"].append({"file": name, "raw": raw, "filter_type": "bilinear", "wrap_mode": "repeat",
                                        "to_uv": "none", **query(load(path, raw), points, True)})
        for name in ("rgb8.png", "float.exr", "grey8.png"):
            for filter_type in ("bilinear", "nearest"):
                for wrap_mode in ("repeat", "mirror", "clamp"):
                    for transform in TRANSFORMS:
                        texture = load(os.path.join(folder, name), False, filter_type, wrap_mode, transform)
                        # Mitsuba 3.9 multiplies the gradient by the resolution after to_uv instead of before: wrong
                        # for images that are not square, unless to_uv is diagonal.
                        gradient = transform in ("none", "flip")
                        output["cases"].append({"file": name, "raw": False, "filter_type": filter_type,
                                                "wrap_mode": wrap_mode, "to_uv": transform,
                                                **query(texture, points, gradient)})
    checkerboard = mi.load_dict({"type": "checkerboard", "color0": {"type": "rgb", "value": [0.9, 0.5, 0.1]},
                                 "color1": {"type": "rgb", "value": [0.2, 0.3, 0.4]},
                                 "to_uv": mi.ScalarTransform4f([[2, 0, 0, 0.1], [0, 3, 0, 0.2], [0, 0, 1, 0],
                                                                [0, 0, 0, 1]])})
    output["checkerboard"] = query(checkerboard, points, False)
    with open(target, "w") as file:
        json.dump(output, file, indent=None, separators=(",", ":"))
        file.write("\n")
    print(f"{target}: {len(output['cases'])} cases, {os.path.getsize(target)} bytes")


if __name__ == "__main__":
    main()
