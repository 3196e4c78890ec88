# SPDX-License-Identifier: Apache-2.0
"""`covary render --integrator controlled-path`: its options, what it reports, and films that belong together."""
import json
import os
import re
import unittest
from pathlib import Path

from cli_test import CliTest
from exr_reader import read_exr

ROOM = str(Path(os.environ["SCENES"]) / "room.xml")
RENDER = ("render", ROOM, "--resolution", "48x32", "--no-preview", "--integrator", "controlled-path")
PLAIN = (*RENDER, "--estimator", "none", "--cv-train", "4")


class Options(CliTest):
    def test_refuses_options_of_another_integrator(self):
        self.bad(2, "--cv is an option of --integrator controlled-path, not of path", "render", ROOM, "-o", "a.exr",
                 "--cv", "off")
        self.bad(2, "--lights is an option of --integrator controlled-path, not of bdpt", "render", ROOM, "-o",
                 "a.exr", "--integrator", "bdpt", "--lights", "power")

    def test_refuses_grids_of_no_cells(self):
        for grid in ("0", "-1", "half", "65537"):
            self.bad(2, f"--cv-grid '{grid}': expected auto or a whole number from 1 to 65536", *RENDER, "-o", "a.exr",
                     "--cv-grid=" + grid)

    def test_refuses_more_training_than_samples(self):
        self.bad(2, "16 samples per pixel, of which the training takes 16, leave none for the image", *RENDER, "-o",
                 "a.exr", "--spp", "16")

    def test_counts_training_as_samples_and_reports_it(self):
        self.good(*PLAIN, "--spp", "12", "-o", "a.exr", "--json", "a.json")
        report = json.loads((self.path / "a.json").read_text())
        self.assertEqual((report["samples_per_pixel"], report["training_samples_per_pixel"]), (8, 4))
        self.assertGreater(report["control_variates"]["cells"], 10)
        self.assertGreater(report["seconds"]["train"], 0)
        self.assertGreater(report["planned_memory_bytes"], 256 << 20)
        self.good(*RENDER, "--cv", "off", "--estimator", "none", "--spp", "12", "-o", "b.exr", "--json", "b.json")
        report = json.loads((self.path / "b.json").read_text())
        self.assertEqual((report["samples_per_pixel"], report["training_samples_per_pixel"]), (12, 0))
        self.assertNotIn("control_variates", report)
        self.assertLess(report["planned_memory_bytes"], 1 << 20)

    def test_warns_of_cells_that_grew(self):
        result = self.good(*PLAIN, "--spp", "6", "-o", "a.exr", "--cv-grid", "4096", "--cv-memory", "1")
        self.assertRegex(result.stderr, r"warning: 1 MiB .*--cv-memory.* were reached; cells are \d+ times as wide")


class Films(CliTest):
    def pixels(self, name):
        return read_exr((self.path / name).read_bytes())

    def test_resumed_films_have_the_bits_of_whole_ones(self):
        self.good(*PLAIN, "--spp", "12", "-o", "whole.exr")
        self.good(*PLAIN, "--spp", "8", "-o", "parts.exr")
        self.good(*PLAIN, "--spp", "12", "-o", "parts.exr", "--resume")
        self.assertEqual(self.pixels("whole.exr"), self.pixels("parts.exr"))

    def test_other_settings_are_other_films(self):
        self.good(*PLAIN, "--spp", "8", "-o", "a.exr")
        self.bad(1, "a.exr", *PLAIN, "--cv-grid", "7", "--spp", "12", "-o", "a.exr", "--resume")

    def test_both_passes_share_one_training(self):
        self.good(*RENDER, "--cv-train", "4", "--spp", "20", "-o", "a.exr", "--passes", "films", "--threads", "1")
        self.good(*RENDER, "--cv-train", "4", "--spp", "20", "-o", "b.exr")
        self.assertEqual(self.pixels("a.exr"), self.pixels("b.exr"))
        attributes = [json.loads(self.good("info", "films/" + film.name, "--json").stdout)["attributes"]
                      for film in (self.path / "films").glob("*.exr")]
        settings = {attribute["covary:settings"] for attribute in attributes}
        self.assertEqual(len({text.split(";")[0] for text in settings}), 1)
        self.assertIn("training=", settings.pop())

    def test_replays_samples_of_the_same_training(self):
        self.good(*PLAIN, "--spp", "5", "-o", "a.exr")
        radiance = re.search(r"radiance \((.*), (.*), (.*)\)", self.good(*PLAIN, "--replay", "20,10,0").stdout)
        channels = self.pixels("a.exr")
        for value, name in zip(radiance.groups(), "RGB"):
            self.assertAlmostEqual(float(value), channels[name][10 * 48 + 20], delta=1e-6)


class TrainingFiles(CliTest):
    def setUp(self):
        super().setUp()
        self.good(*PLAIN, "--spp", "8", "-o", "a.exr", "--save-training", "a.training")

    def test_take_the_place_of_a_training(self):
        self.good(*PLAIN, "--spp", "4", "-o", "b.exr", "--load-training", "a.training", "--json", "b.json")
        self.assertEqual(read_exr((self.path / "a.exr").read_bytes()), read_exr((self.path / "b.exr").read_bytes()))
        report = json.loads((self.path / "b.json").read_text())
        self.assertEqual((report["samples_per_pixel"], report["training_samples_per_pixel"]), (4, 0))

    def test_belong_to_scene_and_settings(self):
        wanted = ("--spp", "4", "-o", "b.exr", "--load-training", "a.training")
        self.bad(1, "a.training", *PLAIN, "--cv-grid", "9", *wanted)
        other = str(Path(os.environ["SCENES"]) / "materials.xml")
        self.bad(1, "a.training", "render", other, *PLAIN[2:], *wanted)
        self.bad(2, "only the integrator controlled-path with control variates", *RENDER, "--cv", "off", *wanted)

    def test_that_are_damaged_are_refused(self):
        whole = (self.path / "a.training").read_bytes()
        for name, content in (("half", whole[:len(whole) // 2]), ("none", b""), ("longer", whole + b"x")):
            (self.path / name).write_bytes(content)
            self.bad(1, name, *PLAIN, "--spp", "4", "-o", "b.exr", "--load-training", name)
        self.bad(1, "cannot read the training file 'missing'", *PLAIN, "--spp", "4", "-o", "b.exr", "--load-training",
                 "missing")


if __name__ == "__main__":
    unittest.main()
