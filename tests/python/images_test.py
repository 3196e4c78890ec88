# SPDX-License-Identifier: Apache-2.0
"""combine(), metrics, images and films: the values and messages of the command line."""
import contextlib
import inspect
import json
import subprocess
import unittest

import covary
import numpy
from common import GROUPS, HEIGHT, PROGRAM, WIDTH, PackageTest, noisy, pair
from exr_writer import exr


class FilesTest(PackageTest):
    def setUp(self):
        super().setUp()
        self.crn, self.independent = pair()
        for name, images in (("crn", self.crn), ("independent", self.independent)):
            layers = {f"group{g:02}.{c}": image[:, :, i].ravel().tolist()
                      for g, image in enumerate(images) for i, c in enumerate("RGB")}
            (self.path / f"{name}.exr").write_bytes(exr(layers, (WIDTH, HEIGHT)))


class Changed(FilesTest):
    def test_files_that_another_program_changed(self):
        image = self.crn[0]
        covary.write_image(self.path / "a.exr", image)
        self.assert_same_bits(covary.read_image(self.path / "a.exr"), image)
        data = (self.path / "a.exr").read_bytes()
        at = data.index(b"crc32 ") + len("crc32 00000000 ")
        (self.path / "b.exr").write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1:])
        self.assertIn("b.exr: the channel B is one with the checksum ",
                      self.message_of(covary.InputError, covary.read_image, self.path / "b.exr"))
        self.assert_same_bits(covary.read_image(self.path / "b.exr", accept_changed=True), image)


class Combine(FilesTest):
    def test_files_as_arrays(self):
        self.assert_same_bits(covary.read_groups(self.path / "crn.exr"), self.crn)
        self.assertEqual(self.message_of(ValueError, covary.read_groups, []),
                         "paths: found none; one file or more are needed")

    def test_messages_of_the_program(self):
        swapped = self.failure_of_program("combine", "--crn", "independent.exr", "--independent", "crn.exr", "-o",
                                          "x.exr")
        message = self.message_of(covary.InputError, covary.combine, self.independent, self.crn)
        self.assertEqual(message.replace("force=True", "--force"), swapped)
        wrong = self.failure_of_program("combine", "--crn", "crn.exr", "--independent", "independent.exr", "-o",
                                        "x.exr", "--set", "k=500")
        self.assertEqual(self.message_of(covary.UsageError, covary.combine, self.crn, self.independent, k=500),
                         wrong)

    def test_less_noise(self):
        truth = noisy(0, False)[0] * 0 + (1 + 0.02 * numpy.arange(WIDTH)[:, None] + 0.1 * numpy.arange(3))
        errors = [numpy.mean((image - truth) ** 2) for image in
                  (covary.combine(self.crn, self.independent).image, self.independent.mean(0))]
        self.assertLess(errors[0], 0.5 * errors[1])

    def test_check_inputs(self):
        report = covary.check_inputs(self.crn, self.independent)
        self.assertTrue(report.ok)
        self.assertGreater(report.crn_horizontal[0], 0.5)
        self.assertLess(abs(report.independent_horizontal[0]), 5 * report.independent_horizontal[1])
        report = covary.check_inputs(self.independent, self.crn)
        self.assertFalse(report.ok)
        self.assertIn("swapped", report.errors[0])


class Estimators(FilesTest):
    def test_functions_by_name(self):
        self.assert_same_bits(covary.iicv(self.crn, self.independent).image,
                              covary.combine(self.crn, self.independent, "iicv").image)
        result = covary.iicv(self.crn, self.independent, paper=True, k=9)
        self.assertEqual(result.estimator, "iicv --paper --set k=9")
        self.assertEqual(covary.cv_baseline(self.crn, self.independent, ridge=0.5).estimator,
                         "cv-baseline --set ridge=0.5")
        self.assertIsNone(covary.iduw(self.crn, self.independent, samples=96).std_error)
        self.assertIsNone(covary.iduw(self.crn, self.independent, samples=96).bias)

    def test_every_pair_estimator_has_one(self):
        for estimator in covary._covary.estimators():
            name = estimator["name"].replace("-", "_")
            self.assertEqual(hasattr(covary, name), estimator["passes"] == "pair", name)
            if estimator["passes"] == "pair":
                text = inspect.getdoc(getattr(covary, name))
                for option in estimator["options"]:
                    line = f"\n{option['name'].replace('-', '_')}:"
                    (self.assertNotIn if option["of_passes"] else self.assertIn)(line, text)

    def test_options_of_passes_are_refused(self):
        self.assertTrue(any(option["of_passes"] for option in covary._covary.estimators()[0]["options"]))
        for options in ({"adaptive": True}, {"max_spp": 9}, {"dependent_spp": 9}):
            message = self.message_of(covary.UsageError, covary.combine, self.crn, self.independent, **options)
            self.assertIn("says how many samples pixels get while they are rendered", message)
        self.assertRaises(TypeError, covary.iicv, self.crn, self.independent, adaptive=True)

    def test_others_are_refused(self):
        self.assertIn("which images do not hold", self.message_of(covary.UsageError, covary.combine, self.crn,
                                                                 self.independent, "polynomials"))
        self.assertIn("not one of two images", self.message_of(covary.UsageError, covary.combine, self.crn,
                                                               self.independent, "none"))


class Metrics(PackageTest):
    def test_values_of_the_program(self):
        image, reference, second = noisy(3, False)[0], noisy(4, False)[0], noisy(5, False)[0]
        for name, values in (("i", image), ("r", reference), ("s", second)):
            covary.write_image(self.path / f"{name}.exr", values)
        names = [metric["name"] for metric in covary._covary.metrics()]
        self.assertIn("flip", names)
        for references, words in (((reference,), []), ((reference, second), ["--reference2", "s.exr"])):
            text = subprocess.run([PROGRAM, "compare", "i.exr", "--reference", "r.exr", *words, "--metric",
                                   ",".join(names), "--json", "-"], cwd=self.path, capture_output=True, text=True,
                                  check=True).stdout
            for name in names:
                function = getattr(covary.metrics, name.replace("-", "_"))
                self.assertEqual(function(image, *references), json.loads(text)[name], name)

    def test_map(self):
        image, reference = noisy(3, False)[0].copy(), noisy(4, False)[0]
        image[0, 0, 0] = numpy.inf
        result = covary.metrics.compute("relmse", image, reference)
        self.assertEqual((result.n_pixels, result.n_non_finite, result.map.shape),
                         (HEIGHT * WIDTH - 1, 1, (HEIGHT, WIDTH)))
        self.assertAlmostEqual(float(numpy.nanmean(result.map)), result.value, places=6)

    def test_noise_of_references(self):
        """Known of two for relmse and mse alone; told if it hides the error, or if both are the same."""
        image, first, second = (noisy(seed, False)[0] for seed in (3, 4, 5))
        with self.assertWarnsRegex(covary.CovaryWarning, "the noise of the references makes the relmse of "):
            noise = covary.metrics.compute("relmse", first + 1e-4 * image, first, second).reference_error
        self.assertGreater(noise, 0)
        self.assertIsNone(covary.metrics.compute("relmse", image, first).reference_error)
        self.assertIsNone(covary.metrics.compute("flip", image, first, second).reference_error)
        with self.assertWarnsRegex(covary.CovaryWarning, "these are the same image"):
            covary.metrics.mse(image, first, first.copy())

    def test_errors(self):
        image = noisy(3, False)[0]
        self.assertIn("relmse", self.message_of(covary.UsageError, covary.metrics.compute, "relmsee", image, image))
        self.assertIn("reference: found the shape", self.message_of(ValueError, covary.metrics.mse, image, image[0]))
        self.assertIn("reference", self.message_of(covary.InputError, covary.metrics.mse, image, image[1:]))


class Images(PackageTest):
    def test_written_and_read(self):
        image = noisy(6, False)[0]
        covary.write_image(self.path / "a.exr", image[:, ::-1])
        self.assert_same_bits(covary.read_image(self.path / "a.exr"), image[:, ::-1])
        covary.combine(*pair()).save(self.path / "b.png")
        self.assertEqual(covary.read_image(self.path / "b.png").shape, (HEIGHT, WIDTH, 3))

    def test_saved_results_are_whole(self):
        """What is known of the error and the samples, too, as in the files of the program."""
        result = covary.render("room", 24, "iicv", aovs=True, seed=7, crop=(100, 100, 24, 16))
        self.assertEqual([result, result].index(result), 0)  # compared as objects
        self.assertEqual(len({result, covary.combine(*pair())}), 2)
        result.save(self.path / "a.exr")
        self.assert_same_bits(covary.read_image(self.path / "a.exr"), result.image)
        self.assert_same_bits(covary.read_image(self.path / "a.exr", "StdError"), result.std_error)
        self.assert_same_bits(covary.read_image(self.path / "a.exr", "Albedo"), result.aovs["Albedo"])
        info = subprocess.run([covary.program(), "info", self.path / "a.exr", "--json"], capture_output=True, text=True,
                              check=True)
        attributes = json.loads(info.stdout)["attributes"]
        self.assertEqual((attributes["covary:seed"], attributes["covary:samples"]), ("7", "24"))
        self.assertEqual(attributes["covary:scene_hash"], result.films["crn"].attributes["scene_hash"])
        self.assertAlmostEqual(float(attributes["covary:predicted_relmse"]) / result.predicted_relmse, 1, 3)
        for text, bound in zip(attributes["covary:predicted_relmse_80"].split(), result.predicted_bounds, strict=True):
            self.assertAlmostEqual(float(text) / bound, 1, 3)

    def test_saved_results_replace_no_other_files(self):
        """As commands of the program do: only what they made, unless told to."""
        result, render = covary.combine(*pair()), self.path / "render.exr"
        covary.render("room", 4, "none", resolution=(24, 16), output=render)
        for name in ("a.exr", "a.png", "a.tif"):
            for _ in range(2):
                result.save(self.path / name)
        result.save(self.path / "made" / "a.png")  # in its last folder
        deep = self.path / "no" / "where" / "a.png"
        self.assertIn("no such folder", self.message_of(covary.IoError, result.save, deep))
        other = self.path / "other.png"
        other.write_bytes(b"something else")
        for path in (render, other):
            before = path.read_bytes()
            self.assertEqual(self.message_of(covary.UsageError, result.save, path),
                             f"path: '{path}' already exists, and save() did not make it; give another name, or "
                             "overwrite=True to replace it")
            self.assertEqual(path.read_bytes(), before)
            result.save(path, overwrite=True)
            result.save(path)

    def test_errors(self):
        missing = str(self.path / "missing.exr")
        message = self.message_of(OSError, covary.read_image, missing)
        self.assertIn(message, self.failure_of_program("compare", missing, "--reference", missing))
        self.assertIn("image: found", self.message_of(TypeError, covary.write_image, "x.exr", [1]))
        self.assertIn("/nowhere/no/x.exr", self.message_of(covary.IoError, covary.write_image, "/nowhere/no/x.exr",
                                                            noisy(6, False)[0]))

    def test_features_that_are_none(self):
        """Another render in place of the albedo, as after `covary denoise a.exr b.exr`, is told."""
        image = noisy(6, False)[0]
        for call in (lambda: covary.combine(None, noisy(7, True), oidn="off", albedo=image + 1, force=True),
                     lambda: covary.denoise(image, image + 1, oidn="/nowhere")):
            with self.assertWarnsRegex(covary.CovaryWarning, r"albedo: \d+% of its values are far from between 0 and 1"
                                                             r".*, not another render"):
                with contextlib.suppress(covary.UsageError):  # of the missing denoiser
                    call()

    def test_denoiser_that_is_missing(self):
        message = self.message_of(covary.UsageError, covary.denoise, noisy(6, False)[0], oidn="/nowhere")
        self.assertIn("/nowhere", message)
        self.assertIn("only together with the albedo",
                      self.message_of(covary.UsageError, covary.denoise, noisy(6, False)[0],
                                      normal=noisy(7, False)[0]))


class Films(PackageTest):
    def film(self, seed, **keywords):
        return covary.film_from_groups(noisy(seed, True), 24, sampling="crn", seed=seed, **keywords)

    def test_of_arrays(self):
        film = self.film(1)
        self.assert_same_bits(film.groups, noisy(1, True))
        self.assertTrue((film.counts == 24).all())
        self.assertEqual((film.width, film.height, film.samples_per_pixel), (WIDTH, HEIGHT, 24))
        numpy.testing.assert_allclose(film.mean, noisy(1, True).mean(0), rtol=1e-6)
        self.assertIn("each of the 12 groups", self.message_of(covary.UsageError, covary.film_from_groups,
                                                               noisy(1, True), 11))

    def test_views_keep_the_film(self):
        groups = self.film(1).groups
        with self.assertRaises(ValueError):
            groups[0] = 0
        self.assert_same_bits(groups, noisy(1, True))

    def test_saved_loaded_and_merged(self):
        films = [self.film(seed) for seed in (1, 2)]
        for number, film in enumerate(films):
            film.save(self.path / f"{number}.exr")
        loaded = covary.Film.load(self.path / "0.exr")
        self.assert_same_bits(loaded.groups, films[0].groups)
        self.assertEqual(loaded.attributes["seed"], "1")
        merged = covary.merge_films(films[::-1])
        self.assertNotIn("warning", self.run_program("merge", "0.exr", "1.exr", "-o", "merged.exr"))
        for other in (covary.Film.load(str(self.path / "merged.exr")),
                      covary.merge_films([self.path / "0.exr", self.path / "1.exr"])):
            self.assert_same_bits(merged.groups, other.groups)
            self.assertTrue((merged.counts == other.counts).all())
        self.assertIn("seed", self.message_of(covary.InputError, covary.merge_films, [films[0], films[0]]))
        self.assertIn("expected one or the other", self.message_of(TypeError, covary.merge_films, [films[0], "0.exr"]))
        self.assertIn("found none", self.message_of(ValueError, covary.merge_films, []))

    def test_combined(self):
        crn, independent = pair()
        films = [covary.film_from_groups(values, 24, sampling=kind)
                 for values, kind in ((crn, "crn"), (independent, "independent"))]
        self.assert_same_bits(covary.combine(*films).image, covary.combine(crn, independent).image)
        self.assertIn("expected sampling crn", self.message_of(covary.InputError, covary.combine, *films[::-1]))
        self.assertEqual(covary.combine(films[0], independent).image.shape, (HEIGHT, WIDTH, 3))


if __name__ == "__main__":
    assert GROUPS == 12
    unittest.main()
