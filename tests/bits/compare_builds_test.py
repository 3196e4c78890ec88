# SPDX-License-Identifier: Apache-2.0
"""compare_builds finds no difference between a program and itself, and finds the one that is planted."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
COVARY = os.environ["COVARY"]


class CompareBuilds(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def compare(self, other, case, *options):
        return subprocess.run([sys.executable, str(HERE / "compare_builds"), COVARY, other, "--only", case, *options],
                              capture_output=True, text=True)

    def program(self, more):
        """A program that renders with one more option."""
        path = Path(self.folder.name) / "covary"
        path.write_text(f'#!/bin/sh\nexec {COVARY} "$@" {more}\n')
        path.chmod(0o755)
        return str(path)

    def test_a_program_equals_itself(self):
        result = self.compare(COVARY, "none, 1 group")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertRegex(result.stdout, r"^\d+ cases equal, 0 different")

    def test_another_seed_is_seen(self):
        result = self.compare(self.program("--seed 2"), "none, 1 group")
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertRegex(result.stdout, r"out.exr: channel \S+: \d+ of 3072 values differ")
        self.assertRegex(result.stdout, r"out.exr: attribute (covary:)?seed")

    def test_a_missing_image_is_seen(self):
        result = self.compare(self.program("--aovs"), "none, 1 group")
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("is in the second alone", result.stdout)

    def test_a_failing_program_is_seen(self):
        result = self.compare("/bin/false", "none, 1 group")
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("the second program failed, exit code 1", result.stdout)

    def test_what_both_refuse_is_equal(self):
        """Scenes with media, by an integrator that does not see them."""
        result = self.compare(COVARY, "bdpt")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        result = self.compare("/bin/false", "bdpt")
        self.assertIn("fog.xml, bdpt:\n    the first program failed, exit code 1: covary: ", result.stdout)

    def test_wrong_usage(self):
        self.assertEqual(self.compare("/no/such/program", "none, 1 group").returncode, 2)
        for size in ("42x32", "43x31", "64", "wide"):
            result = self.compare(COVARY, "crop", "--resolution", size)
            self.assertEqual(result.returncode, 2, size)
            self.assertIn(f"resolution '{size}'; expected WIDTHxHEIGHT, at least 43x32", result.stderr)


if __name__ == "__main__":
    unittest.main()
