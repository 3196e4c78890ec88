# SPDX-License-Identifier: Apache-2.0
"""What may come beside two images: light films, numbers of samples, denoising with features. Values and messages of the
command line."""
import math
import os
import unittest

import covary
import numpy
from common import HEIGHT, ROOM, WIDTH, PackageTest, channels, noisy, pair, rgb
from exr_reader import read_exr
from exr_writer import exr

SIZE = ("--resolution", "24x20")
FILES = ("combine", "--crn", "crn.exr", "--independent", "independent.exr", "-o", "out.exr", "--quiet")


class BesideTest(PackageTest):
    def write_groups(self, crn, independent):
        for name, images in (("crn", crn), ("independent", independent)):
            self.write(name, {f"group{g:02}.{c}": image[:, :, i] for g, image in enumerate(images)
                              for i, c in enumerate("RGB")})

    def write(self, name, layers):
        (self.path / f"{name}.exr").write_bytes(exr({key: values.ravel().tolist() for key, values in layers.items()},
                                                    (WIDTH, HEIGHT)))

    def assert_program_has(self, result, *words):
        """Image and standard error of `covary combine` on the files."""
        self.run_program(*FILES, "--error", *words)
        self.assert_same_bits(result.image.reshape(-1, 3), rgb(self.path / "out.exr"))
        self.assert_same_bits(result.std_error.reshape(-1, 3),
                              channels(self.path / "out.exr", [f"StdError.{c}" for c in "RGB"]))


class Light(BesideTest):
    """The films of a render by bidirectional path tracing."""

    def setUp(self):
        super().setUp()
        self.run_program("render", ROOM, "-o", "whole.exr", *SIZE, "--integrator", "bdpt", "--set", "light-tracing=on",
                         "--spp", 24, "--max-depth", 3, "--estimator", "iicv", "--passes", ".", "--quiet",
                         "--no-preview")
        self.films = {name: covary.Film.load(self.path / f"{name}.exr") for name in ("crn", "independent", "light")}

    def test_bits_of_the_program(self):
        images = self.films["crn"], self.films["independent"]
        result = covary.combine(*images, "iicv", light=self.films["light"])
        self.assert_program_has(result, "--light", "light.exr", "--estimator", "iicv")
        self.assert_same_bits(result.image.reshape(-1, 3), rgb(self.path / "whole.exr"))
        self.assertEqual(result.samples_per_pixel, 24)
        arrays = covary.combine(*(film.groups for film in images), "iicv", light=self.films["light"])
        self.assert_same_bits(arrays.image, result.image)
        self.assert_same_bits(arrays.std_error, result.std_error)
        self.assertEqual(covary.iduw(*images, light=self.films["light"]).std_error, None)

    def test_is_denoised_with_the_samples(self):
        """As in a render, whose bits come again."""
        self.run_program("render", ROOM, "-o", "denoised.exr", *SIZE, "--integrator", "bdpt", "--set",
                         "light-tracing=on", "--spp", 8, "--max-depth", 3, "--oidn", "off", "--aovs", "--passes", "p",
                         "--quiet", "--no-preview")
        features = {name: covary.read_image(self.path / "denoised.exr", layer) for name, layer in (
            ("albedo", "Albedo"), ("normal", "N"), ("position", "P"), ("denoising_albedo", "DenoisingAlbedo"),
            ("denoising_normal", "DenoisingNormal"))}
        films = {name: covary.Film.load(self.path / "p" / f"{name}.exr") for name in ("independent", "light")}
        again = covary.combine(None, films["independent"], light=films["light"], clean_features=True, oidn="off",
                               **features)
        self.assert_same_bits(again.image, covary.read_image(self.path / "denoised.exr"))

    def test_messages(self):
        images = self.films["crn"], self.films["independent"]
        self.assertIn("crn lacks the light of a light film; light adds it", covary.combine(*images).warnings)
        self.assertIn("crn is a light film, which light adds", self.message_of(
            covary.InputError, covary.combine, self.films["light"], images[1], light=self.films["light"]))
        self.assertIn("is not a light film: it lacks the attribute", self.message_of(
            covary.InputError, covary.combine, *images, light=images[0]))
        self.assertIn("shows other pixels", self.message_of(
            covary.InputError, covary.combine, *pair(height=19), light=self.films["light"]))
        self.assertIn("light: found numpy.ndarray of float32; expected the covary.Film", self.message_of(
            TypeError, covary.combine, *images, light=images[0].mean))


class Counts(BesideTest):
    """Pixels with numbers of samples of their own."""

    def setUp(self):
        super().setUp()
        self.images = pair()
        self.write_groups(*self.images)
        self.counts = numpy.random.default_rng(3).integers(12, 60, (HEIGHT, WIDTH))

    def test_bits_of_the_program(self):
        self.write("counts", {"samples": self.counts})
        for kind in (numpy.uint32, numpy.int64, numpy.uint16):
            result = covary.combine(*self.images, counts=self.counts.astype(kind), samples=24)
            self.assert_program_has(result, "--counts", "counts.exr", "--samples", 24)
        self.assertAlmostEqual(result.samples_per_pixel, 24 + self.counts.mean())
        self.assertFalse((result.image == covary.combine(*self.images).image).all())
        denoised = covary.combine(*self.images, denoise="auto", counts=self.counts, samples=24)
        self.assert_same_bits(denoised.image, result.image)

    def test_messages(self):
        self.write("counts", {"samples": self.counts})
        self.assertEqual(self.failure_of_program(*FILES, "--counts", "counts.exr").replace("--", ""),
                         self.message_of(covary.UsageError, covary.combine, *self.images, counts=self.counts))
        film = covary.film_from_groups(self.images[1], 24)
        for error, text, images, counts in (
                (TypeError, "counts: found float64 [20, 24]; expected whole numbers, [H, W]", self.images,
                 self.counts * 1.0),
                (TypeError, "counts: found int64 [480]", self.images, self.counts.ravel()),
                (ValueError, "counts: found -1 to", self.images, self.counts - self.counts.min() - 1),
                (ValueError, "counts: found the shape [19, 24]; expected [20, 24]", self.images, self.counts[1:]),
                (covary.UsageError, "fewer than the 12 groups", self.images, self.counts * 0 + 3),
                (covary.InputError, "independent: the film already says", (self.images[0], film), self.counts)):
            self.assertIn(text, self.message_of(error, covary.combine, *images, counts=counts, samples=24))


class Denoise(BesideTest):
    """Without Open Image Denoise, which may be there or not."""

    def setUp(self):
        super().setUp()
        self.images = pair()
        self.write_groups(*self.images)
        rng = numpy.random.default_rng(5)
        self.albedo, self.normal = (rng.random((HEIGHT, WIDTH, 3), numpy.float32) for _ in range(2))

    def test_functions_by_name(self):
        options = {"denoise": "error", "oidn": "off", "albedo": self.albedo, "normal": self.normal}
        result = covary.combine(*self.images, **options)
        self.assertEqual(result.estimator, "iicv --denoise error --oidn off")
        self.assert_same_bits(result.image, covary.iicv(*self.images, **options).image)

    def write_features(self, names, images):
        self.write("features", {f"{name}.{c}": image[:, :, i] for name, image in zip(names, images)
                              for i, c in enumerate("XYZ" if name.endswith(("N", "Normal", "P")) else "RGB")})

    def test_features_behind_glass(self):
        """Go to the network in place of the others."""
        denoiser = os.environ["STAND_IN_DENOISER"]
        first = {"albedo": self.albedo, "normal": self.normal}
        behind = {"denoising_albedo": self.albedo[::-1].copy(), "denoising_normal": self.normal[::-1].copy()}
        self.write_features(("Albedo", "N", "DenoisingAlbedo", "DenoisingNormal"), (*first.values(), *behind.values()))
        result = covary.combine(*self.images, denoise="error", oidn=denoiser, **first, **behind)
        self.assertFalse((result.image == covary.combine(*self.images, denoise="error", oidn=denoiser,
                                                         **first).image).all())
        self.assert_program_has(result, "--denoise", "error", "--oidn", denoiser, "--features", "features.exr")
        said = [self.message_of(covary.UsageError, covary.combine, *self.images, denoise="error", **features)
                for features in ({"denoising_normal": self.normal}, {**first, "denoising_albedo": self.albedo})]
        self.assertEqual(said, ["denoising_normal: it has an effect only together with denoising_albedo",
                                "denoising_albedo: it has an effect only together with denoising_normal"])

    def test_features_of_each_render(self):
        """Have the bits of the files' layers; the mean of all does not."""
        rng = numpy.random.default_rng(7)
        renders = numpy.stack([self.images[1][0], self.images[1][1]])
        albedo, normal = (feature + 0.1 * rng.random((2, HEIGHT, WIDTH, 3), numpy.float32)
                          for feature in (self.albedo, self.normal))
        for i in range(2):
            planes = {c: renders[i, :, :, k] for k, c in enumerate("RGB")}
            planes |= {f"albedo.{c}": albedo[i, :, :, k] for k, c in enumerate("RGB")}
            self.write(f"render{i}", planes | {f"sh_normal.{c}": normal[i, :, :, k] for k, c in enumerate("XYZ")})
        self.run_program("denoise", "render0.exr", "render1.exr", "-o", "out.exr", "--oidn", "off", "--quiet",
                         "--force")

        def combined(albedo, normal):
            return covary.combine(None, renders, samples=8, oidn="off", force=True, albedo=albedo, normal=normal).image
        self.assert_same_bits(combined(albedo, normal).reshape(-1, 3), rgb(self.path / "out.exr"))
        self.assertFalse((combined(albedo.mean(0), normal.mean(0)) == combined(albedo, normal)).all())
        self.assertIn("albedo: found the shape [1, 20, 24, 3]; expected [2, 20, 24, 3]",
                      self.message_of(ValueError, combined, albedo[:1], normal))

    def test_independent_image_alone(self):
        """Denoised, with layers that add up to it."""
        independent = self.images[1]
        result = covary.combine(None, independent, denoise="auto", oidn="off", albedo=self.albedo, normal=self.normal,
                                layers={"half": 0.5 * independent, "third": independent / 3})
        self.assertEqual(result.estimator, "mixture --denoise auto --oidn off")
        self.assertEqual(list(result.aovs), ["Rest", "half", "third", "Albedo", "N"])
        layers = [result.aovs[name] for name in ("Rest", "half", "third")]
        numpy.testing.assert_allclose(sum(layers), result.image, rtol=1e-5, atol=1e-6)
        numpy.testing.assert_array_equal(result.aovs["Albedo"], self.albedo)
        result.save(self.path / "kept.exr")
        self.assertIn("Albedo.R", read_exr((self.path / "kept.exr").read_bytes()))
        numpy.testing.assert_allclose(result.aovs["half"], 0.5 * result.image, rtol=1e-4, atol=1e-5)
        self.write_features(("Albedo", "N"), (self.albedo, self.normal))
        self.run_program("combine", "--independent", "independent.exr", "-o", "out.exr", "--denoise", "auto",
                         "--oidn", "off", "--features", "features.exr", "--quiet", "--error")
        self.assert_same_bits(result.image.reshape(-1, 3), rgb(self.path / "out.exr"))
        position = numpy.stack([self.normal[..., 0], *numpy.mgrid[:HEIGHT, :WIDTH]], -1).astype(numpy.float32)
        placed = covary.combine(None, independent, denoise="auto", oidn="off", albedo=self.albedo, normal=self.normal,
                                position=position)
        self.assertFalse((placed.image == result.image).all())
        self.write_features(("Albedo", "N", "P"), (self.albedo, self.normal, position))
        self.run_program("combine", "--independent", "independent.exr", "-o", "out.exr", "--denoise", "auto",
                         "--oidn", "off", "--features", "features.exr", "--quiet", "--error")
        self.assert_same_bits(placed.image.reshape(-1, 3), rgb(self.path / "out.exr"))
        self.assertEqual(self.message_of(covary.UsageError, covary.combine, None, independent, denoise="auto",
                                         position=position),
                         "position: it has an effect only together with the albedo")
        self.assertIn("denoise: found 'none'; without crn, images are only denoised",
                      self.message_of(covary.UsageError, covary.combine, None, independent,
                                      denoise="none"))
        self.assertIn("crn: found None; 'iduw' needs the image with common random numbers",
                      self.message_of(covary.UsageError, covary.combine, None, independent, "iduw"))
        self.assertIn("the layer 'x' has 24 x 19 pixels", self.message_of(
            covary.InputError, covary.combine, None, independent, denoise="auto", layers={"x": independent[:, 1:]}))

    def test_messages(self):
        def message(error, estimator="iicv", **keywords):
            return self.message_of(error, covary.combine, *self.images, estimator, **keywords)
        self.write("features", {f"Albedo.{c}": self.albedo[:, :, i] for i, c in enumerate("RGB")})
        self.assertIn("option of --denoise auto, bias", self.failure_of_program(*FILES, "--estimator", "iicv",
                                                                            "--features", "features.exr"))
        self.assertIn("albedo: auxiliary features are for denoising",
                      message(covary.UsageError, albedo=self.albedo))
        self.assertEqual(message(covary.UsageError, oidn="off"),
                         self.failure_of_program(*FILES, "--estimator", "iicv", "--oidn", "off").replace("--", ""))
        self.assertEqual(message(covary.UsageError, "dependent-tests", denoise="bias"),
                         self.failure_of_program(*FILES, "--denoise", "bias", "--estimator",
                                                 "dependent-tests").replace("--", ""))
        self.assertIn("only together with the albedo", message(covary.UsageError, denoise="bias", normal=self.normal))
        self.assertIn("albedo: found the shape [19, 24, 3]; expected [20, 24, 3]",
                      message(ValueError, denoise="bias", albedo=self.albedo[1:]))
        for feature in ("albedo", "normal"):
            features = {"albedo": self.albedo, "normal": self.normal}
            features[feature] = features[feature].copy()
            features[feature][2, 5, 1] = math.nan
            self.assertIn(f"the {feature} holds the value nan at pixel (5, 2); all values of auxiliary features must "
                          "be finite", message(covary.InputError, denoise="bias", oidn="off", **features))
        self.assertIn("blured", message(covary.UsageError, denoise="blured"))

    def test_render(self):
        scene = covary.Scene.load(ROOM, resolution=(24, 20))
        result = covary.render(scene, 48, "iicv", denoise="balanced", oidn="off", progress=lambda done, total: None)
        self.run_program("render", ROOM, "-o", "out.exr", *SIZE, "--spp", 48, "--estimator", "iicv", "--denoise",
                         "balanced", "--oidn", "off", "--quiet", "--no-preview")
        self.assert_same_bits(result.image.reshape(-1, 3), rgb(self.path / "out.exr"))
        again = covary.combine(result.films["crn"], result.films["independent"], denoise="balanced", oidn="off",
                               albedo=result.aovs["Albedo"], normal=result.aovs["N"])
        self.assert_same_bits(again.image, result.image)
        self.assert_same_bits(again.std_error, result.std_error)
        self.assertEqual(result.predicted_relmse, again.predicted_relmse)

    def test_until_of_blocks(self):
        scene = covary.Scene.load(ROOM, resolution=(24, 20))
        result = covary.render(scene, spp=400, until_p95=0.2)
        self.assertTrue(result.until_reached)
        self.assertLessEqual(result.predicted_relmse_p95, 0.2)
        self.assertIn("expected one of them", self.message_of(
            covary.UsageError, covary.render, scene, until=0.1, until_p95=0.1))


if __name__ == "__main__":
    unittest.main()
