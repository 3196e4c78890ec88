# SPDX-License-Identifier: Apache-2.0
"""Programs behind the papers' pages that need NumPy. docs/figures/iicv_oracle.py: its own form of the published
estimator, in double precision, has the error of the program's, and true errors as penalties have less.
docs/figures/iicv_adaptive.py: counts by Eq. (8) have the stated mean and go where they pay.
docs/figures/controlled_mixtures.py: weights chosen jointly with the control are never worse."""
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

import numpy as np

SOURCE = Path(os.environ["SOURCE"])
sys.path.insert(0, str(SOURCE / "docs" / "figures"))
import controlled_mixtures  # noqa: E402
import iicv_adaptive  # noqa: E402


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


class Adaptive(unittest.TestCase):
    def test_counts(self):
        demand = np.array([[1.0, 2.0, 3.0], [0.0, 1.5, 50.0]])
        counts = iicv_adaptive.counts_of(demand, 4, 10, 20)
        self.assertEqual(counts[1].tolist()[::2], [4, 20], "the limits")
        self.assertAlmostEqual(counts.mean(), 10, delta=0.5)
        self.assertAlmostEqual(counts[0, 2] / counts[0, 1], 1.5, delta=0.15)

    def test_demand(self):
        """Pixel 1 is used by itself and, with twice the coefficient, by pixel 0, which is darker."""
        beta, y, x = np.array([[[2.0], [1.0]]]), np.array([[[0], [0]]]), np.array([[[1], [1]]])
        deviation, grey = np.array([[5.0, 3.0]]), np.array([[0.3, 0.7]])
        demand = iicv_adaptive.demand_by_eq8(beta, y, x, deviation, grey)
        self.assertEqual(demand[0, 0], 0)
        self.assertAlmostEqual(demand[0, 1], 3 * (4 / 0.1 + 1 / 0.5) ** 0.5)

    def test_mean_of_first(self):
        pool = np.arange(12.0).reshape(4, 1, 3, 1)
        self.assertEqual(iicv_adaptive.mean_of_first(pool, np.array([[1, 2, 4]])).ravel().tolist(), [0, 2.5, 6.5])


class Weights(unittest.TestCase):
    def test_joint_weights(self):
        rows = controlled_mixtures.choices_of_weights()
        for title, (given, without_control, joint) in rows.items():
            self.assertLessEqual(joint, min(given, without_control) + 1e-9, title)
        self.assertAlmostEqual(rows["a sun sampled too little"][2], 0.704, delta=0.001)


if __name__ == "__main__":
    unittest.main()
