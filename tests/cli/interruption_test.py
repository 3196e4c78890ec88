# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends every command. Each is made to wait at a pipe that nobody serves, so that nothing else can end it."""
import math
import os
import random
import re
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
import terminal  # noqa: E402
from cli_test import COVARY, SLOWDOWN, CliTest
from exr_reader import read_exr
from exr_writer import film

COMMANDS = (("info", "pipe.xml"), ("render", "pipe.xml", "-o", "a.exr"), ("experiment", "pipe.xml", "-o", "folder"),
            ("probe", "pipe.xml", "--pixel", "1,1", "-o", "a.exr"),
            ("compare", "1.exr", "--reference", "2.exr", "--json", "pipe.json"), ("convert", "1.exr", "pipe.pfm"),
            ("merge", "1.exr", "2.exr", "-o", "pipe.exr"), ("view", "1.exr", "-o", "pipe.html"),
            ("combine", "--crn", "1.exr", "--independent", "2.exr", "-o", "pipe.exr", "--force"))


def interrupted_when(test, process, is_ready):
    """What a process says that gets SIGINT as soon as `is_ready()`; it has to end by it."""
    test.addCleanup(process.kill)
    while process.poll() is None and not is_ready():
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    errors = process.communicate(timeout=60 * SLOWDOWN)[1]
    test.assertEqual(process.returncode, 130, errors)
    return errors


class EveryCommand(CliTest):
    def setUp(self):
        super().setUp()
        for seed in (1, 2):
            self.write(f"{seed}.exr", film(seed=seed, groups=4))

    def catches_signals(self, process):
        status = Path(f"/proc/{process.pid}/status").read_text()
        return int(re.search(r"SigCgt:\s*(\w+)", status)[1], 16) >> (signal.SIGINT - 1) & 1

    def test_ends(self):
        for command in COMMANDS:
            with self.subTest(command[0]):
                pipe = self.path / next(word for word in command if word.startswith("pipe."))
                os.mkfifo(pipe)
                process = subprocess.Popen([COVARY, *command], cwd=self.path, stdout=subprocess.DEVNULL,
                                           stderr=subprocess.PIPE, text=True)
                errors = interrupted_when(self, process, lambda process=process: self.catches_signals(process))
                self.assertIn("covary: interrupted", errors)
                pipe.unlink()


class WhileDenoising(CliTest):
    """The denoiser's library cannot be stopped inside of a step: it is left behind."""

    def test_ends_at_once(self):
        room = str(Path(os.environ["SCENES"]) / "room.xml")
        small = ("--resolution", "24x16", "--spp", "24", "--quiet", "--no-preview")
        library = os.environ["STAND_IN_DENOISER"]
        surrogate = ("--integrator", "controlled-path", "--set", "cv-variance=relative-oidn", "--oidn", library)
        cases = (("render", room, *small, "-o", "a.exr", "--denoise", "error", "--oidn", library),
                 ("render", room, *small, "-o", "b.exr", *surrogate))
        for command in cases:
            with self.subTest(" ".join(command[-4:])):
                begins = self.path / "begins"
                process = subprocess.Popen([COVARY, *command], cwd=self.path, stdout=subprocess.DEVNULL,
                                           stderr=subprocess.PIPE, text=True,
                                           env={**os.environ, "STAND_IN_BEGINS": str(begins)})
                self.assertIn("interrupted", interrupted_when(self, process, begins.exists))
                begins.unlink()


def interrupted_in(test, phase, *command):
    """What a terminal shows after Ctrl-C in a phase of a command, which ends with exit code 130."""
    pid, shown = terminal.start(test, command, test.path)
    text = b""
    while phase not in text:
        text += os.read(shown, 4096)
    os.kill(pid, signal.SIGINT)
    rest, exit_code = terminal.finish(pid, shown)
    test.assertEqual(exit_code, 130, rest)
    return rest


class DuringAuxiliaryImages(CliTest):
    """They come after the first samples, so that there is a picture."""

    def test_a_picture_is_left(self):
        room = str(Path(os.environ["SCENES"]) / "room.xml")
        rest = interrupted_in(self, b"auxiliary images", COVARY, "render", room, "--resolution", "480x320", "--spp",
                              "16", "--oidn", "off", "--no-preview", "-o", "a.exr")
        self.assertIn("'a.exr' is the image so far", rest)
        values = read_exr((self.path / "a.exr").read_bytes())
        self.assertGreater(sum(values["G"]), 0)


class DuringTraining(CliTest):
    """It has no samples of the picture; that is told, with the phase."""

    def test_nothing_is_left(self):
        room = str(Path(os.environ["SCENES"]) / "room.xml")
        for integrator in ("guided-path", "controlled-path"):
            rest = interrupted_in(self, b"training", COVARY, "render", room, "--resolution", "480x320", "--spp", "64",
                                  "--integrator", integrator, "-o", "a.exr")
            self.assertIn("interrupted during training, before the first sample of the picture; nothing was written",
                          rest)
            self.assertEqual(list(self.path.iterdir()), [])


class AtRandomTimes(CliTest):
    """Ctrl-C at any moment of a render: exit code 130, and a picture if there is a sample."""

    def test_render(self):
        command = [COVARY, "render", str(Path(os.environ["SCENES"]) / "room.xml"), "--resolution", "64x48", "--spp",
                   "24", "--denoise", "auto", "--oidn", os.environ["STAND_IN_DENOISER"], "--no-preview", "--overwrite"]
        begin = time.monotonic()
        self.assertEqual(self.run_covary(*command[1:], "-o", "whole.exr").returncode, 0)
        seconds = time.monotonic() - begin
        chance = random.Random(1)
        pictures = 0
        for i in range(12):
            process = subprocess.Popen([*command, "-o", f"{i}.exr"], cwd=self.path, stderr=subprocess.PIPE, text=True)
            time.sleep(seconds * chance.random())
            process.send_signal(signal.SIGINT)
            message = process.communicate(timeout=60 * SLOWDOWN)[1]
            picture = self.path / f"{i}.exr"
            # 0: it had ended; -SIGINT, for shells 130, too: it had not begun.
            self.assertIn(process.returncode, (0, 130, -signal.SIGINT), message)
            has_picture = "is the image so far" in message or "' was written" in message
            if process.returncode == 0 or has_picture:
                pictures += 1
                values = read_exr(picture.read_bytes())
                self.assertTrue(all(math.isfinite(v) for c in "RGB" for v in values[c]))
                self.assertGreater(sum(values["G"]), 0)
            else:
                self.assertTrue("interrupted" in message or process.returncode == -signal.SIGINT, message)
                self.assertFalse(picture.exists(), message)
        self.assertGreater(pictures, 0)


if __name__ == "__main__":
    unittest.main()
