# SPDX-License-Identifier: Apache-2.0
"""What tests of the Python package share: small images with and without common random numbers, and the program."""
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy
from exr_reader import read_exr

SOURCE = Path(os.environ.get("SOURCE", Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("COVARY_PROGRAM", "covary")
ROOM = SOURCE / "scenes" / "room.xml"
GROUPS, HEIGHT, WIDTH = 12, 20, 24


def examples_of_page():
    """The examples of docs/python.md, in their order."""
    page = (SOURCE / "docs" / "python.md").read_text()
    return re.findall(r"^```python\n(.*?)^```$", page, re.M | re.S)


def noisy(seed, common, groups=GROUPS, height=HEIGHT, width=WIDTH):
    """Groups [T, H, W, 3] of a smooth image: relative noise that all pixels share up to a fifth, or none of it."""
    rng = numpy.random.default_rng(seed)
    picture = 1 + 0.02 * numpy.arange(width)[:, None] + 0.1 * numpy.arange(3)
    shared = rng.random((groups, 1, 1, 3)) - 0.5
    own = rng.random((groups, height, width, 3)) - 0.5
    noise = 0.8 * shared + 0.2 * own if common else own
    return (picture * (1 + noise)).astype(numpy.float32)


def pair(**size):
    """A CRN and an independent image."""
    return noisy(1, True, **size), noisy(2, False, **size)


def rgb(path):
    """R, G and B of an EXR as [H, W, 3], read without the code under test; the width is that of the tests' images."""
    return channels(path, [*"RGB"])


def channels(path, names):
    values = read_exr(Path(path).read_bytes())
    return numpy.array([values[name] for name in names], numpy.float32).T


class PackageTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def run_program(self, *words):
        """The program's messages; it must succeed. It may replace what it rendered with other settings."""
        if words[0] == "render" and not {"--resume", "--overwrite"} & set(words):
            words = (*words, "--overwrite")
        result = subprocess.run([PROGRAM, *map(str, words)], cwd=self.path, capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stderr

    def failure_of_program(self, *words):
        result = subprocess.run([PROGRAM, *map(str, words)], cwd=self.path, capture_output=True, text=True, check=False)
        self.assertNotEqual(result.returncode, 0)
        return result.stderr.strip().removeprefix("covary: ")

    def assert_same_bits(self, a, b):
        a, b = numpy.ascontiguousarray(a, numpy.float32), numpy.ascontiguousarray(b, numpy.float32)
        self.assertEqual(a.size, b.size)
        self.assertEqual(a.tobytes(), b.tobytes())

    def message_of(self, error, function, *arguments, **keywords):
        with self.assertRaises(error) as raised:
            function(*arguments, **keywords)
        return str(raised.exception)
