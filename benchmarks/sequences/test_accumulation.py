# SPDX-License-Identifier: Apache-2.0
"""Tests of known motion and accumulation on synthetic sequences (seeds fixed): python -m unittest
test_accumulation."""
import unittest

import accumulation
import numpy
import scenes

def planes(frames, deviation):
    """The plane of the room's target with a picture of the world on it, as the moving camera sees it."""
    rng, images, positions = numpy.random.default_rng(9), [], []
    for frame in range(1, frames + 1):
        to_world = scenes.camera("camera", frame, frames)
        y, x = numpy.mgrid[0:90, 0:160] + 0.5
        half = numpy.tan(numpy.radians(scenes.fov("camera") / 2))
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
