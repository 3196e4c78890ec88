# SPDX-License-Identifier: Apache-2.0
"""mitsuba_picture.py SCENE.xml WIDTHxHEIGHT SPP SEED OUT.exr
mitsuba_picture.py SCENE.xml WIDTHxHEIGHT SPP SEED OUT.npy PASSES

One render by Mitsuba's llvm_ad_rgb, with albedo and normals of the first surface by 16 samples, as a user would make it
for a denoiser: scene, compilation, picture and file in one process. Or a reference, the mean of several passes without
features."""
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import mitsuba
import numpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "against_mitsuba"))

import scene_files  # noqa: E402


FEATURES = ("albedo.R", "albedo.G", "albedo.B", "sh_normal.X", "sh_normal.Y", "sh_normal.Z")


def of_features(text):
    """The scene with an `aov` in place of its integrator: around it, each sample would take twice as long."""
    root = ET.fromstring(text)
    root.remove(root.find("integrator"))
    ET.SubElement(ET.SubElement(root, "integrator", type="aov"), "string", name="aovs",
                  value="albedo:albedo,sh_normal:sh_normal")
    return ET.tostring(root, encoding="unicode")


def main(path, size, spp, seed, output, passes=None):
    mitsuba.set_variant("llvm_ad_rgb")
    width, height = map(int, size.split("x"))
    spp, seed = int(spp), int(seed)
    mitsuba.file_resolver().prepend(str(Path(path).resolve().parent))
    text = scene_files.mitsuba_text(path, scene_files.Settings(width, height, spp))
    if passes is None:
        image = numpy.array(mitsuba.render(mitsuba.load_string(text), seed=seed, spp=spp))[..., :3]
        features = numpy.array(mitsuba.render(mitsuba.load_string(of_features(text)), seed=seed, spp=16))
        pixels = numpy.concatenate([image, features[..., -len(FEATURES):]], 2).astype(numpy.float32)
        mitsuba.Bitmap(pixels, mitsuba.Bitmap.PixelFormat.MultiChannel, ["R", "G", "B", *FEATURES]).write(output)
        return
    scene = mitsuba.load_string(text)
    images = (numpy.array(mitsuba.render(scene, seed=1000 * seed + n, spp=spp)) for n in range(int(passes)))
    numpy.save(output, sum(image[..., :3] / int(passes) for image in images))


main(*sys.argv[1:])
