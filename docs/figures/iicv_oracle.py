#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fig. 4 of Yang and Moon 2025: gains over path tracing of the baseline (d), of penalties by sample variance (e) and by
the pilot (f), and of an oracle (g), whose penalties are the true squared errors of the independent image. Needs numpy.

(d) to (f) are the program's; (g), which no render can have, is Eqs. (7) and (10) once more, in double precision, and
so is a second (f), which differs from the program's by its rounding. Two more rows have other control variates than the
nearest values of the CRN image: the nearest pixels, and the nearest values of the independent image. Errors are relMSE
against two references."""
import argparse
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "cli"))
from exr_reader import header, read_exr  # noqa: E402

K, WINDOW, SMALLEST_PENALTY = 25, 11, 1e-4
PROGRAM = {"(d) baseline": ("cv-baseline", "--set", "ridge=0.3"),
           "(e) sample variance": ("iicv", "--paper", "--set", "penalty=sample"), "(f) pilot": ("iicv", "--paper")}


def channels_of(path):
    """Name -> [y][x]"""
    data = path.read_bytes()
    x0, y0, x1, y1 = struct.unpack("<4i", header(data)[0]["dataWindow"])
    return {name: np.reshape(values, (y1 - y0 + 1, x1 - x0 + 1)) for name, values in read_exr(data).items()}


def colours(channels, prefix=""):
    return np.stack([np.asarray(channels[prefix + c], float) for c in "RGB"], -1)


def read_groups(path):
    """[group][y][x][channel]"""
    channels = channels_of(path)
    names = sorted({name.split(".")[0] for name in channels if name.startswith("group")})
    return np.stack([colours(channels, f"{name}.") for name in names])


def offsets():
    """From the centre outwards, which decides between equal values."""
    reach = WINDOW // 2
    square = [(dy, dx) for dy in range(-reach, reach + 1) for dx in range(-reach, reach + 1)]
    return sorted(square, key=lambda o: (o[0] ** 2 + o[1] ** 2, o))


def windows(image, outside):
    """[y][x][offset][channel]"""
    reach = WINDOW // 2
    padded = np.pad(image, ((reach, reach), (reach, reach), (0, 0)), constant_values=outside)
    height, width = image.shape[:2]
    return np.stack([padded[reach + dy:reach + dy + height, reach + dx:reach + dx + width] for dy, dx in offsets()], 2)


def variance_of_mean(groups):
    return groups.var(0, ddof=1) / len(groups)


def pilot_error(crn, h):
    """The squared difference from a cross-bilateral filter, Eq. (11), without its factor n."""
    g = crn.mean(0)
    squares = ((windows(g, 1e9) - g[:, :, None]) ** 2).sum(-1)
    weights = np.exp(-squares / np.maximum(variance_of_mean(crn).sum(-1), 1e-30)[..., None])
    pilot = (weights[..., None] * windows(h, 0)).sum(2) / weights.sum(2)[..., None]
    return (pilot - h) ** 2


def coefficients(crn, error_of_h, guide=None):
    """Those of Eq. (10), [y][x][i], shared by the channels, with the symmetric penalty, and rows and columns of the
    pixels they belong to. `guide`: the image whose nearest values become control variates; default: the CRN image."""
    n_groups = len(crn)
    g = crn.mean(0)
    guide = g if guide is None else guide
    chosen = np.argsort(((windows(guide, 1e9) - guide[:, :, None]) ** 2).sum(-1), -1, kind="stable")[..., :K]
    place = np.array(offsets())[chosen]
    height, width = g.shape[:2]
    y = np.clip(np.arange(height)[:, None, None] + place[..., 0], 0, height - 1)
    x = np.clip(np.arange(width)[None, :, None] + place[..., 1], 0, width - 1)
    own = n_groups * error_of_h.sum(-1)
    penalty = np.maximum(0.5 * (own[..., None] + own[y, x]),
                         SMALLEST_PENALTY * crn.var(0, ddof=1).sum(-1)[y, x]) + 1e-30
    beta = np.empty(y.shape)
    for row in range(height):  # the groups' contrasts of one row at a time
        contrasts = (crn[:, y[row], x[row]] - g[y[row], x[row]]).transpose(1, 0, 3, 2).reshape(width, -1, K)
        target = (crn[:, row] - g[row]).transpose(1, 0, 2).reshape(width, -1, 1)
        gram = contrasts.transpose(0, 2, 1) @ contrasts / (n_groups - 1)
        gram[:, np.arange(K), np.arange(K)] += penalty[row]
        beta[row] = np.linalg.solve(gram, contrasts.transpose(0, 2, 1) @ target / (n_groups - 1))[..., 0]
    return beta, y, x


def estimate(crn, h, error_of_h, guide=None):
    """Eq. (7) with these coefficients."""
    beta, y, x = coefficients(crn, error_of_h, guide)
    g = crn.mean(0)
    return g - np.einsum("yxi,yxic->yxc", beta, g[y, x] - h[y, x])


def rel_mse(image, references):
    grey = references.mean(0).mean(-1, keepdims=True)
    return float(((image - references[0]) * (image - references[1]) / (grey ** 2 + 0.01)).mean())


def run(options, *words):
    subprocess.run([options.covary, *map(str, words), "--quiet", "--overwrite"], check=True)


def references_of(options, folder):
    """Two halves."""
    halves = [folder / f"reference{half}.exr" for half in (0, 1)]
    for half, path in enumerate(halves):
        run(options, "render", options.scene, "--rfilter", "box", "--estimator", "none", "--spp", options.reference_spp,
            "--seed", 900000001 + half, *options.view, "-o", path)
    return np.stack([colours(channels_of(path)) for path in halves])


def images_of(options, folder, references, seed):
    """By name: path tracing, the program's estimates, and those made here."""
    passes = ("--crn", folder / "films/crn.exr", "--independent", folder / "films/independent.exr")
    view = (options.scene, "--rfilter", "box", "--spp", options.spp, "--seed", seed, *options.view)
    run(options, "render", *view, "--estimator", "none", "-o", folder / "pt.exr")
    run(options, "render", *view, "--estimator", "iicv", "--paper", "--groups", 12, "--passes", folder / "films", "-o",
        folder / "image.exr")
    images = {"path tracing": colours(channels_of(folder / "pt.exr"))}
    for name, words in PROGRAM.items():
        run(options, "combine", *passes, "--estimator", *words, "-o", folder / "image.exr")
        images[name] = colours(channels_of(folder / "image.exr"))
    crn, h = read_groups(folder / "films/crn.exr"), read_groups(folder / "films/independent.exr").mean(0)
    error = pilot_error(crn, h)
    images["(f) again"] = estimate(crn, h, error)
    images["(f) nearest pixels"] = estimate(crn, h, error, np.zeros_like(h))
    images["(f) by independent values"] = estimate(crn, h, error, h)
    images["(g) true errors"] = estimate(crn, h, (h - references.mean(0)) ** 2)
    return images


def main(options):
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        references = references_of(options, folder)
        errors = {}
        for seed in range(1, options.seeds + 1):
            for name, image in images_of(options, folder, references, seed).items():
                errors.setdefault(name, []).append(rel_mse(image, references))
        means = {name: np.mean(values) for name, values in errors.items()}
        for name, error in means.items():
            print(f"{name}: relMSE {error:.5g}, gain {means['path tracing'] / error:.2f}")


def arguments(description):
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("covary")
    parser.add_argument("scene")
    parser.add_argument("--spp", type=int, default=192)
    parser.add_argument("--reference-spp", type=int, default=1024)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--crop", help="as of covary render")
    parser.add_argument("--resolution", help="as of covary render")
    options = parser.parse_args()
    options.view = [word for name in ("crop", "resolution") for word in (f"--{name}", getattr(options, name)) if
                    getattr(options, name)]
    return options


if __name__ == "__main__":
    main(arguments(__doc__))
