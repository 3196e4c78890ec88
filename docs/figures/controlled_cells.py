#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""controlled_cells.py RENDER.exr RENDER.training OUT.jpg WIDTH: what a render with control variates has learnt at the
surfaces that the camera sees. WIDTH: pixels of a row. Needs `pip install numpy matplotlib pillow`.

    covary render SCENE --integrator controlled-path --estimator none --aovs --save-training RENDER.training \\
        -o RENDER.exr

Four pictures: the render; the mean coefficient of the lights, weighted by their probabilities, minus that of BSDF
sampling, by colour channel; the same with its sign (blue: lights are worth more); and the fraction of the control that
is used, red where it is switched off, pale where a wider cell is used. docs/file-formats.md describes the training
file."""
import pathlib
import struct
import sys

import matplotlib
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/cli"))
matplotlib.use("Agg")
from exr_reader import read_exr  # noqa: E402
from matplotlib import pyplot  # noqa: E402


class Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, pattern):
        values = struct.unpack_from("<" + pattern, self.data, self.at)
        self.at += struct.calcsize("<" + pattern)
        return values if len(values) > 1 else values[0]

    def skip(self, n_bytes):
        self.at += n_bytes


class Table:
    """The cells of a training file: the index of the cell for each key, and its values."""

    def __init__(self, path):
        reader = Reader(pathlib.Path(path).read_bytes())
        reader.skip(len(b"covary coefficients\n") + 4)
        reader.skip(reader.take("Q"))
        reader.skip(16)
        self.origin, self.width = np.array(reader.take("3f")), reader.take("f")
        self.resolution, self.level, self.by_normal = reader.take("3I")
        reader.skip(4 * reader.take("I"))
        n_lights, n_dense, n_cells = reader.take("3I")
        self.cells, self.scale, self.light_sum, self.bsdf = {}, [], [], []
        for i in range(n_cells):
            key, _ = reader.take("QI")
            self.cells[key] = i
            self.scale.append(reader.take("3f"))
            self.light_sum.append(reader.take("3f"))
            self.bsdf.append([reader.take("3f") for _ in range(n_dense)][0])
            reader.skip(16 * reader.take("I"))

    def find(self, position, normal):
        """Index of the finest cell at a position, -1 for none; and whether it is of the finest level."""
        cell = np.clip((position - self.origin) / self.width, 0, self.resolution - 1).astype(int)
        axis = int(np.argmax(np.abs(normal)))
        kind = 2 * axis + (normal[axis] < 0) if self.by_normal else 6
        for level in range(self.level, self.level + 18):
            x, y, z = (int(c) >> (level - self.level) for c in cell)
            key = x | y << 17 | z << 34 | int(kind) << 51 | level << 56
            if key in self.cells:
                return self.cells[key], level == self.level
        return self.cells.get(255 << 56, -1), False


def layer(channels, name, components, shape):
    return np.array([channels[f"{name}{c}"] for c in components]).T.reshape(*shape, 3)


def tone(image):
    return np.clip(image, 0, 1) ** (1 / 2.2)


def main(render, training, out, width):
    channels = read_exr(pathlib.Path(render).read_bytes())
    shape = (len(channels["R"]) // width, width)
    image, position = layer(channels, "", "RGB", shape), layer(channels, "P.", "XYZ", shape)
    normal = layer(channels, "N.", "XYZ", shape)
    table = Table(training)
    found = [[table.find(position[y, x], normal[y, x]) for x in range(width)] for y in range(shape[0])]
    cell, finest = np.array([[f[0] for f in row] for row in found]), np.array([[f[1] for f in row] for row in found])
    light_sum, bsdf, scale = (np.array(values)[cell] for values in (table.light_sum, table.bsdf, table.scale))
    hit = np.abs(normal).sum(axis=2) > 0
    figure, axes = pyplot.subplots(1, 4, figsize=(16, 3.4))
    axes[0].imshow(tone(image)), axes[0].set_title("render")
    # Coefficients may be shifted by a constant: what has a meaning are differences between techniques.
    difference = (light_sum - bsdf) * hit[..., None]
    bound = np.percentile(np.abs(difference), 97)
    axes[1].imshow(tone(np.clip(difference / bound, 0, 1))), axes[1].set_title("lights less BSDF, by channel")
    axes[2].imshow(difference.mean(axis=2), cmap="RdBu", vmin=-bound, vmax=bound)
    axes[2].set_title("the same, signed (blue: lights give more)")
    share = scale.mean(axis=2)
    colours = pyplot.get_cmap("viridis")(share)[..., :3]
    colours[share == 0] = (0.85, 0.1, 0.1)
    colours[~finest] = colours[~finest] * 0.5 + 0.4
    colours[~hit] = 0
    axes[3].imshow(colours), axes[3].set_title("share of the control (red: off, pale: of wider cells)")
    for axis in axes:
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(out, dpi=80, pil_kwargs={"quality": 85})


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*sys.argv[1:4], int(sys.argv[4]))
