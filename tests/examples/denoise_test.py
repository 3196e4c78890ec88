# SPDX-License-Identifier: Apache-2.0
"""docs/examples/denoise_*.py: covary denoise takes what each renders, with its features.
Needs the renderer's module."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

COVARY, SOURCE = os.environ["COVARY"], Path(os.environ["SOURCE"])
RENDERER = sys.argv.pop(1)

LUXCORE_SCENE = """scene.camera.lookat.orig = 3 -3 2
scene.camera.lookat.target = 0 0 0.4
scene.camera.fieldofview = 40
scene.materials.floor.type = matte
scene.materials.floor.kd = 0.7 0.6 0.5
scene.materials.lamp.type = matte
scene.materials.lamp.kd = 0 0 0
scene.materials.lamp.emission = 20 20 20
scene.objects.floor.material = floor
scene.objects.floor.vertices = -4 -4 0 4 -4 0 4 4 0 -4 4 0
scene.objects.floor.faces = 0 1 2 2 3 0
scene.objects.block.material = floor
scene.objects.block.vertices = -0.5 -0.5 0 0.5 -0.5 0 0 0.5 0 0 0 1.2
scene.objects.block.faces = 0 1 3 1 2 3 2 0 3
scene.objects.lamp.material = lamp
scene.objects.lamp.vertices = -1 -1 4 -1 1 4 1 1 4 1 -1 4
scene.objects.lamp.faces = 0 1 2 2 3 0
"""
LUXCORE_SETTINGS = """renderengine.type = PATHCPU
scene.file = scene.scn
film.width = 96
film.height = 64
film.outputs.0.type = RGB_IMAGEPIPELINE
film.outputs.0.filename = picture.png
film.imagepipeline.0.type = TONEMAP_LINEAR
film.imagepipeline.1.type = GAMMA_CORRECTION
"""


class Denoise(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def run_in_folder(self, *command):
        result = subprocess.run(list(map(str, command)), cwd=self.path, capture_output=True, text=True, timeout=1000)
        self.assertEqual(result.returncode, 0, result.stderr + result.stdout)
        return result.stderr

    def scene(self):
        """The renderer's own file of a scene, a small image."""
        if RENDERER == "mitsuba":
            text = (SOURCE / "scenes" / "room.xml").read_text()
            text = text.replace('name="width" value="480"', 'name="width" value="96"')
            (self.path / "scene.xml").write_text(text.replace('name="height" value="320"', 'name="height" value="64"'))
            for folder in ("meshes", "textures"):
                if (SOURCE / "scenes" / folder).exists():
                    (self.path / folder).symlink_to(SOURCE / "scenes" / folder)
            return "scene.xml"
        if RENDERER == "luxcore":
            (self.path / "scene.scn").write_text(LUXCORE_SCENE)
            (self.path / "render.cfg").write_text(LUXCORE_SETTINGS)
            return "render.cfg"
        make = ("import bpy; s = bpy.context.scene; s.render.resolution_x = 96; s.render.resolution_y = 64; "
                f"bpy.ops.wm.save_as_mainfile(filepath={str(self.path / 'scene.blend')!r})")
        self.run_in_folder(sys.executable, "-c", make)
        return "scene.blend"

    def test_example(self):
        self.run_in_folder(sys.executable, SOURCE / f"docs/examples/denoise_{RENDERER}.py", self.scene(), 8)
        features = ("--albedo", "a.albedo.exr", "--normal", "a.normal.exr") if RENDERER == "luxcore" else ()
        said = self.run_in_folder(COVARY, "denoise", "a.exr", "b.exr", *features, "-o", "out.exr", "--oidn", "off")
        self.assertIn("of 2 renders, guided by albedo and normal", said)

    def test_more_renders(self):
        """Of eight the predicted error has an interval."""
        if RENDERER == "blender":
            return  # has no such argument
        self.run_in_folder(sys.executable, SOURCE / f"docs/examples/denoise_{RENDERER}.py", self.scene(), 2, 8)
        said = self.run_in_folder(COVARY, "denoise", *(f"{name}.exr" for name in "abcdefgh"), "-o", "out.exr", "--oidn",
                                  "off")
        self.assertIn("of 8 groups", said)
        self.assertNotIn("no interval can be given", said)


if __name__ == "__main__":
    unittest.main()
