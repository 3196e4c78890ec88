# SPDX-License-Identifier: Apache-2.0
"""fit.py --program COVARY [--work FOLDER] [--only render|fit]

Fits the intervals that covary gives of its errors (src/risk/error_interval.h): renders the scenes of variants.py with
few samples and with many, as far as FOLDER does not hold them yet; asks the program for the error sums of each image
and compares the image with two references, relMSE in product form; writes both to renders.csv beside this file; and
writes the coefficients that fit them best to src/risk/error_interval_table.h. Needs numpy.

The middle is a ridge regression of log(relMSE / anchor), the spread one of the log of what it leaves open; each render
counts by how well its references know its error, and the quantiles are those of scenes that were left out."""
import argparse
import csv
import json
import math
import subprocess
from pathlib import Path

import numpy
from variants import VARIANTS, write_variant

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
TABLE, DATA = ROOT / "src/risk/error_interval_table.h", HERE / "renders.csv"
SIZE, GROUPS = "96x54", 12
RENDERS = [(16, 1), (16, 2), (48, 1), (144, 1)]
REFERENCE_SPP, REFERENCE_SEEDS = 160, (1001, 1002)
#: How images are made of films, in the order of the table.
KINDS = ["filters", "network"]
#: Sigma of the prior of each coefficient but the constant; what is added to the reference's noise
RIDGE, NOISE_FLOOR = 0.1, 0.1
#: difference of logarithms from which on a render counts little
OUTLIER = 0.5
TRUSTED, LEAST, MOST = 0.5, 0.25, 4
MOST_OF_LARGEST, MOST_FACTOR, FEWEST_PIXELS, FEWEST_OF_PIXELS = 0.6, 5, 20, 0.02


def run(arguments, program, *words):
    command = ["nice", "-n", str(arguments.nice), program, *map(str, words)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode:
        raise SystemExit(f"{' '.join(command)}\n{result.stderr}")


def render_all(arguments):
    """Films of every variant, where they are missing."""
    folder = arguments.work
    for name in arguments.variants:
        scene = write_variant(name, ROOT / "scenes", folder)
        films = [(f"{name}-{spp}-{seed}", spp, seed,
                  ["--groups", GROUPS, "--aovs"]) for spp, seed in RENDERS]
        films += [(f"{name}-ref-{seed}", REFERENCE_SPP, seed, []) for seed in REFERENCE_SEEDS]
        for stem, spp, seed, more in films:
            if not (folder / f"{stem}.done").exists():
                run(arguments, arguments.program, "render", *scene, "--resolution", SIZE, "--rfilter", "box",
                    "--estimator", "none", "--denoise", "none", "--spp", spp, "--seed", seed, *more, "--quiet",
                    "--overwrite", "-o", folder / f"{stem}.exr")
                (folder / f"{stem}.done").touch()


def pixels(arguments, path):
    """The image of a file, in double precision."""
    raw = arguments.work / "pixels.pfm"
    run(arguments, arguments.program, "convert", path, raw, "--overwrite")
    with open(raw, "rb") as file:
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        kind = "<f4" if float(file.readline()) < 0 else ">f4"
        return numpy.frombuffer(file.read(), kind).reshape(height, width, 3)[::-1].astype(float)


def relmse(image, first, second):
    """In product form, and the standard error that the noise of the references gives it."""
    mean = (first + second) / 2
    weight = 1 / (mean.mean(2, keepdims=True)**2 + 0.01)
    product = (weight * (image - first) * (image - second)).mean(2)
    cross = (weight * (image - mean) * (first - second)).mean(2)
    square = (weight * (first - second)**2 / 4).mean(2)
    return product.mean(), math.sqrt((cross.var() + square.var()) / cross.size)


def measure_all(arguments):
    """A row for each image: kind, truth and the sums that the program tells."""
    rows = []
    for name in arguments.variants:
        references = [pixels(arguments, arguments.work / f"{name}-ref-{seed}.exr") for seed in REFERENCE_SEEDS]
        for spp, seed in RENDERS:
            for kind in KINDS:
                image, facts = measure(arguments, kind, arguments.work / f"{name}-{spp}-{seed}.exr")
                if not facts.get("error_sums"):
                    continue
                truth, noise = relmse(pixels(arguments, image), *references)
                rows.append({"scene": name, "kind": kind, "spp": spp, "seed": seed, "relmse": truth,
                             "reference_noise": noise, **facts["error_sums"]})
        print(name, flush=True)
    with open(arguments.data, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: f"{value:.6g}" if isinstance(value, float) else value for key, value in row.items()}
                         for row in rows)


def measure(arguments, kind, film):
    """The image of a film, and what the program tells of it."""
    image, facts = arguments.work / "image.exr", arguments.work / "facts.json"
    off = ["--oidn", "off"] if kind == "filters" else []
    run(arguments, arguments.program, "combine", "--independent", film, "--guides", film, "--denoise", "auto", *off,
        "-o", image, "--json", facts, "--quiet")
    return image, json.loads(facts.read_text())


def ratio(total, squares, parts, whole):
    least = max(total, LEAST * whole)
    scatter = math.sqrt(max(0, squares - total * total / max(parts, 1))) / least
    trust = 1 / (1 + scatter**2 / TRUSTED**2)
    return trust * math.log(min(least / whole, MOST)), 1 - trust


def features(row):
    """error_features() of src/risk/error_interval.cpp."""
    s = {key: float(value) for key, value in row.items() if key not in ("scene", "kind")}
    plain = ratio(s["error"], s["squares"], s["parts"], s["variance"])
    scaled = ratio(s["scaled_error"], s["scaled_squares"], s["parts"], s["scaled_variance"])
    return [1, plain[0], plain[1], scaled[0], math.log(s["noise"] / s["variance"]), math.log(s["noise"] / s["values"]),
            math.log(s["fourth_powers"] / s["squared_deviations"]),
            math.log(s["noise"]**2 / s["noise_squares"]),
            math.log(s["light_of_largest"] * s["groups"] / s["light"]),
            math.log(s["predicted"] / s["variance"])]


def weighted_ridge(x, y, weight):
    """Coefficients; all but the first are drawn to 0."""
    penalty = numpy.full(x.shape[1], 1 / RIDGE**2)
    penalty[0] = 1e-6
    scale = numpy.maximum(x.std(0), 1e-3)  # sigma is of the feature's own spread
    scale[0] = 1
    z = x / scale
    matrix = z.T @ (z * weight[:, None]) + numpy.diag(penalty)
    return numpy.linalg.solve(matrix, z.T @ (weight * y)) / scale


class Fit:
    """Of one kind: a, b, limits of log s and quantiles of r."""

    def __init__(self, rows, kind):
        self.rows = [row for row in rows if row["kind"] == kind and usable(row)]
        self.kind = kind
        self.x = numpy.array([features(row) for row in self.rows])
        variance = numpy.array([float(r["variance"]) / float(r["values"]) for r in self.rows])
        truth = numpy.array([float(r["relmse"]) for r in self.rows])
        self.noise = numpy.array([float(r["reference_noise"]) for r in self.rows]) / truth
        self.y = numpy.log(truth / variance)
        self.scenes = numpy.array([r["scene"] for r in self.rows])
        everything = numpy.ones(len(self.rows), bool)
        self.middle, self.spread = self.coefficients(everything)
        self.limits = self.log_spread_limits(self.x @ self.spread)
        r = numpy.empty(len(self.rows))
        self.left_out = numpy.empty(len(self.rows))
        for scene in set(self.scenes):
            out = self.scenes == scene
            middle, spread = self.coefficients(~out)
            limits = self.log_spread_limits(self.x[~out] @ spread)
            self.left_out[out] = self.y[out] - self.x[out] @ middle
            r[out] = self.left_out[out] / numpy.exp(numpy.clip(self.x[out] @ spread, *limits))
        self.r = r
        self.quantiles = numpy.quantile(r, (0.1, 0.9))

    @staticmethod
    def log_spread_limits(values):
        return values.min(), values.max()

    def coefficients(self, use):
        x, y, noise = self.x[use], self.y[use], self.noise[use]
        weight = 1 / (NOISE_FLOOR + noise**2)
        middle = weighted_ridge(x, y, weight)
        for _ in range(20):  # renders that nothing explains, which light that was not found makes, count little
            middle = weighted_ridge(x, y, weight / (1 + ((y - x @ middle) / OUTLIER)**2)**2)
        left = numpy.log(numpy.clip(abs(y - x @ middle), 0.03, 1)) + 0.635  # E log |normal number| = -0.635
        wanted = numpy.array([1, 0, 1, 0, 0, 0, 1, 1, 1, 0])  # what speaks for noise and for rare light
        spread = numpy.zeros(x.shape[1])
        spread[wanted > 0] = weighted_ridge(x[:, wanted > 0], left, weight / 4)
        return middle, spread

    def text(self):
        numbers = lambda values: "{" + ", ".join(f"{v:.4g}" for v in values) + "}"  # noqa: E731
        return (f"    {{{numbers(self.middle)},\n     {numbers(self.spread)},\n     {self.limits[0]:.4g}, "
                f"{self.limits[1]:.4g}, {self.quantiles[0]:.4g}, {self.quantiles[1]:.4g}}},")

    def report(self):
        off = numpy.exp(self.left_out)
        print(f"{self.kind}: {len(self.rows)} renders of {len(set(self.scenes))} scenes; left-out scenes: true over "
              f"middle {numpy.exp(self.left_out.mean()):.2f} times or over {numpy.exp(self.left_out.std()):.2f}, "
              f"largest {off.max():.2f}, least {off.min():.2f}; median factor of the bounds "
              f"{numpy.exp(numpy.median(numpy.exp(self.x @ self.spread)) * abs(self.quantiles).max()):.2f}")


def usable(row):
    """Whether an interval would be given, and the references know the error to half of it."""
    share = float(row["light_of_largest"]) / max(float(row["light"]), 1e-30)
    return (float(row["variance"]) > 0 and float(row["relmse"]) > 2 * float(row["reference_noise"])
            and share <= MOST_OF_LARGEST
            and float(row["noise"])**2 >= max(FEWEST_PIXELS, FEWEST_OF_PIXELS * float(row["values"]) / 3)
            * float(row["noise_squares"]))


TABLE_TEXT = """// SPDX-License-Identifier: Apache-2.0
// Written by benchmarks/error_intervals/fit.py: the coefficients of error_interval.h, without a network and with one.
#pragma once

#include "risk/error_interval.h"

namespace covary {{

struct FittedErrors {{
  ErrorFeatures middle, log_spread;          ///< a, b
  double least_log_spread, most_log_spread;  ///< of the renders that were fitted
  double low, high;                          ///< quantiles of r
}};

// clang-format off
inline constexpr FittedErrors kFittedErrors[] = {{
{rows}
}};
// clang-format on

/// Where the largest group of each pixel has a larger share of the light, the bounds are further off than this factor,
/// or fewer pixels hold the noise, as a number or as a fraction of all, there is no interval.
inline constexpr double kMostOfLargest = {share}, kMostFactor = {factor};
inline constexpr double kFewestPixels = {fewest}, kFewestOfPixels = {fraction};

}}  // namespace covary
"""


def fit_all(arguments):
    with open(arguments.data, newline="") as file:
        rows = list(csv.DictReader(file))
    fits = []
    for kind in KINDS:
        fits.append(Fit(rows, kind))
        fits[-1].report()
    TABLE.write_text(TABLE_TEXT.format(rows="\n".join(fit.text() for fit in fits), share=MOST_OF_LARGEST,
                                       factor=MOST_FACTOR, fewest=FEWEST_PIXELS,
                                       fraction=FEWEST_OF_PIXELS))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default="covary")
    parser.add_argument("--work", type=Path, default=Path("error-intervals"), help="keeps films and images")
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--variants", nargs="*", default=list(VARIANTS))
    parser.add_argument("--only", choices=["render", "measure", "fit"])
    parser.add_argument("--nice", type=int, default=0)
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    for step, function in (("render", render_all), ("measure", measure_all), ("fit", fit_all)):
        if arguments.only in (None, step):
            function(arguments)


if __name__ == "__main__":
    main()
