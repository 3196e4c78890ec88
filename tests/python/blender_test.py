# SPDX-License-Identifier: Apache-2.0
"""covary.blender by the package bpy, without a window. The add-on has tests of its own (tests/blender)."""
import sys
import types
import unittest

import covary
import covary.blender
import numpy
from common import PackageTest
from covary import _cycles
from room import build_room, settings_of


class Missing(PackageTest):
    def test_bpy(self):
        kept = sys.modules.get("bpy")
        sys.modules["bpy"] = None
        try:
            self.assertIn("covary.blender needs Blender's Python", self.message_of(ImportError, covary.blender.render))
        finally:
            del sys.modules["bpy"]
            if kept:
                sys.modules["bpy"] = kept


class Samplers(PackageTest):
    def test_what_is_lost_is_said(self):
        for pattern, words in (("BLUE_NOISE", "arranged over its pixels"), ("TABULATED_SOBOL", ""), ("AUTOMATIC", "")):
            cycles = types.SimpleNamespace(sampling_pattern=pattern)
            self.assertIn(words, _cycles.blue_noise(cycles), pattern)
            self.assertEqual(bool(words), bool(_cycles.blue_noise(cycles)))


class Render(PackageTest):
    @classmethod
    def setUpClass(cls):
        import bpy
        cls.bpy = bpy

    def setUp(self):
        super().setUp()
        self.scene = build_room(self.bpy)

    def plain(self, spp, seed, name):
        """Cycles in one go, as covary sets it."""
        cycles = self.scene.cycles
        with _cycles.settings(self.scene):
            cycles.samples, cycles.seed, cycles.scrambling_distance = spp, seed, 1
            self.scene.render.filepath = str(self.path / name)
            self.bpy.ops.render.render(write_still=True)
        return covary.read_image(self.path / name)

    def test_less_noise_and_settings_as_before(self):
        before, seen = settings_of(self.scene), []
        default = covary.blender.render(self.scene, 96, progress=lambda done, total: seen.append((done, total)))
        self.assertEqual(settings_of(self.scene), before)
        self.assertEqual((seen[-1], list(default.films)), ((12, 12), ["independent"]))
        self.assertTrue(default.estimator.startswith("mixture --denoise auto"))
        unguided = covary.combine(None, default.films["independent"])
        self.assertFalse((unguided.image == default.image).all(), "albedo and normal are Cycles' own")
        result = covary.blender.render(self.scene, 96, estimator="iicv")
        self.assertEqual(settings_of(self.scene), before)
        report = covary.check_inputs(result.films["crn"], result.films["independent"])
        self.assertTrue(report.ok, report.errors)
        self.assertGreater(report.crn_horizontal[0], 0.3)
        references = [self.plain(256, seed, f"{seed}.exr") for seed in (901, 902)]
        plain = self.plain(96, 903, "plain.exr")
        by_default, error, plain_error = (covary.metrics.relmse(image, *references)
                                          for image in (default.image, result.image, plain))
        print(f"relMSE {by_default:.4f}, iicv {error:.4f}, Cycles in one go {plain_error:.4f}")
        self.assertLess(error, plain_error)
        self.assertLess(by_default, error)
        numpy.testing.assert_allclose(default.image.mean(), references[0].mean(), rtol=0.02)
        numpy.testing.assert_allclose(result.image.mean(), references[0].mean(), rtol=0.02)
        self.assertIn("use_adaptive_sampling is True and was rendered with False", " ".join(result.warnings))
        self.assertIn("sample_clamp_indirect is 10.0", " ".join(result.warnings))

        image = covary.blender.show(result)
        pixels = numpy.array(image.pixels[:], numpy.float32).reshape(48, 80, 4)[::-1, :, :3]
        self.assert_same_bits(pixels, result.image)

    def test_refused(self):
        def refused(*arguments, **keywords):
            return self.message_of(covary.UsageError, covary.blender.render, self.scene, *arguments, **keywords)
        self.assertIn("settings that cannot stay: use_adaptive_sampling", refused(96, change=False))
        self.assertIn("found 100 samples in 12 groups", refused(100))
        self.scene.render.engine = "BLENDER_WORKBENCH"
        self.assertIn("only Cycles has common random numbers", refused(96))
        self.scene.render.engine, self.scene.camera = "CYCLES", None
        self.assertIn("the scene 'Scene' has no camera", refused(96))

    def test_white_world(self):
        """Looks clipped, and is rendered."""
        for thing in [thing for thing in self.bpy.data.objects if thing.type != "CAMERA"]:
            self.bpy.data.objects.remove(thing)
        self.scene.world = self.bpy.data.worlds.new("white")
        self.scene.world.use_nodes = True
        self.scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
        result = covary.blender.render(self.scene, 72)
        numpy.testing.assert_allclose(result.image, 1, rtol=2e-3)
        self.assertIn("clipped", " ".join(result.warnings))

    def test_compositor(self):
        """Is off while groups render, and said to be where it has nodes."""
        self.assertNotIn("compositor", " ".join(covary.blender.changes(self.scene)))
        if self.bpy.app.version < (5, 0):
            self.scene.use_nodes = True
        else:
            self.scene.compositing_node_group = self.bpy.data.node_groups.new("group", "CompositorNodeTree")
        self.assertIn("the compositor would change the pixels", " ".join(covary.blender.changes(self.scene)))
        with _cycles.settings(self.scene):
            owner, name, value, _ = _cycles.compositor(self.scene)
            self.assertEqual((getattr(owner, name), value), (False, False))

    def test_settings_come_back_after_an_error(self):
        def fail(done, total):
            raise RuntimeError("enough")
        before = settings_of(self.scene)
        self.assertEqual(self.message_of(RuntimeError, covary.blender.render, self.scene, 72, progress=fail), "enough")
        self.assertEqual(settings_of(self.scene), before)


if __name__ == "__main__":
    unittest.main()
