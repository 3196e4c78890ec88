# SPDX-License-Identifier: Apache-2.0
"""experiment() with methods that are Python functions."""
import unittest

import covary
import numpy
from common import ROOM, PackageTest

SUITE = {"name": "small", "scenes": [{"name": "room", "file": ROOM.name, "resolution": "32x24"}],
         "methods": [{"name": "pt", "options": ["--estimator", "none"]}], "budgets": [{"spp": 16}], "seeds": 2,
         "reference": {"spp": 64}}


class Experiments(PackageTest):
    def experiment(self, suite=None, **methods):
        return covary.experiment(suite or SUITE, self.path / "out", methods=methods, scenes=ROOM.parent)

    def test_functions(self):
        """A method that returns the mean has the mean's error; each call gets its own samples, once."""
        seen = []

        def same(samples):
            film = samples.film()
            seen.append((samples.seed, samples.spp, samples.seconds, film.groups.shape, samples.layer("N").shape,
                         repr(samples)))
            numpy.testing.assert_allclose(film.mean, samples.image, rtol=1e-6)
            return samples.image

        found = self.experiment(same=same)
        cells = {cell["method"]: cell for cell in found.results["cells"]}
        self.assertAlmostEqual(cells["same"]["relmse"]["value"], cells["pt"]["relmse"]["value"], 6)
        self.assertEqual(seen, [(seed, 16, None, (8, 24, 32, 3), (24, 32, 3), "<covary.Samples 32 x 24 of room.xml, 16 "
                                 f"samples per pixel, seed {seed}>") for seed in (1, 2)])
        self.assertEqual({row["method"] for row in found.rows}, {"pt", "same"})
        self.assertIn("2 cells", repr(found))
        row = next(row for row in found.table if row["method"] == "same")
        self.assertEqual((row["scene"], row["spp"]), ("room", 16))
        self.assertAlmostEqual(row["relmse"], cells["pt"]["relmse"]["value"], 6)
        self.assertGreater(row["processor_seconds"], 0)
        self.experiment(same=same)
        self.assertEqual(len(seen), 2, "what is in the cache is not asked for again")

    def test_renderers(self):
        """covary renders nothing for them; they are told what of the scene to make."""
        def own(samples):
            told.append((samples.path, samples.frame, samples.crop, samples.spp))
            return covary.render(covary.Scene.load(samples.scene, resolution=samples.frame), samples.spp, "none",
                                 seed=samples.seed).image

        told = []
        found = covary.experiment(SUITE, self.path / "out", renderers={"own": own}, scenes=ROOM.parent)
        rows = {row["method"]: row for row in found.table}
        self.assertAlmostEqual(rows["own"]["relmse"], rows["pt"]["relmse"], 6)
        self.assertEqual(rows["own"]["samples_per_pixel"], 16)
        self.assertEqual(told, 2 * [("", (32, 24), (0, 0, 32, 24), 16)])

    def test_plot(self):
        class Axes:
            lines = []
            def plot(self, x, y, **style):
                self.lines.append((x, style["label"]))
            def set(self, **words):
                self.words = words
            def legend(self):
                pass
            imshow = None

        axes = self.experiment().plot(Axes())
        self.assertEqual((axes.lines, axes.words["yscale"]), ([((16.0,), "room, pt")], "log"))

    def test_failures(self):
        def wrong(samples):
            raise ValueError("no idea")

        self.assertIn("room, wrong, 16 spp: ValueError: no idea",
                      self.message_of(covary.InputError, self.experiment, wrong=wrong))
        self.assertIn("the shape [3]", self.message_of(covary.InputError, self.experiment,
                                                       flat=lambda samples: numpy.zeros(3)))
        self.assertIn("no suite is named 'quik'; did you mean 'quick'?",
                      self.message_of(covary.UsageError, self.experiment, "quik"))


if __name__ == "__main__":
    unittest.main()
