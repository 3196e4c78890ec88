# SPDX-License-Identifier: Apache-2.0
"""What is refused before any work, and what is said instead; what is shown while there is work."""
import contextlib
import io
import unittest

import covary
import numpy
from common import ROOM, PackageTest, pair

CRN, INDEPENDENT = pair()


class Terminal(io.StringIO):
    def isatty(self):
        return True


class Refusals(PackageTest):
    def test_misspelt_arguments(self):
        """Whatever their value is."""
        guide = numpy.ones(INDEPENDENT.shape[1:], numpy.float32)
        for value in (guide, 3, "text"):
            self.assertIn("albdo: there is no such argument; did you mean albedo?",
                          self.message_of(covary.UsageError, covary.combine, None, INDEPENDENT, albdo=value))
        self.assertIn("something: there is no such argument",
                      self.message_of(covary.UsageError, covary.combine, None, INDEPENDENT, something=guide))

        self.assertIn("did you mean spp?", self.message_of(covary.UsageError, covary.render, "room", ssp=8))

    def test_without_effect(self):
        of_none = {"estimator": "none"}
        for arguments, message in (({"exposure": 1}, "exposure: found 1.0 without preview=True, where it has no effect"),
                                   ({**of_none, "aov_samples": 4}, "aov_samples: found 4 with estimator='none', where "
                                                                   "it has no effect without aovs=True"),
                                   ({**of_none, "device": "auto"}, "device: found 'auto' with estimator='none'")):
            self.assertIn(message, self.message_of(covary.UsageError, covary.render, "room", 4, **arguments))

    def test_images_alone(self):
        """One group says nothing of the noise; samples= counts those of all groups."""
        self.assertIn("independent: found 1 group; at least 2 are needed",
                      self.message_of(covary.InputError, covary.combine, None, INDEPENDENT[:1]))
        told = covary.combine(None, INDEPENDENT, samples=48, oidn="off")
        film = covary.combine(None, covary.film_from_groups(INDEPENDENT, 48), oidn="off")
        self.assert_same_bits(told.image, film.image)
        self.assertEqual(told.samples_per_pixel, 48)

    def test_warnings(self):
        """Are issued where the caller is, and kept."""
        turned = numpy.zeros((80, 70, 3, 3), numpy.float32) + numpy.random.default_rng(1).random((80, 70, 3, 3),
                                                                                              numpy.float32)
        for call in (covary.combine, covary.iicv):
            with self.assertWarnsRegex(covary.CovaryWarning, "was taken for .H, W, T, 3.") as warned:
                result = call(turned, turned[::-1].copy(), force=True)
            self.assertEqual(warned.filename, __file__)
            self.assertIn("was taken for", result.warnings[0])


class Watched(PackageTest):
    def said(self, function, *arguments, **keywords):
        said = Terminal()
        with contextlib.redirect_stderr(said):
            function(*arguments, **keywords)
        return said.getvalue()

    def test_renders(self):
        """On a terminal, a line from the beginning on, which goes when the work ends or fails."""
        scene = covary.Scene.load(ROOM, resolution=(32, 24))
        for shown in (self.said(covary.render, scene, 4, "none"),
                      self.said(covary.render, scene, 4, "none", progress=True)):
            self.assertTrue(shown.startswith("\rloading"), shown)
            self.assertIn("\rsamples", shown)
            self.assertTrue(shown.endswith(" \r"), repr(shown))
        self.assertEqual(self.said(covary.render, scene, 4, "none", progress=False), "")
        failed = self.said(self.message_of, covary.IoError, covary.render, "missing.xml")
        self.assertTrue(failed.startswith("\rloading") and failed.endswith(" \r"), repr(failed))

    def test_steps(self):
        output = self.path / "a_#.exr"
        shown = self.said(covary.render_frames, "room", output, "1-2", spp=1, resolution=(8, 8), overwrite=True)
        self.assertTrue(shown.startswith("\rframes: 0 of 2"), shown)
        self.assertIn("\rcombining", self.said(covary.combine, CRN, INDEPENDENT, "iicv", progress=True))
        self.assertEqual(self.said(covary.combine, CRN, INDEPENDENT, "iicv"), "")


if __name__ == "__main__":
    unittest.main()
