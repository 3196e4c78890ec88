# SPDX-License-Identifier: Apache-2.0
"""Errors of sequences against two references with samples of their own.

Every error is a mean of products (F - A)(F - B) / (R^2 + 0.01), with R the grey mean of both references: the noise of A
is independent of that of B and of F, so that it cancels in expectation, and errors may come out below 0. Weights know
the references' noise, too, which must therefore be small beside their brightness. Images are
arrays (frames, height, width, 3); results of several seeds (seeds, frames, height, width, 3)."""
from dataclasses import dataclass

import numpy

#: side of a region in pixels
REGION = 32
#: a region counts if its error of frames alone is that many times what the references' noise makes of it
RESOLVED = 4


def differences(images):
    """Of successive frames."""
    return images[..., 1:, :, :, :] - images[..., :-1, :, :, :]


def weights(first, second):
    """1 / (R^2 + 0.01) of every pixel, (frames, height, width, 1)."""
    return 1 / (((first + second) / 2).mean(-1, keepdims=True) ** 2 + 0.01)


def of_differences(weight):
    """Of a pixel in two successive frames the smaller weight, that of the brighter frame: a light that appears does not
    get the weight of the darkness before it."""
    return numpy.minimum(weight[1:], weight[:-1])


def products(images, first, second, weight):
    """(F - A)(F - B) w of every pixel, a mean over the channels."""
    return (weight * (images - first) * (images - second)).mean(-1)


@dataclass
class Sums:
    """Of every pixel, (frames, height, width): a mean over seeds, and the variance of it by the references' noise."""
    error: numpy.ndarray
    noise: numpy.ndarray


def pixel_errors(images, first, second, weight):
    """Errors of (seeds, frames, height, width, 3)."""
    error = products(images, first, second, weight).mean(0)
    # (F - A)(F - B) = (F - R)^2 - (A - B)^2 / 4 with R = (A + B) / 2: F - R has noise that F - A and A - B tell.
    mean = (first + second) / 2
    across = (weight * (images.mean(0) - mean) * (first - second)).mean(-1)
    square = (weight * (first - second) ** 2 / 4).mean(-1)
    return Sums(error, across**2 + square**2)


def frame_errors(images, first, second):
    return pixel_errors(images, first, second, weights(first, second))


def temporal_errors(images, first, second):
    """Of the difference of each frame from the one before it: flicker, but no lasting bias."""
    return pixel_errors(differences(images), differences(first), differences(second),
                        of_differences(weights(first, second)))


def squared_bias(images, first, second):
    """Mean of (F_s - A)(F_t - B) w over the pairs of different seeds s, t; needs two seeds."""
    seeds = len(images)
    if seeds < 2:
        raise ValueError(f"squared bias needs renders of two seeds or more; found {seeds}")
    weight = weights(first, second)
    of_sums = (weight * (images - first).sum(0) * (images - second).sum(0)).mean()
    return float((of_sums - products(images, first, second, weight).sum(0).mean()) / (seeds * (seeds - 1)))


def region_starts(size, region=REGION):
    """Corners of regions along a side; the last one is moved back so that it lies inside."""
    if size < region:
        raise ValueError(f"images must have {region} pixels or more a side; found {size}")
    return sorted({*range(0, size - region + 1, region), size - region})


def region_means(values, region=REGION):
    """(frames, height, width) to (frames, rows of regions, columns of regions)."""
    return numpy.stack([numpy.stack([values[:, y:y + region, x:x + region].mean((1, 2))
                                     for x in region_starts(values.shape[2], region)], -1)
                        for y in region_starts(values.shape[1], region)], -2)


@dataclass
class Worst:
    ratio: float
    frame: int | None  # from 0; of differences, that of the later frame's predecessor; none for means over frames
    row: int
    column: int
    left_out: int  # regions whose error of frames alone the references do not tell


def worst_region(errors, alone, over_frames):
    """The largest ratio of two methods' errors in a region, in a single frame or of means over all frames."""
    tested, base = region_means(errors.error), region_means(alone.error)
    noise = region_means(alone.noise) / REGION**2  # variance of a region's mean; pixels of references are independent
    if over_frames:
        # The references of all frames have the same seeds: their noise is not less in the mean over frames.
        tested, base, noise = (values.mean(0, keepdims=True) for values in (tested, base, noise))
    told = base > RESOLVED * numpy.sqrt(noise)
    if not told.any():
        raise ValueError("the references are too noisy to tell the error of a single region; take more samples")
    ratios = numpy.where(told, tested / numpy.where(told, base, 1), -numpy.inf)
    frame, row, column = numpy.unravel_index(ratios.argmax(), ratios.shape)
    return Worst(float(ratios.max()), None if over_frames else int(frame), int(row), int(column), int((~told).sum()))


def unchanged(first, second, region=8, most=1e-3):
    """Pixels of blocks that the references find alike in successive frames, (frames - 1, height, width): what a method
    may take from the frame before without motion."""
    change = (of_differences(weights(first, second)) * differences(first) * differences(second)).mean(-1)
    height, width = change.shape[1] // region * region, change.shape[2] // region * region
    blocks = change[:, :height, :width].reshape(len(change), height // region, region, width // region, region)
    still = (blocks.mean((2, 4)) <= most).repeat(region, 1).repeat(region, 2)
    result = numpy.zeros(change.shape, bool)
    result[:, :height, :width] = still
    return result


def summary(images, first, second, alone):
    """What a row of the table tells of a method: errors as multiples of those of frames alone, and the regions."""
    frames, temporal = frame_errors(images, first, second), temporal_errors(images, first, second)
    base_frames, base_temporal = frame_errors(alone, first, second), temporal_errors(alone, first, second)
    still = unchanged(first, second)
    later = slice(1, None)  # the first frame has none before it
    row = {"relmse": float(frames.error[later].mean()), "temporal": float(temporal.error.mean()),
           "relmse_ratio": float(frames.error[later].mean() / base_frames.error[later].mean()),
           "temporal_ratio": float(temporal.error.mean() / base_temporal.error.mean()),
           "still_part": float(still.mean())}
    if still.any():
        row["still_relmse_ratio"] = float(frames.error[later][still].mean() / base_frames.error[later][still].mean())
    for name, errors, base in (("relmse", frames, base_frames), ("temporal", temporal, base_temporal)):
        row[f"worst_{name}"] = worst_region(errors, base, over_frames=True).ratio
        row[f"worst_{name}_of_frame"] = worst_region(errors, base, over_frames=False).ratio
    if len(images) > 1:
        row["squared_bias"] = squared_bias(images, first, second)
        row["squared_bias_alone"] = squared_bias(alone, first, second)
    return row
