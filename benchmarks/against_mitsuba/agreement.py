# SPDX-License-Identifier: Apache-2.0
"""Do two renderers compute the same image? Tests across independent renders (seeds) of each.

The independent unit is the whole render with its seed, not the pixel. For the image mean, the means of 8 x 8 blocks and
the pixels (all per colour channel), Welch's t-test compares R renders of one side with R of the other. It includes the
noise of both sides and does not assume equal variances. Sidak's rule divides the false-positive probability among
blocks and channels. Radiance has rare bright samples, so t is not exactly t-distributed; with equal R the difference of
two such means is symmetric, which makes the test conservative.

A fourth test looks at all blocks together: the sum over blocks and channels of the fraction of the variance between
sides, against its distribution when the 2R renders are assigned to the two sides at random. It needs no normality and
finds differences that are small everywhere.
"""
import dataclasses

import numpy
from scipy import stats

BLOCK = 8
# float32 sums of some hundred values round by about this much of the value; less than this is no difference.
ROUNDING = 2e-6
PERMUTATIONS = 200_000


@dataclasses.dataclass
class Comparison:
    """One family of Welch tests. Arrays have the shape of the compared means without the seed axis."""

    difference: numpy.ndarray  # of the tested from the reference, in units of the reference's mean (see compare)
    t: numpy.ndarray
    p_value: float  # of the family: Sidak over its tests
    tests: int
    threshold: float  # |t| beyond which one test rejects at the family's alpha (median over tests)
    detectable: numpy.ndarray  # relative error that is found with the given power, per test

    def rejects(self, alpha):
        return self.p_value < alpha


def block_means(images, block=BLOCK):
    """(R, h, w, c) to (R, ceil(h/block), ceil(w/block), c); the last row and column may be smaller blocks."""
    _, height, width, _ = images.shape
    rows = numpy.add.reduceat(images.astype(numpy.float64), numpy.arange(0, height, block), axis=1)
    sums = numpy.add.reduceat(rows, numpy.arange(0, width, block), axis=2)
    count_y = numpy.diff(numpy.append(numpy.arange(0, height, block), height))
    count_x = numpy.diff(numpy.append(numpy.arange(0, width, block), width))
    return sums / (count_y[:, None] * count_x)[None, :, :, None]


def sidak_each(alpha, tests):
    """False-positive probability of each of `tests` tests, such that that of the family is `alpha`."""
    return -numpy.expm1(numpy.log1p(-alpha) / tests)


def welch(reference, tested, alpha, power=0.99):
    """Compares means over axis 0. `reference` (R1, ...), `tested` (R2, ...); alpha is that of the whole family."""
    n1, n2 = len(reference), len(tested)
    mean1, mean2 = reference.mean(axis=0), tested.mean(axis=0)
    floor = (ROUNDING * numpy.abs(mean1)) ** 2
    var1 = reference.var(axis=0, ddof=1) / n1 + floor / 2
    var2 = tested.var(axis=0, ddof=1) / n2 + floor / 2
    error = numpy.sqrt(var1 + var2)
    both = error > 0  # a black block that is black in every render of both sides has nothing to test
    safe_error = numpy.where(both, error, 1)
    t = numpy.where(both, (mean2 - mean1) / safe_error, 0)
    weights = numpy.where(both, var1**2 / (n1 - 1) + var2**2 / (n2 - 1), 1)
    freedom = numpy.where(both, (var1 + var2) ** 2 / weights, n1 + n2 - 2)
    p = 2 * stats.t.sf(numpy.abs(t), freedom)
    tests = t.size
    smallest = p.min()
    each = sidak_each(alpha, tests)
    critical = stats.t.isf(each / 2, freedom)
    scale = numpy.where(mean1 > 0, mean1, 1)
    return Comparison(
        difference=numpy.where(mean1 > 0, (mean2 - mean1) / scale, numpy.where(mean2 > 0, numpy.inf, 0)),
        t=t,
        p_value=float(-numpy.expm1(tests * numpy.log1p(-min(smallest, 1 - 1e-16)))),
        tests=tests,
        threshold=float(numpy.median(critical)),
        detectable=(critical + stats.norm.ppf(power)) * error / scale,
    )


def permutation(reference, tested, seed=1, permutations=PERMUTATIONS):
    """p-value of the test over all blocks together. Both sides (R, ...) with the same R."""
    if len(reference) != len(tested):
        raise ValueError(f"the permutation test needs equally many renders; got {len(reference)} and {len(tested)}")
    count = len(reference)
    data = numpy.concatenate([reference, tested]).reshape(2 * count, -1)
    data = data - data.mean(axis=0)
    norm = numpy.sqrt((data**2).sum(axis=0))
    data = (data[:, norm > 0] / norm[norm > 0]).astype(numpy.float32)

    def statistic(signs):
        share = (signs @ data) ** 2 / (2 * count)  # between-sides share of each block's sum of squares, in [0, 1]
        return (share / (1 - numpy.minimum(share, 0.999))).sum(axis=1)

    signs = numpy.concatenate([numpy.ones(count), -numpy.ones(count)]).astype(numpy.float32)
    observed = statistic(signs[None])[0]
    rng = numpy.random.default_rng(seed)
    above = 0
    for start in range(0, permutations, 2000):
        batch = rng.permuted(numpy.tile(signs, (min(2000, permutations - start), 1)), axis=1)
        above += int((statistic(batch) >= observed).sum())
    return (above + 1) / (permutations + 1)


@dataclasses.dataclass
class Agreement:
    """What one scene shows. `ratio` is tested over reference of the grey image mean, `ratio_error` its standard error;
    `mean` holds red, green, blue and grey."""

    seeds: int
    alpha: float
    ratio: float
    ratio_error: float
    mean: Comparison
    blocks: Comparison
    pixels: Comparison
    permutation_p: float
    bound: float
    dropped_pixels: int

    @property
    def mean_within_bound(self):
        return abs(self.ratio - 1) <= self.bound

    @property
    def verdict(self):
        """'agrees', 'differs', or 'noise': the mean is outside the bound by no more than its own noise explains."""
        if self.blocks.rejects(self.alpha):
            return "differs"
        if self.mean.rejects(self.alpha) and (numpy.abs(self.mean.difference) > self.bound).any():
            return "differs"
        return "agrees" if self.mean_within_bound else "noise"

    @property
    def trace(self):
        """Whether the finer tests see a difference that is within the bounds."""
        return self.pixels.rejects(self.alpha) or self.permutation_p < self.alpha


def agreement(reference, tested, alpha, bound=0.005):
    """Compares stacks of renders (R, h, w, 3). Pixels that are not finite in one render are left out of all, and
    counted."""
    finite = numpy.isfinite(reference).all(axis=(0, 3)) & numpy.isfinite(tested).all(axis=(0, 3))
    reference = numpy.where(finite[None, :, :, None], reference, 0).astype(numpy.float64)
    tested = numpy.where(finite[None, :, :, None], tested, 0).astype(numpy.float64)
    mean1, mean2 = reference.mean(axis=(1, 2)), tested.mean(axis=(1, 2))
    grey1, grey2 = mean1.mean(axis=1), mean2.mean(axis=1)
    ratio = grey2.mean() / grey1.mean()
    relative1 = grey1.std(ddof=1) / numpy.sqrt(len(grey1)) / grey1.mean()
    relative2 = grey2.std(ddof=1) / numpy.sqrt(len(grey2)) / grey2.mean()
    blocks1, blocks2 = block_means(reference), block_means(tested)
    return Agreement(
        seeds=len(reference),
        alpha=alpha,
        ratio=float(ratio),
        ratio_error=float(ratio * numpy.hypot(relative1, relative2)),
        mean=welch(numpy.column_stack([mean1, grey1]), numpy.column_stack([mean2, grey2]), alpha),
        blocks=welch(blocks1, blocks2, alpha),
        pixels=welch(reference, tested, alpha),
        permutation_p=permutation(blocks1, blocks2),
        bound=bound,
        dropped_pixels=int((~finite).sum()),
    )
