# SPDX-License-Identifier: Apache-2.0
"""`covary render --integrator guided-path`: its options, what it reports, and films that belong together."""
import json
import math
import os
import re
import struct
import unittest
from pathlib import Path

from cli_test import CliTest
from exr_reader import read_exr
from training_tests import LearningFiles, LearningFilms

ROOM = str(Path(os.environ["SCENES"]) / "room.xml")
RENDER = ("render", ROOM, "--resolution", "48x32", "--no-preview", "--integrator", "guided-path", "--set",
          "guiding-train=4")
PLAIN = (*RENDER, "--estimator", "none")


class Options(CliTest):
    def test_refuses_options_of_another_integrator(self):
        self.bad(2, "--set nee is an option of --integrator guided-path, not of path", "render", ROOM, "-o", "a.exr",
                 "--set", "nee=off")
        self.bad(2, "--integrator controlled-path, not of guided-path", *PLAIN, "-o", "a.exr", "--set", "cv-grid=8")

    def test_control_variates(self):
        self.bad(2, "--set cv 'vevoda': expected rgb, mono, off", *PLAIN, "-o", "a.exr", "--set", "cv=vevoda")
        self.good(*PLAIN, "--set", "cv=rgb", "--set", "cv-train=8", "--spp", "20", "-o", "a.exr", "--json", "a.json")
        report = json.loads((self.path / "a.json").read_text())
        self.assertEqual((report["samples_per_pixel"], report["training_samples_per_pixel"]), (8, 12))
        self.assertGreaterEqual(report["guiding"]["controlled_leaves"], 1)

    def test_warns_of_lights_that_it_cannot_see(self):
        point = '<emitter type="point"><point name="position" x="0" y="1" z="0"/></emitter></scene>'
        (self.path / "point.xml").write_text(Path(ROOM).read_text().replace("</scene>", point))
        render = ("render", "point.xml", *PLAIN[2:], "--spp", "5", "-o", "a.exr")
        self.assertNotIn("not seen", self.good(*render).stderr)
        self.assertIn("without NEE (--set nee=off), point, directional and hidden lights are invisible: 1 of ",
                      self.good(*render, "--set", "nee=off").stderr)

    def test_refuses_impossible_numbers(self):
        for parameter in ("guiding-leaf=199", "guiding-train=0", "nee=1"):
            self.bad(2, "--set " + parameter.split("=")[0], *PLAIN, "-o", "a.exr", "--set", parameter)

    def test_refuses_more_training_than_samples(self):
        self.bad(2, "4 samples per pixel, of which the training takes 4, leave none for the image", *PLAIN, "-o",
                 "a.exr", "--spp", "4")

    def test_reports_what_it_learnt(self):
        self.good(*PLAIN, "--spp", "12", "-o", "a.exr", "--json", "a.json")
        report = json.loads((self.path / "a.json").read_text())
        self.assertEqual((report["samples_per_pixel"], report["training_samples_per_pixel"]), (8, 4))
        guiding = report["guiding"]
        self.assertGreaterEqual(guiding["leaves"], 1)
        self.assertGreater(guiding["lobes"], guiding["leaves"])
        self.assertGreater(guiding["samples"], 48 * 32 * 4)
        self.assertEqual(guiding["samples_left_out"], 0)
        self.assertGreater(guiding["fit_seconds_per_million_samples"], 0)
        self.assertLess(guiding["memory_bytes"], 2048 * guiding["leaves"] + 4096)
        self.assertGreater(report["seconds"]["train"], 0)

    def test_settings_of_a_scene(self):
        scene = Path(ROOM).read_text()
        scene = re.sub(r'<integrator type="path">', '<integrator type="guided-path"><integer name="guiding_leaf" '
                       'value="4000"/><boolean name="nee" value="false"/>', scene, count=1)
        (self.path / "guided.xml").write_text(scene)
        self.good("render", "guided.xml", "--resolution", "24x16", "--no-preview", "--estimator", "none", "--spp", "20",
                  "--set", "guiding-train=16", "-o", "a.exr")
        settings = json.loads(self.good("info", "a.exr", "--json").stdout)["attributes"]["covary:settings"]
        self.assertIn("leaf=4000 train=16", settings)
        self.assertIn("nee=off", settings)


class Guided:
    RENDER, PLAIN, OTHER_SETTING = RENDER, PLAIN, ("--set", "guiding-leaf=900")


class Films(Guided, LearningFilms, CliTest):
    def test_crops_and_times(self):
        self.good(*PLAIN, "--crop", "8,8,16,16", "--spp", "6", "-o", "crop.exr")
        self.good(*PLAIN, "--time", "0.5", "-o", "timed.exr", "--json", "timed.json")
        report = json.loads((self.path / "timed.json").read_text())
        self.assertGreater(report["samples_per_pixel"], 0)
        self.assertEqual(report["training_samples_per_pixel"], 4)


class Probe(CliTest):
    PROBE = ("probe", *RENDER[1:4], "--set", "guiding-train=4", "-o", "a.exr")

    def test_density_integrates_to_one(self):
        self.good(*self.PROBE, "--pixel", "4,4", "--samples", "2", "--set", "cv=rgb", "--set", "cv-train=12")
        channels, height = read_exr((self.path / "a.exr").read_bytes()), 64
        width, sums = 2 * height, [0, 0, 0]
        for y in range(height):
            area = 2 * math.pi / width * (math.cos(math.pi * y / height) - math.cos(math.pi * (y + 1) / height))
            for part in range(3):
                row = channels["R"][(3 * y + part) * width:(3 * y + part + 1) * width]
                sums[part] += area * sum(row)
        self.assertGreater(sums[0], 0.01)
        self.assertAlmostEqual(sums[1], 1, delta=0.05)
        preview = (self.path / "a.png").read_bytes()
        self.assertEqual(preview[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", preview[16:24]), (3 * width, height))
        self.assertNotEqual(sums[2], 0)

    def test_uses_a_training(self):
        self.good(*PLAIN, "--spp", "8", "-o", "b.exr", "--save-training", "a.training")
        self.good(*self.PROBE, "--pixel", "24,28", "--samples", "1", "--load-training", "a.training", "--height", "8")

    def test_refuses_options_of_images(self):
        listed = self.good("probe", "--help-all").stdout
        completed = self.good("help", "--completion", "bash").stdout
        for option in (("--spp", "8"), ("--time", "1"), ("--until", "relmse=1"), ("--estimator", "none"), ("--aovs",),
                       ("--sampler", "sobol"), ("--denoise", "error"), ("--passes", "x"), ("--resume",),
                       ("--json", "-"), ("--replay", "1,2,3"), ("--oidn", "off"), ("--checkpoint", "4")):
            self.bad(2, option[0] + " has no effect on probes", *self.PROBE, "--pixel", "4,4", *option)
            self.assertNotIn(option[0] + " ", listed)
            self.assertNotIn(f"'probe {option[0]}'", completed)
        self.bad(2, "--set k has no effect on probes", *self.PROBE, "--pixel", "4,4", "--set", "k=7")
        self.assertIn("'probe --seed'", completed)
        for option in ("--seed", "--crop", "--set", "--load-training", "--pixel"):
            self.assertRegex(listed, option + "[ ,]")

    def test_refuses_what_it_cannot_show(self):
        self.bad(2, "--pixel '48,0' is outside the 48 x 32 frame", *self.PROBE, "--pixel", "48,0")
        self.bad(2, "probe shows what guided-path has learnt, not path", "probe", *RENDER[1:4], "--integrator", "path",
                 "--pixel", "1,1", "-o", "a.exr")
        self.bad(2, "no output given", "probe", ROOM, "--pixel", "1,1")


class TrainingFiles(Guided, LearningFiles, CliTest):
    def test_belong_to_an_integrator(self):
        wanted = (*self.WANTED, "a.training")
        self.bad(1, "a.training", "render", ROOM, "--resolution", "48x32", "--integrator", "controlled-path", *wanted)
        self.bad(2, "only the integrator controlled-path with control variates and guided-path", "render", ROOM,
                 "--integrator", "path", *wanted)


if __name__ == "__main__":
    unittest.main()
