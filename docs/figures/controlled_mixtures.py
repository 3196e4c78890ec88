#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""controlled_mixtures.py OUT.jpg: the first picture of docs/methods/controlled-mixture-sampling.md. Needs
`pip install numpy matplotlib pillow`. controlled_mixtures.py weights: a table of other weights of the mixtures; needs
numpy.

The demonstrations of Hua et al. 2023, Sec. 5, in one dimension: one sample from a mixture of densities, without and
with the control variate made of these densities. Above: the integrand, and the densities times their probabilities.
Below: the estimate from one sample at x, without control (f/p) and with it. Where it is constant, there is no noise.

The table has variances with control: with the given weights, with those that are best without control, and with those
chosen jointly with it [He and Owen 2014], in steps of 1/20."""
import itertools
import sys

import numpy as np

N = 400
X = (np.arange(N) + 0.5) / N
STEPS = 20  # weights are multiples of 1 / STEPS
COLOURS = ["#1098ad", "#d6336c", "#e6a700"]


def bump(centre, width):
    return np.exp(-0.5 * ((X - centre) / width) ** 2)


def sine(sign):
    return np.maximum(sign * np.sin(2 * np.pi * X), 0)


def problems():
    """Title, integrands, and probability and shape of each density."""
    sky, sun = 1 - 0.5 * X, 1 + 30 * bump(0.7, 0.02)
    blue = 1 / (1 + np.exp((X - 0.5) / 0.05))
    return [("a perfect density, rarely used", [sky], [(0.1, sky), (0.9, 0.05 + X**2)]),
            ("signs", [np.sin(2 * np.pi * X)], [(0.5, sine(1)), (0.5, sine(-1))]),
            ("a sun sampled too little", [sun], [(0.5, np.ones(N)), (0.3, 1 + 0.5 * X), (0.2, bump(0.69, 0.03))]),
            ("colours", [blue, 1 - blue], [(0.5, np.ones(N)), (0.25, bump(0.25, 0.12)), (0.25, bump(0.75, 0.12))])]


def controlled(f, counts, densities):
    """The estimate from a sample at x with the best coefficients, from A beta = b by quadrature."""
    p = counts @ densities
    r = counts[:, None] * densities / p
    beta = np.linalg.lstsq((r * p) @ r.T / N, r @ f / N, rcond=None)[0]
    return f / p + counts @ beta - beta @ r


def variance(values, p):
    mean = (values * p).mean()
    return ((values - mean) ** 2 * p).mean()


def variances(integrands, counts, densities):
    """Without and with control, summed over the integrands."""
    p = counts @ densities
    return (sum(variance(f / p, p) for f in integrands),
            sum(variance(controlled(f, counts, densities), p) for f in integrands))


def choices_of_weights():
    """Title -> variances with control of the given weights, of the best without control, and of the best with it."""
    rows = {}
    for title, integrands, components in problems():
        given = np.array([count for count, _ in components])
        densities = np.array([shape / shape.mean() for _, shape in components])
        choices = [np.array(parts) / STEPS for parts in itertools.product(range(1, STEPS), repeat=len(given))
                   if sum(parts) == STEPS]
        found = [variances(integrands, counts, densities) for counts in choices]
        rows[title] = (variances(integrands, given, densities)[1], min(found)[1], min(after for _, after in found))
    return rows


def draw(out):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(2, 4, figsize=(13, 5), height_ratios=[1, 1.2], sharex=True)
    for (title, integrands, components), (above, below) in zip(problems(), axes.T):
        counts = np.array([count for count, _ in components])
        densities = np.array([shape / shape.mean() for _, shape in components])
        p = counts @ densities
        for count, density, colour in zip(counts, densities, COLOURS):
            above.fill_between(X, count * density, color=colour, alpha=0.35, linewidth=0)
        before = after = 0
        for f, style in zip(integrands, ["-", ":"]):
            estimate = controlled(f, counts, densities)
            before, after = before + variance(f / p, p), after + variance(estimate, p)
            above.plot(X, f / np.abs(f).max() * (counts[:, None] * densities).max(), "k" + style, linewidth=1)
            below.plot(X, f / p, style, color="#868e96", label="f/p" if style == "-" else None)
            below.plot(X, estimate, style, color="#2b8a3e", label="controlled" if style == "-" else None)
        above.set_title(title, fontsize=10)
        ratio = "0" if after < 1e-9 * before else f"{after / before:.2f}"
        below.set_xlabel(f"variance: {ratio} of plain", fontsize=9)
        above.set_yticks([]), above.set_xticks([])
        below.tick_params(labelsize=7)
    axes[1, 0].legend(fontsize=8, frameon=False)
    figure.tight_layout()
    figure.savefig(out, dpi=75)


def main(out):
    if out != "weights":
        return draw(out)
    for title, values in choices_of_weights().items():
        print(f"{title}:", ", ".join(f"{value:.3g}" if value > 1e-9 else "0" for value in values))


if __name__ == "__main__":
    main(*sys.argv[1:])
