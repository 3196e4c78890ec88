# SPDX-License-Identifier: Apache-2.0
"""covary.mitsuba with Mitsuba's own wheel, in the LLVM variant. Seeds are fixed."""
import subprocess
import sys
import unittest

import covary
import covary.mitsuba
import numpy
from common import ROOM, SOURCE, PackageTest

VARIANT = "llvm_ad_rgb"
SIZE = {"width": 48, "height": 32}


class Missing(PackageTest):
    def test_mitsuba(self):
        """The reason where it is not installed."""
        kept = sys.modules.pop("mitsuba", None)
        sys.modules["mitsuba"] = None
        try:
            self.assertEqual(self.message_of(ImportError, covary.mitsuba.render, "x.xml", 48),
                             "covary.mitsuba needs Mitsuba 3: pip install mitsuba")
        finally:
            del sys.modules["mitsuba"]
            if kept:
                sys.modules["mitsuba"] = kept


class WithMitsuba(PackageTest):
    def setUp(self):
        super().setUp()
        import mitsuba
        self.mi = mitsuba
        self.mi.set_variant(VARIANT)

    def room(self, **more):
        return self.mi.load_file(str(SOURCE / "scenes" / "room.xml"), **SIZE, **more)


class Render(WithMitsuba):
    def test_less_noise(self):
        scene = self.room()
        seen = []
        result = covary.mitsuba.render(scene, 48, progress=lambda done, total: seen.append((done, total)), aovs=True)
        pair = covary.mitsuba.render(scene, 48, estimator="iicv")
        reference = numpy.array(self.mi.render(scene, spp=512, seed=99))
        plain = numpy.array(self.mi.render(scene, spp=48, seed=7))
        error, of_pair, plain_error = (covary.metrics.relmse(image, reference)
                                       for image in (result.image, pair.image, plain))
        print(f"relMSE {error:.4f}, iicv {of_pair:.4f}, Mitsuba {plain_error:.4f}")
        self.assertLess(of_pair, 0.5 * plain_error)
        self.assertLess(error, 0.5 * of_pair)
        self.assertEqual((seen[-1], result.warnings, list(result.films)), ((12, 12), [], ["independent"]))
        self.assertEqual((pair.films["crn"].samples_per_pixel, pair.films["crn"].attributes["sampling"]), (24, "crn"))
        self.assertEqual([result.aovs[name].shape for name in ("Albedo", "N")], [(32, 48, 3)] * 2)
        self.assertAlmostEqual(float(numpy.linalg.norm(result.aovs["N"], axis=-1).max()), 1, delta=0.05)
        report = covary.check_inputs(pair.films["crn"], pair.films["independent"])
        self.assertGreater(report.crn_horizontal[0], 0.5)

    def test_same_seed_same_image(self):
        first, second, other = (covary.mitsuba.render(self.room(), 12, seed=seed, estimator="iicv").films
                                for seed in (1, 1, 2))
        for name in ("crn", "independent"):
            self.assert_same_bits(first[name].groups, second[name].groups)
            self.assertGreater(numpy.mean(first[name].groups != other[name].groups), 0.5)

    def test_passes_take_the_same_numbers(self):
        """Samples in passes of two are those of one pass."""
        once, passes = (covary.mitsuba.render(self.room(), 24, groups=3, estimator="iicv",
                                               integrator={"type": "path", **more})
                        for more in ({}, {"samples_per_pass": 2}))
        numpy.testing.assert_allclose(once.films["crn"].groups, passes.films["crn"].groups, rtol=1e-4, atol=1e-5)

    def test_groups_traced_together(self):
        """Or one by one: the same samples of the image with common numbers, but for roundings at edges."""
        together = covary.mitsuba.render(self.room(), 28, estimator="iicv").films["crn"].groups
        kept, covary.mitsuba._LANES_OF_STACK = covary.mitsuba._LANES_OF_STACK, 1
        try:
            alone = covary.mitsuba.render(self.room(), 28, estimator="iicv").films["crn"].groups
        finally:
            covary.mitsuba._LANES_OF_STACK = kept
        self.assertGreater(numpy.mean(numpy.abs(together - alone) <= 0.01 * alone), 0.98)
        numpy.testing.assert_allclose(together.mean((1, 2)), alone.mean((1, 2)), rtol=2e-3)

    def test_stacks(self):
        """Of groups hold each once, within the limits."""
        for count, groups, width, height in ((24, 12, 64, 48), (26, 12, 64, 48), (12, 12, 1280, 720), (3, 3, 1, 5000)):
            stacks = list(covary.mitsuba._stacks(count, groups, width, height))
            self.assertEqual(sum(number for number, _ in stacks), groups)
            self.assertEqual(sum(number * size for number, size in stacks), count)
            for number, size in stacks:
                self.assertTrue(number == 1 or number * size * width * (height + 1) <= 1 << 24)
                self.assertTrue(number == 1 or number * (height + 1) <= 4096)
        self.assertEqual(len(list(covary.mitsuba._stacks(24, 12, 64, 48))), 1)
        self.assertIn("use more groups than 3", self.message_of(
            covary.UsageError, lambda: list(covary.mitsuba._stacks(3000, 3, 4096, 2160))))

    def test_groups_of_unequal_sizes(self):
        result = covary.mitsuba.render(self.room(), 28, estimator="iicv")
        self.assertEqual(result.films["crn"].groups.shape[0], 12)
        self.assertEqual(result.films["crn"].samples_per_pixel, 14)

    def test_wall_has_one_value(self):
        """All pixels of a lit wall are the same sample by sample."""
        wall = self.mi.load_file(str(SOURCE / "scenes" / "wall.xml"))
        groups = covary.mitsuba.render(wall, 12, groups=3, estimator="iicv").films["crn"].groups
        spread = numpy.ptp(groups, axis=(1, 2)) / groups.mean(axis=(1, 2))
        self.assertLess(spread.max(), 0.02)

    def test_scene_without_integrator(self):
        """As load_dict() makes one: rendered by path, of the value 1 that the light has everywhere."""
        scene = self.mi.load_dict({"type": "scene", "light": {"type": "constant"}, "camera": {
            "type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 6, "rfilter": {"type": "box"}}}})
        self.assertIsNone(scene.integrator())
        numpy.testing.assert_allclose(covary.mitsuba.render(scene, 6).image, 1, atol=1e-5)

    def test_other_variants(self):
        """Without colours, all channels are one; spectra become colours."""
        for variant in ("llvm_ad_mono", "llvm_ad_spectral"):
            self.mi.set_variant(variant)
            scene = self.room()
            result = covary.mitsuba.render(scene, 24, groups=3, aovs=True, estimator="iicv")
            plain = numpy.array(self.mi.render(scene, spp=64, seed=9))
            numpy.testing.assert_allclose(result.image.mean(), plain[..., :3].mean(), rtol=0.05, err_msg=variant)
            if variant == "llvm_ad_mono":
                self.assertEqual(numpy.ptp(result.image, axis=-1).max(), 0)
            self.assertEqual([result.aovs[name].shape for name in ("Albedo", "N")], [(32, 48, 3)] * 2)
            self.assertGreater(result.aovs["Albedo"].mean(), 0.2)
            self.assertAlmostEqual(float(numpy.linalg.norm(result.aovs["N"], axis=-1).max()), 1, delta=0.05)

    def test_features_behind_glass(self):
        """A pane in front of a wall: the pane's own, which has no albedo, and the wall's in the colour of the glass."""
        place = self.mi.ScalarTransform4f
        scene = self.scene_with({"type": "box"})
        scene["ball"] = {"type": "rectangle", "to_world": place().translate([0, 0, -1]).scale(9),
                         "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.2, 0.5, 0.8]}}}
        scene["pane"] = {"type": "rectangle", "to_world": place().translate([0, 0, 1]).rotate([0, 1, 0], 30).scale(2),
                         "bsdf": {"type": "thindielectric", "int_ior": 1.01,
                                  "specular_transmittance": {"type": "rgb", "value": [1, 0.5, 1]}}}
        aovs = covary.mitsuba.render(self.mi.load_dict(scene), 12, oidn="off").aovs
        seen = {name: aovs[name][10:20, 20:28].mean((0, 1)) for name in aovs}
        numpy.testing.assert_allclose(seen["Albedo"], 0, atol=1e-6)
        numpy.testing.assert_allclose(seen["N"], [0.5, 0, 0.866], atol=1e-3)
        numpy.testing.assert_allclose(seen["DenoisingAlbedo"], [0.2, 0.25, 0.8], atol=0.01)
        numpy.testing.assert_allclose(seen["DenoisingNormal"], [0, 0, 1], atol=0.01)

    def test_filter(self):
        result = covary.mitsuba.render(self.mi.load_dict(self.scene_with({"type": "gaussian"})), 12)
        self.assertIn("was replaced by a box one pixel wide, because", result.warnings[0])

    def test_sampler(self):
        for sampler, name in (("multijitter", "Multijitter"), ("ldsampler", "LowDiscrepancy")):
            scene = self.scene_with({"type": "box"}, sampler={"type": sampler, "sample_count": 16})
            warnings = covary.mitsuba.render(self.mi.load_dict(scene), 12).warnings
            self.assertEqual(len(warnings), 1)
            self.assertIn(f"the sensor's sampler {name}Sampler was replaced by independent numbers and common ones",
                          warnings[0])
            self.assertIn("--sampler sobol", warnings[0])

    def scene_with(self, rfilter, **sensor):
        return {"type": "scene", "integrator": {"type": "path"}, "light": {"type": "constant", "radiance": 0.7},
                "ball": {"type": "sphere"},
                "sensor": {"type": "perspective",
                           "to_world": self.mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                           "film": {"type": "hdrfilm", **SIZE, "rfilter": rfilter}, **sensor}}


class Refused(WithMitsuba):
    def refused(self, *arguments, **keywords):
        return self.message_of(covary.UsageError, covary.mitsuba.render, *arguments, **keywords)

    def test_integrators(self):
        self.assertIn("made for derivatives", self.refused(self.room(), 48, integrator="prb"))
        self.assertIn("follows light to pixels anywhere", self.refused(self.room(), 48, integrator="ptracer"))
        aov = {"type": "aov", "aovs": "pp:position,dd:depth"}
        self.assertIn("the integrator aov has channels pp.X, pp.Y, pp.Z, dd.T and no image; put an integrator into it",
                      self.refused(self.room(), 12, groups=3, integrator=aov))
        covary.mitsuba.render(self.room(), 12, groups=3, integrator=aov | {"image": {"type": "path"}})

    def test_numbers(self):
        self.assertIn("found 7 samples per pixel", self.refused(self.room(), 7, estimator="iicv"))
        self.assertIn("found 1 sample per pixel", self.refused(self.room(), 1))
        self.assertIn("groups: found 2", self.refused(self.room(), 48, groups=2))
        self.assertIn("sensor: found 3; the scene has 1", self.refused(self.room(), 48, sensor=3))

    def test_lens(self):
        scene = Render.scene_with(self, {"type": "box"})
        scene["sensor"] |= {"type": "thinlens", "aperture_radius": 0.1, "focus_distance": 4.0}
        self.assertIn("points on its lens", self.refused(self.mi.load_dict(scene), 48))

    def test_variants(self):
        code = f"import covary.mitsuba; covary.mitsuba.render({str(ROOM)!r}, 48)"
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        self.assertIn("no variant of Mitsuba is chosen; call mitsuba.set_variant() with one of", run.stderr)
        self.mi.set_variant("scalar_rgb")
        self.assertIn("the variant 'scalar_rgb' of Mitsuba takes samples one by one", self.refused("x.xml", 48))


if __name__ == "__main__":
    unittest.main()
