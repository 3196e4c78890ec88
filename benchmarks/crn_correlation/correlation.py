# SPDX-License-Identifier: Apache-2.0
"""Correlation between horizontally neighbouring pixels over the sample groups of a film.

For a pixel, x_1 ... x_T are the grey values (mean of R, G and B) of its T group means. The correlation of two pixels is
Pearson's over the T groups, averaged over all pairs (x, y), (x + 1, y). Pairs with a pixel that has the same value in
all groups (black, or a constant emitter alone) have no correlation; they are left out and counted.
"""
import dataclasses

import numpy


@dataclasses.dataclass(frozen=True)
class Correlation:
    mean: float
    pairs: int
    constant_pairs: int  # left out
    null_error: float  # standard deviation of `mean` if all pixels were independent


def neighbour_correlation(groups):
    """`groups`: (T, height, width) grey group means, T >= 3."""
    count = len(groups)
    if count < 3:
        raise ValueError(f"a correlation over groups needs at least 3 of them; the film has {count}")
    centred = groups - groups.mean(axis=0, dtype=numpy.float64)
    norm = numpy.sqrt((centred**2).sum(axis=0))
    # float32 group means of one constant differ by rounding only
    varies = norm > 1e-6 * numpy.sqrt(count) * numpy.abs(groups.mean(axis=0))
    unit = numpy.where(varies, centred / numpy.where(varies, norm, 1), 0)
    both = varies[:, :-1] & varies[:, 1:]
    correlation = (unit[:, :, :-1] * unit[:, :, 1:]).sum(axis=0)[both]
    pairs = int(both.sum())
    # Var(r) = 1 / (T - 1) for independent pixels; r of neighbouring pairs are uncorrelated although they share a pixel.
    return Correlation(
        mean=float(correlation.mean()) if pairs else float("nan"),
        pairs=pairs,
        constant_pairs=int(both.size - pairs),
        null_error=float(1 / numpy.sqrt((count - 1) * pairs)) if pairs else float("nan"),
    )
