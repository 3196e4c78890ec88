# SPDX-License-Identifier: Apache-2.0
"""docs/figures/iicv_oracle.py: its own form of the published estimator, in double precision, has the error of the
program's, and true errors as penalties have less."""
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

SOURCE = Path(os.environ["SOURCE"])


class Oracle(unittest.TestCase):
    def test_gains(self):
        command = [sys.executable, SOURCE / "docs" / "figures" / "iicv_oracle.py", os.environ["COVARY"],
                   SOURCE / "scenes" / "room.xml", "--spp", "48", "--reference-spp", "128", "--seeds", "1",
                   "--resolution", "48x32"]
        told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        errors = {name: float(error) for name, error in re.findall(r"^(.*): relMSE (\S+),", told, re.M)}
        self.assertAlmostEqual(errors["(f) again"] / errors["(f) pilot"], 1, delta=1e-3)
        self.assertLess(errors["(f) pilot"], errors["(f) by independent values"], "which choose what is as noisy")
        self.assertNotEqual(errors["(f) nearest pixels"], errors["(f) again"])
        self.assertLess(errors["(g) true errors"], 0.9 * errors["(f) pilot"])
        self.assertLess(errors["(f) pilot"], errors["(e) sample variance"])
        self.assertLess(errors["(e) sample variance"], errors["(d) baseline"])


if __name__ == "__main__":
    unittest.main()
