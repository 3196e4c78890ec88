# SPDX-License-Identifier: Apache-2.0
"""fit.py --program COVARY [--work FOLDER] [--only render|measure|fit]

Fits the intervals that covary gives for its errors (src/risk/error_interval.h). It renders the scenes of variants.py
with few samples and with many, unless FOLDER has them already; asks the program for the error sums of each image;
compares the image with two references, relMSE in product form; writes both to renders.csv beside this file; and writes
the coefficients that fit them best to src/risk/error_interval_table.h. Needs numpy.

The middle is a ridge regression of log(relMSE / V), the spread one of the log of its residuals. A mixture that is the
mean of the samples, V = v, has V as its error, and one that is the mean in part is shrunk towards that. Each render is
weighted by how well its references know its error, for the spread and its quantiles even more, because what references
do not know looks like spread. Quantiles are those of families of scenes that were left out, so that the interval covers
how much scenes differ from those that were fitted."""
import argparse
import csv
import math
from pathlib import Path

import numpy
from measure import FEWEST_GROUPS, HERE, KINDS, measure_all, render_all
from variants import SCENES, family_of

TABLE, DATA = HERE.parent.parent / "src/risk/error_interval_table.h", HERE / "renders.csv"
#: Sigma of the prior of each coefficient but the constant: of the middle, for kinds of which most is known from other
#: scenes, and for one that left-out families predict best (docs/notes); of others; what is added to the reference's
#: noise
RIDGE, USUAL_RIDGE, NOISE_FLOOR = {"filters": 0.04, "network": 0.04, "few-filters": 0.2}, 0.1, 0.1
#: Noise of the reference, over the truth, from which on a render says little about spread and quantiles: of kinds of
#: which enough renders are known so well
KNOWN = {"filters": 0.1, "network": 0.1}
#: difference of logarithms from which on a render counts little
OUTLIER = 0.5
TRUSTED, LEAST, MOST, MISSING_COVARIANCE = 0.5, 0.5, 30, 0.27
MOST_OF_LARGEST, MOST_FACTOR, MOST_SPECULAR, FEWEST_PIXELS = 0.55, 5, 0.5, 20
#: What bounds are off at least, of a median render: scenes of others differ more from ours than ours do
LEAST_FACTOR = 1.15
#: How far off bounds are, in the logarithm, of what holds 80 of 100 renders of families that were left out: rooms that
#: nobody chose differ more than scenes that somebody made. Chosen with ten of these in view (docs/notes);
#: of other kinds, whose intervals hold often enough or are too narrow with few samples, 1
WIDTH = {"mean": 0.7, "filters": 0.7, "network": 0.7}


def features(row):
    """error_features() of src/risk/error_interval.cpp."""
    s = {key: float(value) for key, value in row.items() if key not in ("scene", "kind")}
    least = max(s["error"] + MISSING_COVARIANCE * s["covariance"], LEAST * s["variance"])
    scatter = math.sqrt(max(0, s["squares"] - s["error"]**2 / s["parts"])) / least
    trust = 1 / (1 + scatter**2 / TRUSTED**2)
    return [1, trust * math.log(min(least / s["variance"], MOST)), 1 - trust,
            math.log(s["noise"] / s["variance"]), math.log(s["noise"] / s["values"]),
            math.log(s["fourth_powers"] / s["squared_deviations"]),
            math.log(s["noise"]**2 / s["noise_squares"]),
            math.log(s["light_of_largest"] * s["groups"] / s["light"]),
            math.log(s["predicted"] / s["variance"])]


def not_the_mean(row):
    """1 minus the fraction of the mean in a mixture, as in fitted_error(): what is left for the features to explain."""
    mixes = row["kind"] in ("filters", "network", "pair-filters", "pair-network")
    return 1 - min(1, float(row["variance"]) / float(row["noise"])) if mixes else 1


def weighted_ridge(x, y, weight, sigma):
    """Coefficients of a ridge regression; all but the first are shrunk towards 0."""
    penalty = numpy.full(x.shape[1], 1 / sigma**2)
    penalty[0] = 1e-6
    scale = numpy.maximum(x.std(0), 0.05)  # sigma is of the feature's own spread
    scale[0] = 1
    z = x / scale
    matrix = z.T @ (z * weight[:, None]) + numpy.diag(penalty)
    return numpy.linalg.solve(matrix, z.T @ (weight * y)) / scale


def weighted_quantile(values, weights, part):
    """The value below which this fraction of the weights lies, including half of its own."""
    order = numpy.argsort(values)
    below = numpy.cumsum(weights[order]) - weights[order] / 2
    return numpy.interp(part * weights.sum(), below, values[order])


class Fit:
    """The fit of one kind of image: a, b, limits of log s and quantiles of r."""

    def __init__(self, rows, kind):
        self.rows = [row for row in rows if row["kind"] == kind and usable(row)]
        self.kind = kind
        self.x = numpy.array([features(row) for row in self.rows])
        self.of_middle = self.x * numpy.array([[not_the_mean(row)] for row in self.rows])
        variance = numpy.array([float(r["variance"]) / float(r["values"]) for r in self.rows])
        truth = numpy.array([float(r["relmse"]) for r in self.rows])
        self.noise = numpy.array([float(r["reference_noise"]) for r in self.rows]) / truth
        self.known = 1 / (1 + (self.noise / KNOWN.get(kind, math.inf))**2)**2
        self.y = numpy.log(truth / variance)
        self.scenes = numpy.array([r["scene"] for r in self.rows])
        families = numpy.array([family_of(scene) for scene in self.scenes])
        self.size = numpy.array([numpy.count_nonzero(families == family) for family in families])
        everything = numpy.ones(len(self.rows), bool)
        self.middle, self.spread = self.coefficients(everything)
        self.limits = self.log_spread_limits(self.x @ self.spread)
        r = numpy.empty(len(self.rows))
        self.left_out = numpy.empty(len(self.rows))
        for family in set(families):
            out = families == family
            middle, spread = self.coefficients(~out)
            limits = self.log_spread_limits(self.x[~out] @ spread)
            self.left_out[out] = self.y[out] - self.of_middle[out] @ middle
            r[out] = self.left_out[out] / numpy.exp(numpy.clip(self.x[out] @ spread, *limits))
        self.r = r
        least = math.log(LEAST_FACTOR) / numpy.exp(numpy.median(self.x @ self.spread))
        width = WIDTH.get(kind, 1)
        weight = self.known / self.size
        self.quantiles = (width * min(weighted_quantile(r, weight, 0.1), -least),
                          width * max(weighted_quantile(r, weight, 0.9), least))

    @staticmethod
    def log_spread_limits(values):
        return values.min(), values.max()

    def coefficients(self, use):
        x, of_middle, y, noise = self.x[use], self.of_middle[use], self.y[use], self.noise[use]
        weight = 1 / (NOISE_FLOOR + noise**2) / numpy.sqrt(self.size[use] / self.size.mean())
        sigma = RIDGE.get(self.kind, USUAL_RIDGE)
        middle = weighted_ridge(of_middle, y, weight, sigma)
        for _ in range(20):  # renders that nothing explains, which light that was not found makes, count little
            middle = weighted_ridge(of_middle, y, weight / (1 + ((y - of_middle @ middle) / OUTLIER)**2)**2, sigma)
        left = numpy.log(numpy.clip(abs(y - of_middle @ middle), 0.03, 1)) + 0.635  # E log |normal number| = -0.635
        wanted = numpy.array([1, 0, 1, 0, 0, self.kind not in KNOWN, 1, 1, 0])  # noise and rare light
        spread = numpy.zeros(x.shape[1])
        spread[wanted > 0] = weighted_ridge(x[:, wanted > 0], left, weight / 4 * self.known[use], USUAL_RIDGE)
        return middle, spread

    def text(self):
        numbers = lambda values: "{" + ", ".join(f"{v:.4g}" for v in values) + "}"  # noqa: E731
        return (f"    {{{numbers(self.middle)},\n     {numbers(self.spread)},\n     {self.limits[0]:.4g}, "
                f"{self.limits[1]:.4g}, {self.quantiles[0]:.4g}, {self.quantiles[1]:.4g}}},")

    def report(self):
        off, log = numpy.exp(self.left_out), self.left_out
        spread = numpy.median(numpy.exp(self.x @ self.spread)) * max(-self.quantiles[0], self.quantiles[1])
        print(f"{self.kind}: {len(self.rows)} renders of {len(set(self.scenes))} scenes; left-out families: true over "
              f"middle {math.exp(log.mean()):.2f} times or over {math.exp(log.std()):.2f}, largest {off.max():.2f}, "
              f"least {off.min():.2f}; median factor of the bounds {math.exp(spread):.2f}")


def usable(row):
    """Whether an interval can be given, and the references determine the error to within half of it."""
    equal = 1 / float(row["groups"])  # the share of each of groups of equal light
    share = (float(row["light_of_largest"]) / max(float(row["light"]), 1e-30) - equal) / (1 - equal)
    return (float(row["variance"]) > 0 and float(row["relmse"]) > 2 * float(row["reference_noise"])
            and share <= MOST_OF_LARGEST and float(row["specular_noise"]) <= MOST_SPECULAR * float(row["noise"])
            and float(row["noise"])**2 >= FEWEST_PIXELS * float(row["noise_squares"]))


TABLE_TEXT = """// SPDX-License-Identifier: Apache-2.0
// Written by benchmarks/error_intervals/fit.py: the coefficients of error_interval.h for each ErrorKind.
#pragma once

#include "risk/error_interval.h"

namespace covary {{

struct FittedErrors {{
  ErrorFeatures middle, log_spread;          ///< a, b
  double min_log_spread, max_log_spread;  ///< of the renders that were fitted
  double low, high;                          ///< quantiles of r
}};

// clang-format off
inline constexpr FittedErrors kFittedErrors[] = {{
{rows}
}};
/// For denoised means of fewer than kMinGroups groups: by filters, by a network.
inline constexpr FittedErrors kFittedToFew[] = {{
{few}
}};
// clang-format on

/// There is no interval if the largest group of each pixel has a larger fraction of the light that is not common to all
/// groups, if the bounds are wider than this factor, if a larger fraction of the noise is in mirrors or behind glass,
/// if fewer pixels hold the noise, or if there are fewer groups and the kind has no separate fit for few groups.
inline constexpr double kMaxOfLargest = {share}, kMaxFactor = {factor}, kMaxSpecular = {specular};
inline constexpr int kMinPixels = {fewest}, kMinGroups = {groups};

}}  // namespace covary
"""


def fit_all(arguments):
    with open(arguments.data, newline="") as file:
        rows = list(csv.DictReader(file))
    texts = {True: [], False: []}
    for kind in KINDS:
        fit = Fit(rows, kind)
        fit.report()
        texts[kind.startswith("few")].append(fit.text())
    TABLE.write_text(TABLE_TEXT.format(rows="\n".join(texts[False]), few="\n".join(texts[True]), share=MOST_OF_LARGEST,
                                       factor=MOST_FACTOR, specular=MOST_SPECULAR, fewest=FEWEST_PIXELS,
                                       groups=FEWEST_GROUPS))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default="covary")
    parser.add_argument("--work", type=Path, default=Path("error-intervals"), help="keeps films and images")
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--variants", nargs="*", default=SCENES)
    parser.add_argument("--only", choices=["render", "measure", "fit"])
    parser.add_argument("--nice", type=int, default=0)
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    for step, function in (("render", render_all), ("measure", measure_all), ("fit", fit_all)):
        if arguments.only in (None, step):
            function(arguments)


if __name__ == "__main__":
    main()
