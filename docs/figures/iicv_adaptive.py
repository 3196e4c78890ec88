#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Adaptive sampling by Eq. (8), which Yang and Moon 2025 leave for later: gains over as many independent samples in
every pixel, of the published estimator in double precision (iicv_oracle.py). Needs numpy.

By Eq. (8) the variance of pixel p has the term beta_pq^2 sigma_q^2 / N_q for each control variate q. Its derivative
says where samples pay: for the least relMSE in sum,

    N_q ~ sigma_q sqrt(sum_p beta_pq^2 / (F_p^2 + 0.01)).

A third of the samples is spread uniformly first, and gives beta, sigma and F; N is at least 0.7 and at most twice the
mean, as with --adaptive. Beside it: counts by sigma_q / sqrt(F_q^2 + 0.01) alone, damped by a root as those of
--adaptive, and Eq. (8) with sigma and F known nearly exactly. All take their samples from one render of twice as many,
in pairs."""
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import iicv_oracle as oracle  # noqa: E402

PAIR = 2
LEAST = 0.7


def counts_of(demand, least, mean, most):
    """In pairs, from `least` to `most`, in proportion to `demand`, with this mean."""
    low, high = 0.0, most / max(demand.min(), 1e-12)
    for _ in range(60):
        factor = (low + high) / 2
        if np.clip(factor * demand, least, most).mean() < mean:
            low = factor
        else:
            high = factor
    return np.rint(np.clip(high * demand, least, most)).astype(int)


def demand_by_eq8(beta, y, x, deviation, grey):
    """N_q up to a factor."""
    influence = np.zeros_like(deviation)
    np.add.at(influence, (y, x), beta ** 2 / (grey ** 2 + 0.01)[..., None])
    return deviation * np.sqrt(influence)


def mean_of_first(pool, counts):
    sums = np.cumsum(pool, 0)
    rows, columns = np.indices(counts.shape)
    return sums[counts - 1, rows, columns] / counts[..., None]


def deviation_of(pool):
    """Of one pair; variances are averaged over neighbours, as those of --adaptive are: its own samples would give a
    pixel that is dark by chance few more."""
    return np.sqrt(np.nanmean(oracle.windows(pool.var(0, ddof=1), np.nan).sum(-1), -1))


def images_of(crn, pool, other, mean, references):
    """By name; `pool`: the independent samples, [pair][y][x][channel], `other`: more, to know sigma from, `mean`: pairs
    per pixel."""
    first = mean // 3
    h = pool[:first].mean(0)
    beta, y, x = oracle.coefficients(crn, oracle.pilot_error(crn, h))
    grey = oracle.estimate(crn, h, oracle.pilot_error(crn, h)).mean(-1)
    exact = references.mean(0)
    deviation, known = deviation_of(pool[:first]), deviation_of(other)
    demands = {"uniform": np.ones(grey.shape),
               "sigma, damped": np.sqrt(deviation / np.sqrt(grey ** 2 + 0.01)),
               "Eq. (8)": demand_by_eq8(beta, y, x, deviation, grey),
               "Eq. (8), known": demand_by_eq8(beta, y, x, known, exact.mean(-1))}
    images = {}
    for name, demand in demands.items():
        chosen = mean_of_first(pool, counts_of(demand, LEAST * mean, mean, len(pool)))
        images[name] = oracle.estimate(crn, chosen, oracle.pilot_error(crn, chosen))
    return images


def main(options):
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        view = (options.scene, "--rfilter", "box", "--estimator", "none", *options.view)
        references = oracle.references_of(options, folder)
        errors = {}
        for seed in range(1, options.seeds + 1):
            def groups(name, *words):
                oracle.run(options, "render", *view, *words, "--passes", folder / name, "-o", folder / "image.exr")
                return oracle.read_groups(next((folder / name).glob("*.exr")))
            crn = groups("crn", "--sampling", "crn", "--groups", 12, "--spp", options.spp // 2, "--seed", seed)
            pool, other = (groups("independent", "--groups", options.spp // PAIR, "--spp", options.spp, "--seed", s)
                           for s in (seed, seed + 1000))
            for name, image in images_of(crn, pool, other, options.spp // 2 // PAIR, references).items():
                errors.setdefault(name, []).append(oracle.rel_mse(image, references))
        means = {name: np.mean(values) for name, values in errors.items()}
        for name, error in means.items():
            print(f"{name}: relMSE {error:.5g}, gain {means['uniform'] / error:.3f}")


if __name__ == "__main__":
    main(oracle.arguments(__doc__))
