# SPDX-License-Identifier: Apache-2.0
"""The examples of docs/start.md, docs/cluster.md and docs/mitsuba.md, as programs of their own."""
import re
import shutil
import subprocess
import sys
import unittest

import covary
from common import ROOM, SOURCE, PackageTest


class Page(PackageTest):
    def run_example(self, page, image="room.exr", size=(320, 480)):
        """The first block of Python of the page, where room.xml is; it leaves an image."""
        block = re.search(r"^```python\n(.*?)^```$", (SOURCE / "docs" / page).read_text(), re.M | re.S)[1]
        shutil.copy(ROOM, self.path / "room.xml")
        (self.path / "example.py").write_text(block)
        run = subprocess.run([sys.executable, "example.py"], cwd=self.path, capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual(covary.read_image(self.path / image).shape, (*size, 3))


class Start(Page):
    def test_example(self):
        self.run_example("start.md", "room.png", (80, 120))


class Cluster(Page):
    def test_example(self):
        self.run_example("cluster.md")


class Mitsuba(Page):
    def test_example(self):
        self.run_example("mitsuba.md")


if __name__ == "__main__":
    unittest.main()
