# SPDX-License-Identifier: Apache-2.0
"""docs/figures/dependent_scenes.py makes scenes with exactly the numbers of patches and lamps that Csonka et al. 2002
state: those of the kitchen and the room; and the program reads them."""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(os.environ["SOURCE"]) / "docs" / "figures" / "dependent_scenes.py"


class Patches(unittest.TestCase):
    def test_numbers(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, SCRIPT, folder], check=True)
            for name, patches, lamps in (("dt-kitchen", 9143, 2), ("dt-room", 18134, 1)):
                scene = Path(folder) / name / "scene.xml"
                text = scene.read_text(encoding="utf-8")
                self.assertEqual(text.count("<emitter "), lamps, name)
                self.assertEqual(text.count('type="rectangle"'), lamps, name)
                meshes = re.findall(r'value="(\w+\.ply)"', text)
                self.assertEqual(sorted(meshes), sorted(file.name for file in scene.parent.glob("*.ply")))
                headers = [(scene.parent / mesh).read_text(encoding="ascii") for mesh in meshes]
                faces = sum(int(re.search(r"element face (\d+)", header)[1]) for header in headers)
                self.assertEqual(faces + lamps, patches, name)
                told = subprocess.run([os.environ["COVARY"], "info", scene], check=True, capture_output=True, text=True)
                self.assertIn(f"{faces + 2 * lamps} triangles", told.stdout, "a lamp is a rectangle of two")


if __name__ == "__main__":
    unittest.main()
