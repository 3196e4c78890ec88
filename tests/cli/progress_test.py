# SPDX-License-Identifier: Apache-2.0
"""The line of progress, as a terminal shows it: what is done, how far it is, and nothing that stays."""
import os
import re
import sys
import unittest
from pathlib import Path

from cli_test import COVARY, CliTest

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
import terminal  # noqa: E402

ROOM = str(Path(os.environ["SCENES"]) / "room.xml")
RENDER = ("render", ROOM, "--resolution", "64x48", "--no-preview")


class Progress(CliTest):
    def shown(self, *arguments, columns=80):
        """What the command writes to a terminal so wide; it must succeed."""
        text, exit_code = terminal.finish(*terminal.start(self, (COVARY, *arguments), self.path, columns))
        self.assertEqual(exit_code, 0, text)
        return text

    def in_order(self, text, *parts):
        at = 0
        for part in parts:
            self.assertIn(part, text[at:])
            at = text.index(part, at) + len(part)

    def test_every_phase_is_shown_and_none_stays(self):
        text = self.shown(*RENDER, "--spp", "8", "-o", "a.exr")
        self.in_order(text, "room: loading", "room: rendering", "room: estimating", "room: writing", "\r\033[K",
                      "a.exr: ")
        self.assertNotIn("training", text)
        self.assertNotIn("room: ", text[text.index("a.exr: "):])
        text = self.shown(*RENDER, "--spp", "8", "--denoise", "balanced", "--integrator", "guided-path",
                          "--guiding-train", "4", "-o", "b.exr")
        self.in_order(text, "loading", "training", "rendering", "estimating and denoising", "writing")
        self.good(*RENDER, "--estimator", "iicv", "--spp", "8", "-o", "c.exr", "--passes", "films")
        text = self.shown("combine", "--crn", "films/crn.exr", "--independent", "films/independent.exr", "-o", "d.exr")
        self.in_order(text, "d: loading", "d: estimating", "d: writing", "d.exr: ")

    def test_the_error_that_is_reached_is_shown_with_its_bounds(self):
        text = self.shown(*RENDER, "--estimator", "iicv", "--until", "relmse=0.0015", "-o", "a.exr", columns=120)
        self.in_order(text, "estimating", "rendering  relMSE ", ", goal 0.0015", "estimating", "writing")
        known = r"  relMSE ([0-9.e-]+) \((?:([0-9.e-]+) to ([0-9.e-]+)|unreliable)\), goal 0.0015"
        reached = [float(x) for x, _, _ in re.findall(known, text)]
        self.assertGreater(reached[0], 0.0015)
        self.assertLessEqual(reached[-1], 0.0015)
        bounds = [tuple(map(float, found)) for found in re.findall(known, text) if found[1]]
        self.assertTrue(bounds, text)
        self.assertTrue(all(low < middle < high for middle, low, high in bounds), bounds)
        self.assertRegex(text, r"\d %  \d+:\d\d left  relMSE ")
        text = self.shown(*RENDER, "--estimator", "iicv", "--spp", "48", "-o", "b.exr", columns=120)
        self.assertRegex(text, r"writing  relMSE [0-9.e-]+ \([^)]+\)(?!, goal)")

    def test_the_line_fits_the_terminal(self):
        text = self.shown(*RENDER, "--spp", "96", "-o", "a.exr", columns=30)
        lines = [line.replace("\033[K", "") for line in text[:text.index("a.exr: ")].split("\r")]
        self.assertGreater(len(lines), 3)
        self.assertLess(max(map(len, lines)), 30, lines)

    def test_silence(self):
        self.assertEqual(self.shown(*RENDER, "--spp", "8", "-o", "a.exr", "--quiet"), "")
        done = self.good(*RENDER, "--spp", "8", "-o", "b.exr")
        self.assertNotRegex(done.stderr, "\r|loading|rendering|writing")


if __name__ == "__main__":
    unittest.main()
