# SPDX-License-Identifier: Apache-2.0
"""What holds of every integrator that learns before it renders. A test file derives its classes Films and TrainingFiles
from these and from CliTest; each says how it renders."""
import json
import re

from exr_reader import read_exr


class LearningTest:
    RENDER = ()  # a render of 48 x 32 pixels of the room, with 4 samples of training
    PLAIN = ()  # the same with --estimator none
    OTHER_SETTING = ()  # an option that teaches something else

    def pixels(self, name):
        return read_exr((self.path / name).read_bytes())


class LearningFilms(LearningTest):
    def test_resumed_films_have_the_bits_of_whole_ones(self):
        self.good(*self.PLAIN, "--spp", "12", "-o", "whole.exr")
        self.good(*self.PLAIN, "--spp", "8", "-o", "parts.exr")
        self.good(*self.PLAIN, "--spp", "12", "-o", "parts.exr", "--resume", "--threads", "1")
        self.assertEqual(self.pixels("whole.exr"), self.pixels("parts.exr"))

    def test_other_settings_are_other_films(self):
        self.good(*self.PLAIN, "--spp", "8", "-o", "a.exr")
        self.bad(1, "a.exr", *self.PLAIN, *self.OTHER_SETTING, "--spp", "12", "-o", "a.exr", "--resume")

    def test_both_passes_share_one_training(self):
        self.good(*self.RENDER, "--spp", "20", "-o", "a.exr", "--passes", "films", "--threads", "1")
        self.good(*self.RENDER, "--spp", "20", "-o", "b.exr")
        self.assertEqual(self.pixels("a.exr"), self.pixels("b.exr"))
        attributes = [json.loads(self.good("info", "films/" + film.name, "--json").stdout)["attributes"]
                      for film in (self.path / "films").glob("*.exr")]
        self.assertEqual(len({attribute["covary:settings"].split(";")[0] for attribute in attributes}), 1)
        self.assertEqual(len({attribute["covary:training"] for attribute in attributes}), 1)

    def test_replays_samples_of_the_same_training(self):
        self.good(*self.PLAIN, "--spp", "5", "-o", "a.exr", "--seed", "3")
        replay = self.good(*self.PLAIN, "--replay", "20,10,0", "--seed", "3").stdout
        channels = self.pixels("a.exr")
        for value, name in zip(re.search(r"radiance \((.*), (.*), (.*)\)", replay).groups(), "RGB"):
            self.assertAlmostEqual(float(value), channels["group00." + name][10 * 48 + 20], delta=1e-6)


class LearningFiles(LearningTest):
    WANTED = ("--spp", "4", "-o", "b.exr", "--load-training")

    def setUp(self):
        super().setUp()
        self.good(*self.PLAIN, "--spp", "8", "-o", "a.exr", "--save-training", "a.training")

    def test_take_the_place_of_a_training(self):
        self.good(*self.PLAIN, *self.WANTED, "a.training", "--json", "b.json")
        self.assertEqual(self.pixels("a.exr")["group00.R"], self.pixels("b.exr")["R"])
        report = json.loads((self.path / "b.json").read_text())
        self.assertEqual((report["samples_per_pixel"], report["training_samples_per_pixel"]), (4, 0))

    def test_belong_to_scene_and_settings(self):
        self.bad(1, "a.training", *self.PLAIN, *self.OTHER_SETTING, *self.WANTED, "a.training")
        other = self.PLAIN[1].replace("room.xml", "materials.xml")
        self.bad(1, "a.training", "render", other, *self.PLAIN[2:], *self.WANTED, "a.training")

    def test_that_are_damaged_are_refused(self):
        whole = (self.path / "a.training").read_bytes()
        for name, content in (("half", whole[:len(whole) // 2]), ("none", b""), ("longer", whole + b"x")):
            (self.path / name).write_bytes(content)
            self.bad(1, name, *self.PLAIN, *self.WANTED, name)
        self.bad(1, "cannot read the training file 'missing'", *self.PLAIN, *self.WANTED, "missing")
