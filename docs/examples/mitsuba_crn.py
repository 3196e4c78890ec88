#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""mitsuba_crn.py SCENE.xml FOLDER [--spp 96] [--groups 12] [--variant llvm_ad_rgb] [-D NAME=VALUE]

Renders a scene with Mitsuba 3 (pip install mitsuba; its variants llvm_ad_rgb and cuda_ad_rgb) for `covary combine`:
FOLDER/crn_00.exr ... with common random numbers and FOLDER/independent_00.exr ... with independent ones, `--spp`
samples per pixel of each kind, in `--groups` renders with different seeds. Then:

    covary combine --crn FOLDER/crn_*.exr --independent FOLDER/independent_*.exr -o out.exr
"""
import argparse
import pathlib
import xml.etree.ElementTree as ET

import drjit as dr
import mitsuba as mi


def define_sampler():
    class Common(mi.Sampler):
        """All pixels get the same numbers: streams depend only on the seed and the index of the sample."""

        def seed(self, seed, wavefront_size):
            super().seed(seed, wavefront_size)
            # Mitsuba traces all samples at once, those of a pixel one after the other.
            sample = dr.arange(mi.UInt64, wavefront_size) % self.sample_count()
            self.random = mi.PCG32(initstate=mi.UInt64(seed) * 0x9e3779b97f4a7c15, initseq=sample)

        def next_1d(self, active=True):
            return self.random.next_float32(active)

        def next_2d(self, active=True):
            return mi.Point2f(self.next_1d(active), self.next_1d(active))

        def fork(self):
            other = Common(mi.Properties())
            other.set_sample_count(self.sample_count())
            return other

    mi.register_sampler("common", Common)


def scene_with(path, sampler, spp, parameters):
    """The scene with this sampler, a box filter of one pixel (errors of pixels must not mix) and 32-bit values."""
    tree = ET.parse(path)
    for sensor in tree.iter("sensor"):
        for old in sensor.findall("sampler"):
            sensor.remove(old)
        ET.SubElement(ET.SubElement(sensor, "sampler", type=sampler), "integer", name="sample_count", value=str(spp))
    for film in tree.iter("film"):
        for old in film.findall("rfilter") + film.findall("string[@name='component_format']"):
            film.remove(old)
        ET.SubElement(film, "rfilter", type="box")
        ET.SubElement(film, "string", name="component_format", value="float32")
    mi.file_resolver().prepend(str(pathlib.Path(path).resolve().parent))
    return mi.load_string(ET.tostring(tree.getroot(), encoding="unicode"), **parameters)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--spp", type=int, default=96)
    parser.add_argument("--groups", type=int, default=12)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("-D", action="append", default=[], metavar="NAME=VALUE", help="for <default> of the scene")
    options = parser.parse_args()
    if options.groups < 3 or options.spp % options.groups:
        parser.error("--groups must be 3 or more and divide --spp")
    parameters = dict(definition.split("=", 1) for definition in options.D)
    mi.set_variant(options.variant)
    define_sampler()
    options.folder.mkdir(parents=True, exist_ok=True)
    for number, (name, sampler) in enumerate((("crn", "common"), ("independent", "independent"))):
        scene = scene_with(options.scene, sampler, options.spp // options.groups, parameters)
        for group in range(options.groups):
            image = mi.render(scene, seed=1000 * number + group)  # no seed twice
            mi.Bitmap(image).write(str(options.folder / f"{name}_{group:02}.exr"))


main()
