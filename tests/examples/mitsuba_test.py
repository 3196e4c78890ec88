# SPDX-License-Identifier: Apache-2.0
"""docs/examples/mitsuba_crn.py: covary combine accepts what it renders, and the result has less error.

Needs Mitsuba 3 and, for its LLVM variant, DRJIT_LIBLLVM_PATH. Seeds are fixed: relMSE of the combination 0.0026, of the
independent images alone 0.027, at 240 x 160 pixels with 48 + 48 samples; here the image is smaller."""
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

COVARY, SOURCE = os.environ["COVARY"], Path(os.environ["SOURCE"])
SIZE = ("-D", "width=96", "-D", "height=64")


class Mitsuba(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def run_in_folder(self, *command):
        result = subprocess.run(list(map(str, command)), cwd=self.path, capture_output=True, text=True, timeout=1000)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def relmse(self, image):
        return json.loads(self.run_in_folder(COVARY, "compare", image, "--reference", "r.exr", "--json", "-"))["relmse"]

    def test_example(self):
        scene = SOURCE / "scenes" / "room.xml"
        self.run_in_folder(sys.executable, SOURCE / "docs/examples/mitsuba_crn.py", scene, "m", "--spp", 24, *SIZE)
        self.run_in_folder(COVARY, "render", scene, "-o", "r.exr", "--estimator", "none", "--spp", 512, "--rfilter",
                           "box", *SIZE)
        images = {kind: sorted(self.path.glob(f"m/{kind}_*.exr")) for kind in ("crn", "independent")}
        self.assertEqual([len(group) for group in images.values()], [12, 12])
        facts = json.loads(self.run_in_folder(COVARY, "combine", "--crn", *images["crn"], "--independent",
                                              *images["independent"], "-o", "out.exr", "--json", "-", "--quiet"))
        self.assertGreater(facts["rank_correlation"]["crn_horizontal"]["value"], 0.5)
        # Each independent group has a twelfth of the samples, and twelve times the error of their mean.
        self.assertLess(self.relmse("out.exr"), 0.5 * self.relmse(images["independent"][0]) / 12)


if __name__ == "__main__":
    unittest.main()
