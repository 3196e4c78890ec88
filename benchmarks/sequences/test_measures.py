# SPDX-License-Identifier: Apache-2.0
"""Tests of measures and of known motion on synthetic sequences (seeds fixed): python -m unittest test_measures."""
import unittest

import accumulation
import measures
import numpy
import scenes

SHAPE = (4, 64, 96, 3)


class SyntheticSequence(unittest.TestCase):
    """Images around 1 of known error: a bias that stays, noise of each frame, references as noisy as the images."""

    def setUp(self):
        self.rng = numpy.random.default_rng(5)
        self.truth = numpy.broadcast_to(1 + 0.2 * self.rng.random((1, *SHAPE[1:])), SHAPE)
        self.references = [self.truth + self.noise(0.1) for _ in range(2)]

    def noise(self, deviation, *shape):
        return deviation * self.rng.standard_normal(shape or SHAPE)

    def images(self, bias, deviation, seeds=1):
        return numpy.stack([self.truth + bias + self.noise(deviation) for _ in range(seeds)])

    def test_error_of_frames_without_the_references_noise(self):
        # 73728 products of standard deviation below 0.1: their mean has one of 4e-4, and weights that know the
        # references' noise of 10 % add 3 % of that noise's part.
        images = self.images(0.2, 0.1)
        weight = measures.weights(*self.references).mean()
        error = measures.frame_errors(images, *self.references).error.mean()
        self.assertAlmostEqual(error, weight * (0.2**2 + 0.1**2), delta=0.002)
        noisy = (measures.weights(*self.references) * (images[0] - self.references[0])**2).mean()
        self.assertGreater(noisy, error + 0.006)  # what one reference tells

    def test_temporal_error_leaves_out_what_stays(self):
        weight = measures.of_differences(measures.weights(*self.references)).mean()
        error = measures.temporal_errors(self.images(0.2, 0.1), *self.references).error.mean()
        self.assertAlmostEqual(error, weight * 2 * 0.1**2, delta=0.004)

    def test_squared_bias_leaves_out_noise(self):
        weight = measures.weights(*self.references).mean()
        bias = measures.squared_bias(self.images(0.2, 0.3, seeds=8), *self.references)
        self.assertAlmostEqual(bias, weight * 0.2**2, delta=0.004)
        with self.assertRaisesRegex(ValueError, "two seeds or more; found 1"):
            measures.squared_bias(self.images(0.2, 0.3), *self.references)

    def test_worst_region_finds_a_planted_trail(self):
        alone = self.images(0, 0.3)
        better = self.images(0, 0.2)
        better[0, 2, 32:, 64:] += 0.6  # one region of one frame: 0.4 / 0.09 of the error alone
        errors = [measures.frame_errors(images, *self.references) for images in (better, alone)]
        worst = measures.worst_region(*errors, over_frames=False)
        self.assertEqual((worst.frame, worst.row, worst.column), (2, 1, 2))
        self.assertAlmostEqual(worst.ratio, 4.4, delta=0.6)
        worst = measures.worst_region(*errors, over_frames=True)
        self.assertEqual((worst.row, worst.column), (1, 2))
        self.assertAlmostEqual(worst.ratio, (0.04 * 4 + 0.36) / 4 / 0.09, delta=0.25)

    def test_regions_that_the_references_do_not_tell_are_left_out(self):
        exact = self.images(0, 0)
        errors = measures.frame_errors(exact, *self.references)
        with self.assertRaisesRegex(ValueError, "too noisy"):
            measures.worst_region(errors, errors, over_frames=False)
        alone = self.images(0, 0.3)
        alone[0, :, :32, :32] = self.truth[:, :32, :32]
        worst = measures.worst_region(measures.frame_errors(alone, *self.references),
                                      measures.frame_errors(alone, *self.references), over_frames=False)
        self.assertEqual(worst.left_out, 4)
        self.assertEqual(worst.ratio, 1)

    def test_regions_cover_the_image(self):
        self.assertEqual(measures.region_starts(90), [0, 32, 58])
        self.assertEqual(measures.region_starts(64), [0, 32])
        with self.assertRaisesRegex(ValueError, "32 pixels or more a side; found 31"):
            measures.region_starts(31)

    def test_unchanged_blocks(self):
        references = [self.truth + self.noise(0.01) for _ in range(2)]
        for side in references:
            side[2, :8, 8:16] += 0.3
        still = measures.unchanged(*references)
        self.assertTrue(still[0].all())
        self.assertFalse(still[1, :8, 8:16].any())
        self.assertEqual((~still[1]).sum(), 64)


def planes(frames, deviation):
    """The plane of the room's target with a picture of the world on it, as the moving camera sees it."""
    rng, images, positions = numpy.random.default_rng(9), [], []
    for frame in range(1, frames + 1):
        to_world = scenes.camera("camera", frame, frames)
        y, x = numpy.mgrid[0:90, 0:160] + 0.5
        half = numpy.tan(numpy.radians(scenes.FOV / 2))
        rays = numpy.stack([(80 - x) / 80 * half, (45 - y) / 80 * half, numpy.ones_like(x)], -1)
        rays = rays @ to_world[:3, :3].T
        distance = (-1 - to_world[2, 3]) / rays[..., 2]
        points = to_world[:3, 3] + distance[..., None] * rays
        positions.append(points)
        images.append(1 + 0.3 * numpy.sin(2 * points) + deviation * rng.standard_normal(points.shape))
    return numpy.stack(images), numpy.stack(positions)


class KnownMotion(unittest.TestCase):
    def test_camera_projects_what_lies_ahead_to_the_middle(self):
        to_world = scenes.look_at((0.5, 1.45, 3.8), (-0.1, 0.95, -1))
        places, depth = accumulation.projected(numpy.array([[-0.1, 0.95, -1]]), to_world, 320, 180)
        numpy.testing.assert_allclose(places, [[160, 90]], atol=1e-9)
        self.assertAlmostEqual(depth[0], numpy.linalg.norm([0.6, 0.5, 4.8]))

    def test_directions_of_the_image(self):
        to_world = scenes.look_at((0, 0, 5), (0, 0, 0))
        places, _ = accumulation.projected(numpy.array([[1.0, 0, 0], [0, 1, 0]]), to_world, 320, 180)
        self.assertGreater(places[0, 0], 160)  # x to the right
        self.assertLess(places[1, 1], 90)  # y down

    def test_points_of_the_box_move_and_others_stay(self):
        corner = accumulation.transformed(scenes.box(5, 8), numpy.array([1.0, 1, 1]))
        floor = numpy.array([1.0, 0, 1])
        then = accumulation.before("box", numpy.stack([corner, floor]), 5, 8)
        numpy.testing.assert_allclose(then[0], accumulation.transformed(scenes.box(4, 8), numpy.array([1.0, 1, 1])))
        numpy.testing.assert_allclose(then[1], floor)

    def test_planted_sign_of_motion_is_found(self):
        images, positions = planes(3, 0)
        right = numpy.stack([numpy.zeros((90, 160, 2))]
                            + [accumulation.motion("camera", positions[i], i + 1, 3)[0] for i in (1, 2)])
        self.assertEqual(accumulation.motion_agreement("camera", positions, right), 1)
        self.assertLess(accumulation.motion_agreement("camera", positions, -right), 0.1)

    def test_bilinear_values(self):
        y, x = numpy.mgrid[0:6, 0:8] + 0.5
        image = numpy.stack([x, y, x + y], -1)
        values, inside = accumulation.bilinear(image, numpy.array([[3.2, 2.9], [7.9, 0.1], [8.1, 3]]))
        numpy.testing.assert_allclose(values[0], [3.2, 2.9, 6.1])
        numpy.testing.assert_array_equal(inside, [True, True, False])


class Accumulation(unittest.TestCase):
    def test_moving_camera_without_noise_stays_as_it_is(self):
        images, positions = planes(4, 0)
        result = accumulation.accumulated("camera", images, positions)
        self.assertLess(numpy.abs(result - images).max(), 1e-3)  # what interpolation costs
        wrong = accumulation.accumulated("lamp", images, positions)  # motion that is not told
        self.assertGreater(numpy.abs(wrong - images).mean(), 1e-3)

    def test_noise_falls(self):
        exact, _ = planes(6, 0)
        images, positions = planes(6, 0.1)
        result = accumulation.accumulated("camera", images, positions)
        # Without interpolation a / (2 - a) + (1 - a)^10 ... = 0.20 of the variance; that lowers it further.
        self.assertLess(((result - exact)[-1]**2).mean(), 0.25 * 0.1**2)


if __name__ == "__main__":
    unittest.main()
