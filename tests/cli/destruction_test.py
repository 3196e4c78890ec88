# SPDX-License-Identifier: Apache-2.0
"""Nightly: files of covary that are damaged in many ways. A command either refuses such a file, naming it, or makes
of it what it makes of the whole one: nothing crashes, and nothing is wrong without a word. The third of these trials,
renders that are killed, is kept_films_test.py Kills; `ctest -L destructive` runs all of them."""
import os
import random
import unittest
from pathlib import Path

from cli_test import CliTest
from exr_reader import read_exr

ROOM = str(Path(os.environ["SCENES"]) / "room.xml")
RENDER = ("render", ROOM, "--resolution", "12x8", "--no-preview", "--quiet")


def flipped(data, chance):
    bit = chance.randrange(8 * len(data))
    return data[:bit // 8] + bytes([data[bit // 8] ^ 1 << bit % 8]) + data[bit // 8 + 1:]


def mutilated(data, chance):
    """A flipped bit, a missing end, something more, a part that is gone, doubled, exchanged or blank."""
    a, b = sorted(chance.randrange(len(data) + 1) for _ in range(2))
    return chance.choice((flipped(data, chance), data[:a], data + data[a:b] + b"x", data[:a] + data[min(b, a + 9):],
                          data[:a] + data[a:b] + data[a:], data[:a] + bytes(min(b - a, 64)) + data[a + min(b - a, 64):],
                          data[:a] + chance.randbytes(8) + data[a + 8:]))


class DestructionTest(CliTest):
    def refused_or_same(self, name, expected, *command):
        """`expected`: the pixels that the command makes of the whole file."""
        (self.path / "o.exr").unlink(missing_ok=True)
        result = self.run_covary(*command, errors="replace")
        self.assertIn(result.returncode, (0, 1, 2), result.stderr)
        if result.returncode == 0:
            self.assertEqual(read_exr((self.path / "o.exr").read_bytes()), expected)
        else:
            self.assertIn(name, result.stderr)
            self.assertFalse((self.path / "o.exr").exists())
        return result.returncode


class Bits(DestructionTest):
    FLIPS = 600

    def test_flipped_in_films_and_images(self):
        self.good(*RENDER, "--spp", "24", "--estimator", "iicv", "--passes", "films", "-o", "image.exr")
        self.good(*RENDER, "--spp", "12", "--estimator", "none", "--aovs", "-o", "film.exr")
        self.good(*RENDER, "--spp", "12", "--estimator", "none", "--aovs", "--seed", "2", "-o", "other.exr")
        commands = (("films/crn.exr", "combine", "--crn", "bad.exr", "--independent", "films/independent.exr"),
                    ("films/independent.exr", "combine", "--crn", "films/crn.exr", "--independent", "bad.exr"),
                    ("film.exr", "denoise", "bad.exr", "other.exr", "--oidn", "off"),
                    ("film.exr", "merge", "bad.exr", "other.exr"), ("image.exr", "convert", "bad.exr"))
        chance, codes = random.Random(600), []
        for source, *command in commands:
            whole = (self.path / source).read_bytes()
            command += ["o.exr", "--overwrite"] if command[0] == "convert" else ["-o", "o.exr"]
            (self.path / "bad.exr").write_bytes(whole)
            self.good(*command)
            expected = read_exr((self.path / "o.exr").read_bytes())
            for _ in range(self.FLIPS // len(commands)):
                (self.path / "bad.exr").write_bytes(flipped(whole, chance))
                codes.append(self.refused_or_same("bad.exr", expected, *command))
        self.assertEqual(len(codes), self.FLIPS)
        self.assertGreater(sum(code != 0 for code in codes), self.FLIPS / 2)


class Trainings(DestructionTest):
    FILES = 400

    def test_damaged(self):
        chance = random.Random(400)
        for learner in (("controlled-path", "--set", "cv-train=4"), ("guided-path", "--set", "guiding-train=4")):
            plain = (*RENDER, "--estimator", "none", "--integrator", *learner)
            self.good(*plain, "--spp", "8", "-o", "a.exr", "--save-training", "whole", "--overwrite")
            whole = (self.path / "whole").read_bytes()
            load = (*plain, "--spp", "4", "-o", "o.exr", "--overwrite", "--load-training")
            self.good(*load, "whole")
            expected = read_exr((self.path / "o.exr").read_bytes())
            for _ in range(self.FILES // 2):
                damaged = mutilated(whole, chance)
                (self.path / "bad.training").write_bytes(damaged)
                code = self.refused_or_same("bad.training", expected, *load, "bad.training")
                self.assertEqual(code == 0, damaged == whole)


if __name__ == "__main__":
    unittest.main()
