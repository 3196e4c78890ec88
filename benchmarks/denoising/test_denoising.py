# SPDX-License-Identifier: Apache-2.0
import math
import tempfile
import unittest
import xml.etree.ElementTree
from pathlib import Path

from denoising import resolution_of, tables, turned_cameras, turned_scene

SCENE = """<scene version="3.0.0"><default name="w" value="720"/>
<sensor type="perspective">
<transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="$w"/><integer name="height" value="1280"/></film></sensor></scene>"""


class Denoising(unittest.TestCase):
    def test_a_camera_is_turned_before_it_is_placed(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "scene_v3.xml"
            path.write_text(SCENE)
            (Path(folder) / "textures").mkdir()
            turned = turned_scene(path, 15, Path(folder) / "turned")
            steps = list(xml.etree.ElementTree.parse(turned).find("./sensor/transform"))
            self.assertEqual([step.tag for step in steps], ["rotate", "lookat"])
            self.assertEqual(steps[0].attrib, {"y": "1", "angle": "15"})
            self.assertTrue((turned.parent / "textures").is_dir())
            self.assertEqual(path.read_text(), SCENE)

    def test_a_frame_keeps_its_proportion(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "scene.xml"
            path.write_text(SCENE)
            self.assertEqual(resolution_of(path, 320), "180x320")

    def test_ten_cameras_are_turned(self):
        self.assertEqual(len(turned_cameras()), 10)

    def test_tables_have_geometric_means_and_the_worst_scene(self):
        rows = [{"scene": scene, "spp": 16, "method": method, "relmse": error, "flip": 0.1, "squared_bias": bias}
                for scene, method, error, bias in (("a", "oidn", 0.02, math.nan), ("a", "auto", 0.01, 0.005),
                                                   ("b", "oidn", 0.01, math.nan), ("b", "auto", 0.02, 0.01))]
        text = tables(rows)
        self.assertIn("| a | 20, 0.100 | 10, 0.100, 50 % |", text)
        self.assertIn("| over OIDN, mean | 1.000, 1.000 | 1.000, 1.000 |", text)
        self.assertIn("| over OIDN, worst | 1.000, 1.000 | 2.000, 1.000 |", text)


if __name__ == "__main__":
    unittest.main()
