# SPDX-License-Identifier: Apache-2.0
"""experiment() with methods that are Python functions."""
import contextlib
import inspect
import io
import re
import sys
import threading
import unittest
import warnings

import covary
import numpy
from common import ROOM, PackageTest

SUITE = {"name": "small", "scenes": [{"name": "room", "file": ROOM.name, "resolution": "32x24"}],
         "methods": [{"name": "pt", "options": ["--estimator", "none"]}], "budgets": [{"spp": 16}], "seeds": 2,
         "reference": {"spp": 64}}


SEEN = []
GAIN = [1.0]


def log(fact):
    """Past the function's identity, of which a list that it fills would be a part."""
    getattr(sys.modules[__name__], "SEEN").append(fact)  # noqa: B009


def scaled(samples, gain):
    return gain * samples.image


class Experiments(PackageTest):
    def experiment(self, suite=None, **methods):
        return covary.experiment(suite or SUITE, self.path / "out", methods=methods, scenes=ROOM.parent)

    def test_functions(self):
        """A method that returns the mean has the mean's error; each call gets its own samples, once."""
        seen = SEEN
        seen.clear()

        def same(samples):
            film = samples.film()
            log((samples.seed, samples.spp, samples.seconds, film.groups.shape, samples.layer("N").shape,
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

    def test_changed_values(self):
        """What a function was made with, and what it refers to, is a part of it."""
        def by_closure(gain):
            return lambda samples: scaled(samples, gain)

        def by_global(gain):
            GAIN[0] = gain
            return lambda samples: scaled(samples, GAIN[0])

        def errors(make):
            return [next(row["relmse"] for row in self.experiment(mine=make(gain)).table if row["method"] == "mine")
                    for gain in (1.0, 0.5)]

        expected = errors(by_closure)
        self.assertLess(expected[0], 0.15)
        self.assertGreater(expected[1], 0.15, "half as bright")
        self.assertEqual(errors(by_global), expected)

    def test_unknown_values(self):
        """What cannot be told from another is computed again, and said so."""
        lock, seen = threading.Lock(), SEEN
        seen.clear()

        def locked(samples):
            with lock:
                log(samples.seed)
                return samples.image

        for _ in range(2):
            with self.assertWarnsRegex(covary.CovaryWarning, "'locked' is computed again each time, .*: lock, a "
                                                             r"_thread\.lock") as warned:
                self.experiment(locked=locked)
        self.assertEqual(seen, [1, 2, 1, 2])
        self.assertEqual(warned.filename, __file__)

    def test_progress(self):
        """A function gets finished and all runs; nothing is said unasked where nobody watches."""
        told, said = [], io.StringIO()
        with contextlib.redirect_stderr(said):
            covary.experiment(SUITE, self.path / "out", scenes=ROOM.parent, progress=lambda *runs: told.append(runs))
            covary.experiment(SUITE, self.path / "out", scenes=ROOM.parent)
        self.assertEqual(said.getvalue(), "")
        self.assertEqual({total for _, total in told} - {0}, {4}, told)  # two references and two seeds
        self.assertEqual(sorted(told), told)
        self.assertEqual(told[-1], (4, 4))
        with contextlib.redirect_stderr(said):
            covary.experiment(SUITE, self.path / "log", scenes=ROOM.parent, progress=True)
        self.assertRegex(said.getvalue(), r"^(\[\d/4.*\] room, .*\n)+$")

    def test_line_on_a_terminal(self):
        """From the beginning, and not asked for."""
        class Terminal(io.StringIO):
            def isatty(self):
                return True

        for progress, seen in ((None, True), (False, False), (True, True)):
            said = Terminal()
            with contextlib.redirect_stderr(said):
                covary.experiment(SUITE, self.path / f"out-{progress}", scenes=ROOM.parent, progress=progress)
            self.assertEqual(re.search(r"\r\[\d/", said.getvalue()) is not None, seen, said.getvalue())
            self.assertTrue(said.getvalue().endswith("\r" if seen else ""))

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
            def errorbar(self, x, y, bars, **style):
                assert min(bars[0]) >= 0 and max(bars[0]) < min(y)
                self.lines.append((x, style["label"]))
            def set(self, **words):
                self.words = words
            def set_xticks(self, places, labels=(), minor=False):
                if not minor:
                    self.ticks = places, labels
            def legend(self, **style):
                pass
            imshow = None

        axes = self.experiment().plot(Axes())
        self.assertEqual((axes.lines, axes.words["yscale"]), ([((16.0,), "room")], "log"))
        self.assertEqual(axes.ticks, ([16.0], ["16"]))

    def test_pixels_that_are_not_finite_are_told(self):
        """Left out of errors, they would make a method better than it is."""
        def broken(samples):
            image = samples.image.copy()
            image[:6] = numpy.nan
            return image

        warnings = self.experiment(broken=broken).results["warnings"]
        told = "room, broken, 16 spp: 192 pixels (25 % of all) are not finite"
        self.assertTrue(any(told in text for text in warnings), warnings)

    def test_means_that_are_off_less_certainly_are_told(self):
        """What changes from seed to seed at one budget is certain at the other."""
        def dark(samples):
            return samples.image * 0 + (0.01 if samples.spp == 16 else 0.2 + 0.04 * samples.seed)

        suite = {**SUITE, "budgets": [{"spp": 16}, {"spp": 32}], "seeds": 4}
        warnings = [text for text in self.experiment(suite, dark=dark).results["warnings"] if "dark" in text]
        self.assertTrue(any(text.startswith("room, dark, 16 spp: the image mean is -") for text in warnings), warnings)
        self.assertFalse(any(text.startswith("room, dark, 32 spp: the image mean") for text in warnings), warnings)
        told = [text for text in warnings if text.startswith("dark: the image means of room, dark, 32 spp (-")]
        self.assertEqual(len(told), 1, warnings)

    def test_failures(self):
        def wrong(samples):
            raise ValueError("no idea")

        line = inspect.getsourcelines(wrong)[1] + 1
        self.assertIn(f"room, wrong, 16 spp: ValueError: no idea (laboratory_test.py, line {line})",
                      self.message_of(covary.InputError, self.experiment, wrong=wrong))
        self.assertIn("the function returned the shape [3]; expected [24, 32, 3]", self.message_of(
            covary.InputError, self.experiment, flat=lambda samples: numpy.zeros(3)))
        self.assertIn("the function returned None", self.message_of(
            covary.InputError, self.experiment, none=lambda samples: None))

    def test_failures_are_told_when_they_happen(self):
        """The error has the runs that did not fail."""
        def wrong(samples):
            raise ValueError("no idea")

        with warnings.catch_warnings(record=True) as told, self.assertRaises(covary.InputError) as raised:
            warnings.simplefilter("always")
            covary.experiment(SUITE, self.path / "out", scenes=ROOM.parent, methods={"wrong": wrong},
                              progress=lambda *runs: None)
        self.assertTrue(any(str(w.message).startswith("failed: room, wrong, 16 spp: ") for w in told), told)
        found = raised.exception.experiment
        self.assertEqual({row["method"] for row in found.table}, {method["name"] for method in SUITE["methods"]})

    def test_the_same_image_for_all_seeds_is_told(self):
        warnings = self.experiment(flat=lambda samples: numpy.full((24, 32, 3), 0.4)).results["warnings"]
        self.assertIn("room, flat, 16 spp: the images of all seeds are the same: is the seed used? (a program's "
                      "COVARY_SEED)", warnings)
        self.assertEqual(len([text for text in warnings if "are the same" in text]), 1)

    def test_wrong_suites(self):
        self.assertIn("no suite is named 'quik'; did you mean 'quick'?",
                      self.message_of(covary.UsageError, self.experiment, "quik"))
        self.assertIn("no suite is named 'roomy'; did you mean 'room'?",
                      self.message_of(covary.UsageError, self.experiment, "roomy"))
        self.assertIn("suite:1: lacks 'name'", self.message_of(covary.InputError, self.experiment, {"scenes": []}))


if __name__ == "__main__":
    unittest.main()
