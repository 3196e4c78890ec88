# SPDX-License-Identifier: Apache-2.0
"""Pictures of `covary probe` for docs/methods/guiding.md, in rows and columns."""
import pathlib
import subprocess
import sys
import tempfile

import matplotlib
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/cli"))
matplotlib.use("Agg")
from exr_reader import read_exr  # noqa: E402
from matplotlib import pyplot  # noqa: E402


def probe(covary, scene, pixel, height, *options):
    """Radiance, density and control variate in all directions, each [height, 2 height, 3]."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "probe.exr"
        subprocess.run([covary, "probe", str(scene), "--pixel", pixel, "--height", str(height), *options, "-o",
                        str(out)], check=True)
        channels = read_exr(out.read_bytes())
    image = np.array([channels[c] for c in "RGB"]).T.reshape(height, 3, 2 * height, 3)
    return [image[:, i] for i in range(3)]


def save(rows, names, size, out):
    """`rows`: a title and the pictures of each row; `names`: titles of the columns; `size`: in inches."""
    figure, axes = pyplot.subplots(len(rows), len(names), figsize=size)
    for (title, pictures), row in zip(rows, axes):
        for axis, picture, name in zip(row, pictures, names):
            axis.imshow(picture, aspect="auto")
            axis.set_xticks([]), axis.set_yticks([])
            if row is axes[0]:
                axis.set_title(name, fontsize=10)
        row[0].set_ylabel(title, fontsize=9)
    figure.tight_layout()
    figure.savefig(out, dpi=75)
