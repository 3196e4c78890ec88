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
    def test_outputs_are_checked_first(self):
        """Before the scene is read, in the program's words; nothing is written."""
        (self.path / "file").touch()
        for name, error, message in (("missing/at/a.exr", covary.IoError, f"no such folder {self.path / 'missing'}"),
                                     ("file/a.exr", covary.IoError, f"no such folder {self.path / 'file'}"),
                                     ("a.png", covary.UsageError, "output 'a.png': the name must end in .exr"),
                                     ("a", covary.UsageError, "the name must end in .exr")):
            said = self.message_of(error, covary.render, "no_such_scene.xml", 4, output=self.path / name)
            self.assertIn(message, said.replace(f"{self.path}/a", "a"))
        self.assertEqual([file.name for file in self.path.iterdir()], ["file"])

    def test_misspelt_arguments(self):
        """Whatever their value is."""
        feature = numpy.ones(INDEPENDENT.shape[1:], numpy.float32)
        for value in (feature, 3, "text"):
            self.assertIn("albdo: there is no such argument; did you mean albedo?",
                          self.message_of(covary.UsageError, covary.combine, None, INDEPENDENT, albdo=value))
        self.assertIn("something: there is no such argument",
                      self.message_of(covary.UsageError, covary.combine, None, INDEPENDENT, something=feature))

        for given, meant in ({"ssp": 8}, "spp"), ({"samples": 8}, "spp"), ({"width": 320}, "resolution"):
            self.assertIn(f"did you mean {meant}?",
                          self.message_of(covary.UsageError, covary.render, "room", **given))

    def test_without_effect(self):
        of_none = {"estimator": "none"}
        for arguments, message in (({"exposure": 1}, "exposure: found 1.0 without preview=True, where it has no"),
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
        self.assertEqual(told.risks, film.risks)
        self.assertIn("mean", told.risks)
        self.assertTrue(0 <= told.bias_share <= 1)
        report = covary.check_inputs(None, INDEPENDENT)
        self.assertTrue(report.ok, report)
        self.assertAlmostEqual(report.independent_mean, float(INDEPENDENT.mean()), 3)

    def test_messages(self):
        empty = numpy.zeros((3, 0, 4, 3), numpy.float32)
        self.assertIn("found the shape [3, 0, 4, 3], without values; expected [T, H, W, 3]",
                      self.message_of(ValueError, covary.combine, empty, empty))
        flat = numpy.zeros((4, 4, 3), numpy.float32)
        self.assertIn("found the shape [4, 4, 3]; expected [T, H, W, 3]",
                      self.message_of(ValueError, covary.combine, flat, flat))
        self.assertIn("found 'a'; the name must end in .exr,",
                      self.message_of(covary.UsageError, covary.write_image, "a", flat))
        films = [covary.film_from_groups(image, 48) for image in (CRN, INDEPENDENT)]
        self.assertIn("give each its own, in Python by film_from_groups(…, seed=1)",
                      self.message_of(covary.InputError, covary.merge_films, films))
        self.assertIn("; did you mean 'iicv'?", self.message_of(covary.UsageError, covary.render, "room", 4, "icv"))

    def test_arguments_that_are_missing_or_misspelt(self):
        self.assertIn("smal: there is no such argument; did you mean small?",
                      self.message_of(covary.UsageError, covary.view, CRN[0], smal=True))
        with self.assertRaisesRegex(TypeError, r"missing 1 required positional argument: 'samples'") as raised:
            covary.film_from_groups(CRN)
        self.assertIsNone(raised.exception.__context__)

    def test_axes_in_the_wrong_order(self):
        """Of small arrays, whose order cannot be told: an error says how they were read."""
        last = [numpy.ascontiguousarray(image.transpose(1, 2, 0, 3)) for image in (CRN, INDEPENDENT)]
        message = self.message_of(covary.InputError, covary.combine, *last)
        height, width, groups, _ = last[0].shape
        shape = list(last[0].shape)
        self.assertIn(f"the shape {shape} was read as [T, H, W, 3], {height} groups of {groups} x {width} pix", message)

    def test_warnings(self):
        """Are issued where the caller is, and kept."""
        turned = numpy.zeros((80, 70, 3, 3), numpy.float32) + numpy.random.default_rng(1).random((80, 70, 3, 3),
                                                                                              numpy.float32)
        for call in (covary.combine, covary.iicv):
            with self.assertWarnsRegex(covary.CovaryWarning, "was taken for .H, W, T, 3.") as warned:
                result = call(turned, turned[::-1].copy(), force=True)
            self.assertEqual(warned.filename, __file__)
            self.assertIn("was taken for", result.warnings[0])

    def test_frames(self):
        """The classes of exceptions are those of render()."""
        def frames(**arguments):
            return covary.render_frames(**{"scene": "room", "output": self.path / "a_#.exr", "frames": "1", "spp": 1,
                                           "resolution": (8, 8), **arguments})

        self.assertIn("no such folder", self.message_of(covary.IoError, frames, output=self.path / "no/at/a_#.exr"))
        self.assertIn("path.json", self.message_of(covary.IoError, frames, camera_path=self.path / "path.json"))
        frames()
        self.assertIn("overwrite=True", self.message_of(covary.InputError, frames, spp=2, resume=True))


class Watched(PackageTest):
    def said(self, function, *arguments, **keywords):
        said = Terminal()
        with contextlib.redirect_stderr(said):
            function(*arguments, **keywords)
        return said.getvalue()

    def test_renders(self):
        """On a terminal, a line from the beginning on, which goes when the work ends or fails."""
        scene = covary.Scene.load(ROOM, resolution=(64, 48))
        given = {"time": 1, "oidn": "off"}
        for shown in (self.said(covary.render, scene, **given),
                      self.said(covary.render, scene, **given, progress=True)):
            self.assertTrue(shown.startswith("\rloading"), shown)
            self.assertIn("\rsamples", shown)
            self.assertTrue(shown.endswith(" \r"), repr(shown))
        self.assertEqual(self.said(covary.render, scene, 4, "none", progress=False), "")
        failed = self.said(self.message_of, covary.IoError, covary.render, "missing.xml")
        self.assertTrue(failed.startswith("\rloading") and failed.endswith(" \r"), repr(failed))

    def test_steps(self):
        output = self.path / "a_#.exr"
        shown = self.said(covary.render_frames, "room", output, "1-2", time=1, resolution=(64, 48), overwrite=True)
        self.assertTrue(shown.startswith("\rframes: 0 of 2"), shown)
        self.assertRegex(self.said(covary.combine, CRN, INDEPENDENT, "iicv", progress=True), r"^(\rcombining: |$)")
        self.assertEqual(self.said(covary.combine, CRN, INDEPENDENT, "iicv"), "")


if __name__ == "__main__":
    unittest.main()
