# SPDX-License-Identifier: Apache-2.0
"""A method of one's own for `covary experiment --program mine='python3 own_method.py'`: a cross-bilateral filter of the
light, guided by albedo and normal, after "Joint Bilateral Upsampling" and its relatives, in 30 lines."""
import os

import covary
import numpy

RADIUS, SIGMA_ALBEDO, SIGMA_NORMAL = 6, 0.05, 0.1


def shifted(image, dx, dy):
    return numpy.roll(image, (dy, dx), (0, 1))


def filtered(image, albedo, normal):
    """Means of the light (the image over its albedo) of pixels of similar albedo and normal."""
    tint = albedo + 0.01
    light = image / tint
    total, weights = numpy.zeros_like(image), numpy.zeros(image.shape[:2] + (1,))
    for dy in range(-RADIUS, RADIUS + 1):
        for dx in range(-RADIUS, RADIUS + 1):
            distance = (((shifted(albedo, dx, dy) - albedo) / SIGMA_ALBEDO) ** 2).sum(-1, keepdims=True)
            distance += (((shifted(normal, dx, dy) - normal) / SIGMA_NORMAL) ** 2).sum(-1, keepdims=True)
            weight = numpy.exp(-distance / 2 - (dx * dx + dy * dy) / (0.5 * RADIUS ** 2))
            total += weight * shifted(light, dx, dy)
            weights += weight
    return tint * total / weights


if __name__ == "__main__":
    rendered = os.environ["COVARY_IMAGE"]  # the mean of the samples, with the layers of --aovs
    image, albedo, normal = (covary.read_image(rendered, layer) for layer in ("", "Albedo", "N"))
    covary.write_image(os.environ["COVARY_OUTPUT"], filtered(image, albedo, normal).astype(numpy.float32))
