# SPDX-License-Identifier: Apache-2.0
"""mitsuba_picture.py SCENE.xml WIDTHxHEIGHT SPP SEED OUT.exr
mitsuba_picture.py SCENE.xml WIDTHxHEIGHT SPP SEED OUT.npy PASSES

One render by Mitsuba's llvm_ad_rgb with albedo and normals of the first surface, as a user would make it for a
denoiser: scene, compilation, picture and file in one process. Or a reference, the mean of several passes without
features."""
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import mitsuba
import numpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "against_mitsuba"))

import scene_files  # noqa: E402


def with_features(text):
    """The scene with its integrator inside of an `aov`."""
    root = ET.fromstring(text)
    integrator = root.find("integrator")
    root.remove(integrator)
    outer = ET.SubElement(root, "integrator", type="aov")
    ET.SubElement(outer, "string", name="aovs", value="albedo:albedo,sh_normal:sh_normal")
    outer.append(integrator)
    return ET.tostring(root, encoding="unicode")


def main(path, size, spp, seed, output, passes=None):
    mitsuba.set_variant("llvm_ad_rgb")
    width, height = map(int, size.split("x"))
    spp, seed = int(spp), int(seed)
    mitsuba.file_resolver().prepend(str(Path(path).resolve().parent))
    text = scene_files.mitsuba_text(path, scene_files.Settings(width, height, spp))
    if passes is None:
        scene = mitsuba.load_string(with_features(text))
        mitsuba.render(scene, seed=seed, spp=spp)
        scene.sensors()[0].film().bitmap().write(output)  # 32-bit floats, one layer for each feature
        return
    scene = mitsuba.load_string(text)
    images = (numpy.array(mitsuba.render(scene, seed=1000 * seed + n, spp=spp)) for n in range(int(passes)))
    numpy.save(output, sum(image[..., :3] / int(passes) for image in images))


main(*sys.argv[1:])
