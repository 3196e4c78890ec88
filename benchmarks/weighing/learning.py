# SPDX-License-Identifier: Apache-2.0
"""What the network that weighs candidates sees, and the network itself. The same formulas are in src/weighing; only
sums, products, quotients and roots, so that every processor gives the same bits."""
from pathlib import Path

import numpy
import OpenEXR

CANDIDATES = ["regression", "sharp", "smooth", "demodulated"]
WIDTHS = (24, 28, 40)


def channels(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: c.pixels.astype(numpy.float32) for name, c in file.channels().items()}


def rgb(c, prefix="", names="RGB"):
    return numpy.stack([c[prefix + n] for n in names], -1)


def groups_of(c):
    return numpy.stack([rgb(c, f"{g}.") for g in sorted({k.split(".")[0] for k in c if k.startswith("group")})])


def box(x, radius):
    """Mean over the (2 radius + 1)^2 pixels around, of those that exist."""
    k = 2 * radius + 1

    def sums(a):
        s = numpy.pad(a.astype(numpy.float64), [(radius + 1, radius)] * 2 + [(0, 0)] * (a.ndim - 2)).cumsum(0).cumsum(1)
        return s[k:, k:] - s[:-k, k:] - s[k:, :-k] + s[:-k, :-k]
    n = sums(numpy.ones(x.shape[:2])).reshape(*x.shape[:2], *[1] * (x.ndim - 2))
    return (sums(x) / n).astype(numpy.float32)


def limited(groups):
    """Groups without fireflies, as in limited_groups.h."""
    bright, result = groups.mean(-1), groups.copy()
    for half in (0, 1):
        other = bright[1 - half::2].max(0)
        around = numpy.lib.stride_tricks.sliding_window_view(numpy.pad(other, 3), (7, 7)).max((2, 3))
        result[half::2] *= numpy.minimum(1, 6 * around / numpy.maximum(bright[half::2], 1e-20))[..., None]
    return result


def variance_of_mean(groups):
    """As in denoising_parts.cpp."""
    n = len(groups)
    own = groups.var(0, ddof=1) / n
    around = numpy.maximum(box(own**0.75, 2), 0)**(4 / 3)
    return ((n - 1) * own + 8 * around) / (n - 1 + 8)


def cells(x):
    """x by cells of 2 x 2 pixels: [rows, columns, 4, channels]; the last row or column is repeated for odd sizes."""
    x = numpy.pad(x, [(0, x.shape[0] % 2), (0, x.shape[1] % 2), (0, 0)], mode="edge")
    h, w, n = x.shape
    return x.reshape(h // 2, 2, w // 2, 2, n).swapaxes(1, 2).reshape(h // 2, w // 2, 4, n)


def rooted(q):
    """From squares of 0 to any size to [-1, 1)."""
    r = numpy.sqrt(numpy.sqrt(numpy.minimum(q, 1e6)))
    return 2 * r / (r + numpy.float32(0.3)) - 1


def features(images, variance, guides):
    """By cells. `images`: the mean, then the candidates, [height, width, 3] each; `guides`: albedo and normal of the
    first surface, and those seen in mirrors and through glass, or None."""
    c = [cells(x) for x in images]
    base, others = c[1], [c[0]] + c[2:]
    bright = numpy.maximum(base.mean(-1), 0).mean(-1)
    padded = numpy.pad(bright, 1, mode="edge")
    h, w = bright.shape
    local = sum(padded[i:i + h, j:j + w] for i in range(3) for j in range(3)) / 9
    local = numpy.maximum(local, 1e-10)
    inverse = 1 / local
    planes = []
    for x in others:
        d = (x - base) * inverse[..., None, None]
        m = 4 * d.mean((2, 3))
        planes += [m / (1 + abs(m)), rooted((d * d).mean((2, 3)))]
    planes.append(rooted(cells(variance).mean((2, 3)) * inverse * inverse))
    mean = base.mean(2, keepdims=True)
    ratio = numpy.maximum(mean[:, :, 0], 0) * inverse[..., None]
    planes += list(numpy.moveaxis(ratio / (1 + ratio), -1, 0))
    planes.append(rooted((((base - mean) * inverse[..., None, None])**2).mean((2, 3))))
    if guides is None:
        planes += [numpy.zeros_like(bright)] * 10
    else:
        albedo, normal, albedo2, normal2 = (cells(g) for g in guides)
        for g in (albedo2, normal2):
            planes += list(numpy.moveaxis(g.mean(2), -1, 0))
        for g in (albedo2, normal2):
            planes.append(numpy.sqrt(((g - g.mean(2, keepdims=True))**2).mean((2, 3))))
        planes.append(numpy.sqrt(((albedo2 - albedo)**2).mean((2, 3)) + ((normal2 - normal)**2).mean((2, 3))))
        planes.append(numpy.ones_like(bright))
    return numpy.stack(planes, -1).astype(numpy.float32)


def shapes(inputs, outputs):
    a, b, c = WIDTHS
    return {"mix": (1, inputs, a), "a": (3, a, a), "b": (3, a, b), "b2": (3, b, b), "c": (3, b, c), "c2": (3, c, c),
            "d": (3, c + b, b), "e": (3, b + a, a), "out": (1, a, outputs)}


def load(film, guides, stages):
    """The images, their variance and the auxiliary features of a film and its candidates."""
    c = channels(film)
    groups = groups_of(c)
    images = [groups.mean(0)] + [rgb(channels(Path(stages) / f"candidate-{n}.exr")) for n in CANDIDATES]
    g = channels(guides)
    shown = [rgb(g, "Albedo."), rgb(g, "N.", "XYZ"), rgb(g, "DenoisingAlbedo."), rgb(g, "DenoisingNormal.", "XYZ")]
    return images, variance_of_mean(limited(groups)), shown


def write_weights(path, weights):
    """Of the layers in order, as 16-bit floats."""
    parts = [numpy.asarray(layer[k]).astype("<f2").tobytes() for layer in weights.values() for k in "wb"]
    Path(path).write_bytes(b"".join(parts))

