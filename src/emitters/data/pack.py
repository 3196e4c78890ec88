#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Packs the coefficients of Hosek and Wilkie's models of sky and sun into hosek_wilkie.f32, which src/emitters/
sky_model.cpp reads. They come from the authors' own files (version 1.4a, https://cgg.mff.cuni.cz/projects/
SkylightModelling), under the licence in LICENSE.hosek_wilkie:

    python pack.py ArHosekSkyModelData_RGB.h ArHosekSkyModelData_Spectral.h

Order, in 32-bit floats (the files have seven digits):
  sky     [channel r, g, b][albedo 0, 1][turbidity 1 to 10][control point of 6][parameter of 9]
  sky     [channel][albedo][turbidity][control point], mean radiance
  sun     [wavelength 320, 360, ... 720 nm][turbidity][segment of 45][power of 4, the highest first]
  sun     [wavelength][power of 6], limb darkening
"""

import os
import re
import sys

import numpy as np


def arrays(path):
    with open(path, encoding="latin-1") as file:
        text = re.sub(r"//[^\n]*", "", file.read())
    return {m[1]: np.array(m[2].replace("\n", " ").rstrip(" ,\t").split(","), dtype=np.float64)
            for m in re.finditer(r"double (\w+)\[\]\s*=\s*\{([^}]*)\}", text)}


def main():
    sky, spectral = arrays(sys.argv[1]), arrays(sys.argv[2])
    wavelengths = range(320, 721, 40)
    parts = [sky[f"datasetRGB{c}"] for c in (1, 2, 3)] + [sky[f"datasetRGBRad{c}"] for c in (1, 2, 3)]
    parts += [spectral[f"solarDataset{w}"] for w in wavelengths]
    parts += [spectral[f"limbDarkeningDataset{w}"] for w in wavelengths]
    packed = np.concatenate(parts).astype("<f4")
    assert packed.size == 3240 + 360 + 19800 + 66, packed.size
    packed.tofile(os.path.join(os.path.dirname(os.path.abspath(__file__)), "hosek_wilkie.f32"))


if __name__ == "__main__":
    main()
