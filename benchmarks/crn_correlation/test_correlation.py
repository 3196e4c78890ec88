# SPDX-License-Identifier: Apache-2.0
"""Tests of the measure on synthetic groups (seeds fixed): python -m unittest test_correlation."""
import unittest

import numpy

from correlation import neighbour_correlation


class CorrelationTest(unittest.TestCase):
    def test_independent_pixels_have_none(self):
        # 160 x 239 pairs: the standard deviation of the average is 1 / sqrt(11 * 38240) = 0.0015; five of them.
        result = neighbour_correlation(numpy.random.default_rng(1).standard_normal((12, 160, 240)))
        self.assertEqual(result.pairs, 160 * 239)
        self.assertAlmostEqual(result.null_error, 0.00154, places=4)
        self.assertLess(abs(result.mean), 5 * result.null_error)

    def test_known_correlation_is_found(self):
        # Common part of variance share 0.8. Pearson's r over T groups has expectation about rho (1 - (1 - rho^2) / 2T).
        rng = numpy.random.default_rng(2)
        common = rng.standard_normal((12, 160, 1))
        groups = numpy.sqrt(0.8) * common + numpy.sqrt(0.2) * rng.standard_normal((12, 160, 240))
        expected = 0.8 * (1 - (1 - 0.64) / 24)
        self.assertAlmostEqual(neighbour_correlation(groups).mean, expected, delta=0.02)

    def test_planted_mistakes_change_the_result(self):
        rng = numpy.random.default_rng(3)
        common = rng.standard_normal((12, 60, 1))
        groups = common + 0.3 * rng.standard_normal((12, 60, 80)) + 5
        right = neighbour_correlation(groups).mean
        shuffled = numpy.stack([rng.permutation(groups[:, y].T).T for y in range(60)], axis=1)
        self.assertAlmostEqual(neighbour_correlation(shuffled).mean, right, delta=0.02)  # order along a row is free
        scrambled = rng.permuted(groups, axis=0)  # groups of each pixel in another order
        self.assertLess(abs(neighbour_correlation(scrambled).mean), 0.05)

    def test_identical_pixels_have_one_and_constant_ones_are_left_out(self):
        groups = numpy.repeat(numpy.arange(12.0)[:, None, None], 4, axis=1).repeat(6, axis=2)
        groups[:, :, 0] = 3
        result = neighbour_correlation(groups)
        self.assertEqual(result.constant_pairs, 4)
        self.assertAlmostEqual(result.mean, 1)

    def test_two_groups_are_refused(self):
        with self.assertRaisesRegex(ValueError, "at least 3 of them; the film has 2"):
            neighbour_correlation(numpy.zeros((2, 4, 4)))


if __name__ == "__main__":
    unittest.main()
