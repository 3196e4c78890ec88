# SPDX-License-Identifier: Apache-2.0
"""Tests of the comparison itself, on synthetic renders with known errors: python -m unittest test_agreement.

Renders are R = 32 stacks of 64 x 64 pixels, pixel noise of relative deviation 3 / sqrt(16 spp), log-normal (heavy
tails), seeds fixed. With alpha = 2.6e-5 per test the chance that the first test fails although nothing is wrong is
about 4 alpha = 1e-4; the planted errors are all beyond the stated detectable error at power 0.99.
"""
import unittest

import numpy

import agreement

ALPHA = 2.6e-5


def renders(seed, count=32, size=64, deviation=0.75):
    """Unit-mean noise on a smooth coloured picture."""
    rng = numpy.random.default_rng(seed)
    sigma = numpy.sqrt(numpy.log1p(deviation**2))
    noise = rng.lognormal(-sigma**2 / 2, sigma, (count, size, size, 3))
    y, x = numpy.mgrid[0:size, 0:size] / size
    picture = numpy.stack([0.2 + x, 0.2 + y, 1 + 0 * x], axis=-1)
    return noise * picture


class AgreementTest(unittest.TestCase):
    def test_equal_renderers_agree(self):
        result = agreement.agreement(renders(1), renders(2), ALPHA)
        self.assertEqual(result.verdict, "agrees")
        self.assertFalse(result.trace)

    def test_two_percent_brighter_is_rejected(self):
        result = agreement.agreement(renders(1), renders(2) * 1.02, ALPHA)
        self.assertLess(result.mean.detectable[3], 0.02)
        self.assertEqual(result.verdict, "differs")
        self.assertFalse(result.mean_within_bound)

    def test_one_brighter_block_is_rejected(self):
        tested = renders(2, deviation=0.3)
        tested[:, 8:16, 24:32] *= 1.12
        result = agreement.agreement(renders(1, deviation=0.3), tested, ALPHA)
        self.assertLess(result.blocks.detectable[1, 3].max(), 0.12)
        self.assertTrue(result.mean_within_bound)
        self.assertEqual(result.verdict, "differs")

    def test_one_wrong_channel_is_rejected(self):
        tested = renders(2)
        tested[..., 1] *= 0.96
        self.assertEqual(agreement.agreement(renders(1), tested, ALPHA).verdict, "differs")

    def test_small_differences_everywhere_leave_a_trace(self):
        shifted = renders(2)
        for row in range(8):
            for column in range(8):
                factor = 1.02 if (row + column) % 2 else 0.98
                shifted[:, 8 * row : 8 * row + 8, 8 * column : 8 * column + 8] *= factor
        result = agreement.agreement(renders(1), shifted, ALPHA)
        self.assertTrue(result.mean_within_bound)
        self.assertLess(result.permutation_p, ALPHA)

    def test_a_mean_outside_the_bound_by_noise_is_told_apart(self):
        result = agreement.agreement(renders(1, 16, 16, 6), renders(2, 16, 16, 6), ALPHA)
        self.assertGreater(result.mean.detectable.max(), 0.005)
        self.assertIn(result.verdict, ("noise", "agrees"))

    def test_pixels_that_are_not_finite_are_dropped_and_counted(self):
        tested = renders(2)
        tested[3, 5, 7, 1] = numpy.nan
        tested[4, 6, 8, 0] = numpy.inf
        result = agreement.agreement(renders(1), tested, ALPHA)
        self.assertEqual(result.dropped_pixels, 2)
        self.assertEqual(result.verdict, "agrees")

    def test_p_values_are_uniform_under_the_null(self):
        # 200 pairs of small stacks; Kolmogorov-Smirnov rejects at 1e-3, and p-values of a test that can never fail
        # (all near 1) or that always fails would be rejected with certainty.
        from scipy import stats

        rng = numpy.random.default_rng(7)
        data = rng.standard_normal((200, 2, 16, 6)) + 10
        p = [agreement.welch(a, b, ALPHA).p_value for a, b in data]
        self.assertGreater(stats.kstest(p, "uniform").pvalue, 1e-3)
        q = [agreement.permutation(a, b, permutations=500) for a, b in data]
        self.assertGreater(stats.kstest(q, "uniform").pvalue, 1e-3)
        wrong = [agreement.welch(a, b + 0.5, ALPHA).p_value for a, b in data]
        self.assertLess(stats.kstest(wrong, "uniform").pvalue, 1e-3)

    def test_blocks_at_the_border_are_means_of_what_is_there(self):
        images = numpy.arange(2 * 10 * 12 * 3, dtype=float).reshape(2, 10, 12, 3)
        blocks = agreement.block_means(images)
        self.assertEqual(blocks.shape, (2, 2, 2, 3))
        numpy.testing.assert_allclose(blocks[1, 1, 1], images[1, 8:, 8:].mean(axis=(0, 1)))


if __name__ == "__main__":
    unittest.main()
