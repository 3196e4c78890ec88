# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends every command. Each is made to wait at a pipe that nobody serves, so that nothing else can end it."""
import os
import re
import signal
import subprocess
import time
import unittest
from pathlib import Path

from cli_test import COVARY, SLOWDOWN, CliTest
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
        surrogate = ("--integrator", "controlled-path", "--cv-surrogate", "oidn", "--oidn", library)
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


if __name__ == "__main__":
    unittest.main()
