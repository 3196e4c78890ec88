# SPDX-License-Identifier: Apache-2.0
"""Tests of the growth tables: python -m unittest test_growth."""
import math
import pathlib
import tempfile
import unittest
import xml.etree.ElementTree as xml

from growth import exponent, instances_scene, lights_scene, write_hills


class GrowthTest(unittest.TestCase):
    def test_the_exponent_is_that_of_the_large_numbers(self):
        numbers = [1, 10, 100, 1000, 10000]
        self.assertAlmostEqual(exponent(numbers, [5, 5, 5 * 100**1.5, 5 * 1000**1.5, 5 * 10000**1.5]), 1.5)
        self.assertTrue(math.isnan(exponent([3], [1])))

    def test_lamps_have_the_same_power_together(self):
        for n in (1, 7, 100):
            shapes = xml.fromstring(lights_scene(n)).findall("shape")[1:]
            self.assertEqual(len(shapes), n)
            power = sum(float(s.find("transform/scale").get("value"))**2 * float(s.find("emitter/rgb").get("value"))
                        for s in shapes)
            self.assertAlmostEqual(power, 10, 6)

    def test_a_mesh_has_the_size_that_its_head_tells(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "a.ply")
            self.assertEqual(write_hills(path, 200), 200)
            data = path.read_bytes()
            self.assertEqual(len(data[data.index(b"end_header\n") + 11:]), 11 * 11 * 12 + 200 * 13)

    def test_instances_are_as_many_as_told(self):
        with tempfile.TemporaryDirectory() as folder:
            text, count = instances_scene(170000, pathlib.Path(folder))
        instances = [s for s in xml.fromstring(text).findall("shape") if s.get("type") == "instance"]
        self.assertEqual(len(instances), 9)
        self.assertEqual(count, 9 * 20000)


if __name__ == "__main__":
    unittest.main()
