# SPDX-License-Identifier: Apache-2.0
"""Scenes in Mitsuba's XML: the same pictures to the last bit; files that are replaced when that is asked for, only."""
import os
import re
import unittest
from pathlib import Path

from cli_test import CliTest
from exr_reader import read_exr

SCENES = Path(os.environ["SCENES"])
MESH = """Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 24 "integer yresolution" 16
WorldBegin
LightSource "infinite" "rgb L" [ 1 1.1 1.2 ]
Translate 0 0 3
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -1.3 -1 0  1 -1 0  0 1 .5 ]
"""


class ConvertScene(CliTest):
    def picture(self, scene, name):
        self.good("render", scene, "-o", name, "--resolution", "48x32", "--spp", "8", "--estimator", "none", "--quiet",
                  "--no-preview", "--seed", "3")
        return read_exr((self.path / name).read_bytes())

    def test_the_same_picture(self):
        self.good("convert-scene", str(SCENES / "spheres.pbrt"), "out.xml")
        self.assertEqual(self.picture(str(SCENES / "spheres.pbrt"), "a.exr"), self.picture("out.xml", "b.exr"))

    def test_files_stay_whole(self):
        self.write("mesh.pbrt", MESH.encode())
        self.assertEqual(self.good("convert-scene", "mesh.pbrt", "out.xml").stdout, "")
        names = re.findall(r'"(out-files/[0-9a-f]{16}\.ply)"', (self.path / "out.xml").read_text())
        self.assertEqual([str(p.relative_to(self.path)) for p in self.path.glob("out-files/*")], names)
        self.picture("out.xml", "a.exr")
        # What already exists is replaced when that is asked for.
        self.bad(2, "the output 'out.xml' already exists; give another name, or --overwrite", "convert-scene",
                 "mesh.pbrt", "out.xml")
        (self.path / "out.xml").write_text("mine")
        self.good("convert-scene", "mesh.pbrt", "out.xml", "--overwrite")
        self.picture("out.xml", "b.exr")
        (self.path / names[0]).write_text("mine")
        (self.path / "out.xml").unlink()
        self.bad(2, f"the output '{names[0]}' already exists", "convert-scene", "mesh.pbrt", "out.xml")
        self.assertEqual((self.path / names[0]).read_text(), "mine")
        self.good("convert-scene", "mesh.pbrt", "out.xml", "--overwrite")
        self.picture("out.xml", "c.exr")

    def test_a_scene_elsewhere_finds_its_files(self):
        for folder in ("from", "to"):
            (self.path / folder).mkdir()
        self.write("from/mesh.pbrt", (MESH + 'Texture "t" "spectrum" "imagemap" "string filename" "t.ppm"\n'
                                      'Material "diffuse" "texture reflectance" "t"\nTranslate 1 0 0\n'
                                      'Shape "sphere"\n').encode())
        self.write("from/t.ppm", b"P6\n1 1\n255\nabc")
        self.good("convert-scene", "from/mesh.pbrt", "to/out.xml")
        self.assertIn('"../from/t.ppm"', (self.path / "to/out.xml").read_text())
        self.assertEqual(self.picture("from/mesh.pbrt", "a.exr"), self.picture("to/out.xml", "b.exr"))

    def test_mistakes(self):
        self.write("mesh.pbrt", MESH.encode())
        self.write("old.xml", b'<scene version="0.6.0"><sensor type="perspective"/></scene>')
        self.bad(2, "the output 'out.txt': the name must end in .xml", "convert-scene", "mesh.pbrt", "out.txt")
        self.bad(2, "the output 'mesh.pbrt'", "convert-scene", "mesh.pbrt", "mesh.pbrt")
        self.bad(2, "is a file that the same command reads", "convert-scene", "old.xml", "old.xml", "--overwrite")
        self.bad(1, "no-folder", "convert-scene", "mesh.pbrt", "no-folder/at/out.xml")
        self.bad(1, "no.pbrt", "convert-scene", "no.pbrt", "out.xml")
        self.bad(2, "must be the name of a file", "convert-scene", "mesh.pbrt", "/dev/null")
        self.bad(2, "scenes of pbrt have no parameters to define", "convert-scene", "mesh.pbrt", "out.xml", "-D", "a=1")
        self.write("wrong.pbrt", b'WorldBegin\nShape "cube"\n')
        self.bad(1, 'wrong.pbrt:2:1: Shape "cube" is not supported', "convert-scene", "wrong.pbrt", "out.xml")
        self.good("convert-scene", "old.xml", "/dev/stdout")
        # A file that the scene includes is not replaced by it.
        self.write("part.xml", b'<scene version="3.0.0"><sensor type="perspective"/></scene>')
        self.write("whole.xml", b'<scene version="3.0.0"><include filename="part.xml"/></scene>')
        self.bad(2, "the output 'part.xml' is a file that the scene reads", "convert-scene", "whole.xml", "part.xml",
                 "--overwrite")


if __name__ == "__main__":
    unittest.main()
