# SPDX-License-Identifier: Apache-2.0
"""covary.blender by the package bpy, without a window, on a closed room of its own with an area light, a mirror and
matt objects."""
import os
import subprocess
import sys
import unittest
import zipfile
from pathlib import Path

import covary
import covary.blender
import numpy
from common import SOURCE, PackageTest


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


def material(bpy, colour, metallic=0.0, roughness=1.0):
    made = bpy.data.materials.new("material")
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Metallic"].default_value = metallic
    shader.inputs["Roughness"].default_value = roughness
    return made


def build_room(bpy, reset=True):
    """A box around the camera, in place of all that is there; with `reset` also of the preferences."""
    if reset:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.context.object.data.materials.append(material(bpy, (0.7, 0.6, 0.5)))
    for x, look in ((-0.7, ((0.8, 0.2, 0.1), 0.0, 1.0)), (0.7, ((0.9, 0.9, 0.9), 1.0, 0.2))):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(x, 0.6, -1.4))
        bpy.context.object.data.materials.append(material(bpy, *look))
    bpy.ops.object.light_add(type="AREA", location=(0.5, -0.5, 1.9))
    bpy.context.object.data.energy, bpy.context.object.data.size = 60, 1
    bpy.ops.object.camera_add(location=(0, -1.9, 0), rotation=(1.45, 0, 0))
    bpy.context.object.data.lens = 20
    scene.camera = bpy.context.object
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 80, 48, 100
    scene.cycles.device = "CPU"
    return scene


def settings_of(scene):
    return {(owner.rna_type.name, p.identifier): str(getattr(owner, p.identifier))
            for owner in (scene, scene.cycles, scene.render, scene.render.image_settings)
            for p in owner.rna_type.properties if p.type in ("BOOLEAN", "INT", "FLOAT", "ENUM", "STRING")}


INSTALL = """
import sys
import bpy
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
bpy.ops.wm.save_userpref()
assert bpy.types.Scene.covary_samples
"""
USE = """
import pathlib
import bpy
bpy.ops.preferences.addon_enable(module="bl_ext.user_default.covary")
import covary.blender  # that of the extension's wheel
from blender_test import build_room
scene = build_room(bpy, reset=False)
scene.render.resolution_x, scene.render.resolution_y, scene.covary_samples = 24, 16, 72
assert bpy.ops.render.covary() == {"FINISHED"}
assert tuple(bpy.data.images["covary"].size) == (24, 16)
bpy.ops.preferences.addon_disable(module="bl_ext.user_default.covary")
assert not hasattr(bpy.types.Scene, "covary_samples")
print("from", covary.blender.__file__)
assert (pathlib.Path(covary.__file__).parents[1] / "nanobind_backend").exists()
"""


class Extension(PackageTest):
    """The file that Blender installs."""

    def wheel(self, name, tag, root, *packages):
        """Of files of this build, or of the environment, by hand."""
        path = self.path / f"{name}-0.1.0-{tag}.whl"
        information = f"{name}-0.1.0.dist-info"
        with zipfile.ZipFile(path, "w") as archive:
            for file in (file for package in packages for file in sorted((root / package).rglob("*"))):
                if file.is_file() and file.suffix != ".pyc":
                    archive.write(file, file.relative_to(root))
            archive.writestr(f"{information}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1.0\n")
            archive.writestr(f"{information}/WHEEL", f"Wheel-Version: 1.0\nRoot-Is-Purelib: false\nTag: {tag}\n")
            archive.writestr(f"{information}/RECORD", "")
        return path

    def test_installed_from_a_file(self):
        import nanobind_backend
        own = Path(covary.__file__).parent.parent
        wheels = (self.wheel("covary", "cp310-abi3-manylinux_2_35_x86_64", own, "covary"),
                  self.wheel("nanobind_backend", "cp311-cp311-manylinux_2_28_x86_64",
                             Path(nanobind_backend.__file__).parent.parent, "nanobind_backend"))
        subprocess.run([SOURCE / "scripts" / "blender_addon", *wheels, self.path / "covary.zip"], check=True)
        with zipfile.ZipFile(self.path / "covary.zip") as archive:
            self.assertIn('version = "0.1.0"', archive.read("blender_manifest.toml").decode())
        environment = {**os.environ, "BLENDER_USER_RESOURCES": str(self.path / "blender"),
                       "PYTHONPATH": f"{SOURCE / 'tests' / 'python'}:{SOURCE / 'tests' / 'cli'}"}
        for code in (INSTALL, USE):
            run = subprocess.run([sys.executable, "-c", code, self.path / "covary.zip"], env=environment,
                                 capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        self.assertIn(f"from {self.path / 'blender'}", run.stdout)

    def test_other_files(self):
        run = subprocess.run([SOURCE / "scripts" / "blender_addon", "a.whl", "b.whl", "c.zip"], capture_output=True,
                             text=True, check=False)
        self.assertEqual(run.returncode, 1)
        self.assertIn("expected are a wheel of covary and others", run.stderr)


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
        with covary.blender._settings(self.scene):
            cycles.samples, cycles.seed, cycles.scrambling_distance = spp, seed, 1
            self.scene.render.filepath = str(self.path / name)
            self.bpy.ops.render.render(write_still=True)
        return covary.read_image(self.path / name)

    def test_less_noise_and_settings_as_before(self):
        before, seen = settings_of(self.scene), []
        result = covary.blender.render(self.scene, 96, progress=lambda done, total: seen.append((done, total)))
        self.assertEqual(settings_of(self.scene), before)
        self.assertEqual(seen[-1], (24, 24))
        report = covary.check_inputs(result.films["crn"], result.films["independent"])
        self.assertTrue(report.ok, report.errors)
        self.assertGreater(report.crn_horizontal[0], 0.3)
        references = [self.plain(256, seed, f"{seed}.exr") for seed in (901, 902)]
        plain = self.plain(96, 903, "plain.exr")
        error, plain_error = (covary.metrics.relmse(image, *references) for image in (result.image, plain))
        print(f"relMSE {error:.4f}, Cycles in one go {plain_error:.4f}")
        self.assertLess(error, plain_error)
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

    def test_compositor(self):
        """Is off while groups render, and said to be where it has nodes."""
        self.assertNotIn("compositor", " ".join(covary.blender.changes(self.scene)))
        if self.bpy.app.version < (5, 0):
            self.scene.use_nodes = True
        else:
            self.scene.compositing_node_group = self.bpy.data.node_groups.new("group", "CompositorNodeTree")
        self.assertIn("the compositor would change the pixels", " ".join(covary.blender.changes(self.scene)))
        with covary.blender._settings(self.scene):
            owner, name, value, _ = covary.blender._compositor(self.scene)
            self.assertEqual((getattr(owner, name), value), (False, False))

    def test_settings_come_back_after_an_error(self):
        def fail(done, total):
            raise RuntimeError("enough")
        before = settings_of(self.scene)
        self.assertEqual(self.message_of(RuntimeError, covary.blender.render, self.scene, 72, progress=fail), "enough")
        self.assertEqual(settings_of(self.scene), before)

    def test_add_on(self):
        covary.blender.register()
        try:
            self.scene.render.resolution_x, self.scene.render.resolution_y = 40, 24
            self.scene.covary_samples = 72
            self.assertEqual(self.bpy.ops.render.covary(), {"FINISHED"})
            self.assertEqual(tuple(self.bpy.data.images["covary"].size), (40, 24))
        finally:
            covary.blender.unregister()
        self.assertFalse(hasattr(self.bpy.types.Scene, "covary_samples"))


if __name__ == "__main__":
    unittest.main()
