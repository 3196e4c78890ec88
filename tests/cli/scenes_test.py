# SPDX-License-Identifier: Apache-2.0
"""covary scenes: what the suites need, and what a folder has of it."""
import json
import shutil
import unittest
from pathlib import Path

from cli_test import CliTest

SOURCE = Path(__file__).resolve().parents[2]
SUITES, ROOM = SOURCE / "suites", SOURCE / "scenes" / "room.xml"


class Scenes(CliTest):
    def test_lists_what_suites_name(self):
        text = self.good("scenes").stdout
        for file in SUITES.glob("*.json"):
            for scene in json.loads(file.read_text())["scenes"]:
                self.assertIn(f"{scene['file']}\n    {scene['credit']}\n", text)
        self.assertIn("; comes with covary", text)
        one = self.good("scenes", "cms-table1").stdout
        self.assertIn("cms-rgbsofa/scene.xml", one)
        self.assertNotIn("kitchen", one)
        self.assertIn("https://github.com/qingqhua/ControlledMixtureSampling", one)
        kitchen = self.good("scenes", "kitchen").stdout
        self.assertRegex(kitchen, r"^kitchen/scene_v3\.xml\n.*Jay-Artist.*\n    in .*iicv-table1")
        self.assertEqual(len(kitchen.splitlines()), 4)
        self.assertIn("https://benedikt-bitterli.me/resources/", kitchen)
        self.assertIn("room.xml\n", self.good("scenes", "room").stdout)
        paper = self.good("scenes", "iicv").stdout
        self.assertIn("kitchen/scene_v3.xml\n", paper)
        self.assertNotIn("cms-rgbsofa", paper)
        (self.path / "none").mkdir()
        self.bad(1, "'none' has none of the scenes of iicv-table1; `covary scenes iicv-table1 --folder none` says",
                 "experiment", "iicv-table1", "--scenes", "none", "-o", "out")

    def test_a_folder_that_is_missing(self):
        self.bad(1, "--folder 'nowhere': there is no such folder", "scenes", "iicv-table1", "--folder", "nowhere")

    def test_checks_a_folder(self):
        """All that is missing at once; another scene under the name is told."""
        (self.path / "kitchen").mkdir()
        shutil.copy(ROOM, self.path / "kitchen" / "scene_v3.xml")
        (self.path / "house").mkdir()
        (self.path / "house" / "scene_v3.xml").write_text("<scene")
        result = self.run_covary("scenes", "iicv-table1", "--folder", ".")
        self.assertEqual(result.returncode, 1)
        self.assertIn("9 of 10 scenes are missing or cannot be read", result.stderr)
        lines = dict(line.split(maxsplit=1) for line in result.stdout.splitlines())
        self.assertEqual(lines["kitchen/scene_v3.xml"], "another version")
        self.assertEqual(lines["staircase/scene_v3.xml"], "missing")
        self.assertIn("house/scene_v3.xml", lines["house/scene_v3.xml"])
        self.bad(2, "no suite or scene is named 'iicv-table2'; did you mean 'iicv-table1'", "scenes", "iicv-table2")


if __name__ == "__main__":
    unittest.main()
