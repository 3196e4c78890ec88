# SPDX-License-Identifier: Apache-2.0
"""Where the numbers of samples come from: --sampler, the scene's element, and what files and messages say of it."""
import json
import os
import re
import unittest
from pathlib import Path

from cli_test import CliTest
from exr_reader import read_exr

ROOM = str(Path(os.environ["SCENES"]) / "room.xml")
SMALL = ("--resolution", "24x16", "--quiet", "--no-preview")
NONE = ("--estimator", "none")
SOBOL = ("--sampler", "sobol")


class Samplers(CliTest):
    def render(self, output, *arguments, scene=ROOM):
        return self.good("render", scene, "-o", output, *SMALL, *arguments)

    def pixels(self, name):
        channels = read_exr((self.path / name).read_bytes())
        return [channels[c] for c in "RGB"]

    def attributes(self, name):
        return json.loads(self.good("info", name, "--json").stdout)["attributes"]

    def scene(self, element):
        text = Path(ROOM).read_text()
        text = re.sub(r"<sampler.*?</sampler>", "", text, flags=re.S)
        (self.path / "scene.xml").write_text(text.replace("</sensor>", f"{element}</sensor>"))
        return "scene.xml"

    def test_films_and_statistics_name_the_sampler(self):
        for options, name in (((), "independent"), (SOBOL, "sobol")):
            self.render("a.exr", *NONE, "--spp", "4", *options, "--json", "facts.json")
            self.assertEqual(json.loads((self.path / "facts.json").read_text())["passes"][0]["sampler"], name)
            settings = self.attributes("a.exr")["covary:settings"]
            self.assertEqual("; sampler sobol" in settings, name == "sobol")

    def test_scenes_say_which_sampler(self):
        self.render("independent.exr", *NONE, "--spp", "4")
        self.render("sobol.exr", *NONE, "--spp", "4", *SOBOL)
        independent, sobol = self.pixels("independent.exr"), self.pixels("sobol.exr")
        self.assertNotEqual(independent, sobol)
        for name in ("", "independent", "sobol", "multijitter", "stratified", "orthogonal", "ldsampler", "halton"):
            scene = self.scene(f'<sampler type="{name}"/>' if name else "")
            is_independent = name in ("", "independent")
            warning = f"the scene's sampler '{name}' is rendered as 'sobol'"
            result = self.render("a.exr", *NONE, "--spp", "4", scene=scene)
            self.assertEqual(self.pixels("a.exr"), independent if is_independent else sobol, name)
            self.assertEqual(warning in result.stderr, not is_independent and name not in ("sobol", "ldsampler"),
                             result.stderr)
            for option, pixels in (("independent", independent), ("sobol", sobol)):
                result = self.render("a.exr", *NONE, "--spp", "4", "--sampler", option, scene=scene)
                self.assertEqual(self.pixels("a.exr"), pixels, f"{name}, {option}")
                self.assertEqual(result.stderr, "")

    def test_resumed_renders_equal_one_go(self):
        for method in (NONE, (*NONE, "--sampling", "crn", "--groups", "6"), ("--estimator", "iicv", "--groups", "6")):
            self.render("whole.exr", *method, *SOBOL, "--spp", "48")
            for spp in ("22", "48"):
                self.render("a.exr", *method, *SOBOL, "--spp", spp, "--passes", "films", "--resume")
            self.assertEqual(self.pixels("a.exr"), self.pixels("whole.exr"), method)
            for film in (self.path / "films").iterdir():
                film.unlink()

    def test_films_of_other_samplers_are_not_continued_or_merged(self):
        self.render("a.exr", *NONE, "--spp", "4")
        before = (self.path / "a.exr").read_bytes()
        self.bad(1, "sampler sobol", "render", ROOM, "-o", "a.exr", *SMALL, *NONE, "--spp", "8", "--resume", *SOBOL)
        self.assertEqual((self.path / "a.exr").read_bytes(), before)
        self.render("b.exr", *NONE, "--spp", "4", *SOBOL, "--seed", "2")
        self.bad(1, "settings differs", "merge", "a.exr", "b.exr", "-o", "c.exr")
        self.render("c.exr", *NONE, "--spp", "4", *SOBOL, "--seed", "3")
        self.good("merge", "b.exr", "c.exr", "-o", "d.exr")

    def test_samples_are_replayed_in_their_group(self):
        self.render("a.exr", *NONE, "--spp", "2", "--groups", "2", *SOBOL, "--seed", "4")
        replay = ("render", ROOM, "--resolution", "24x16", "--seed", "4", *NONE, *SOBOL, "--replay")
        sums = [0, 0, 0]
        for sample in range(2):
            printed = self.good(*replay, f"7,12,{sample}", "--groups", "2").stdout
            for c, value in enumerate(re.search(r"radiance \((.*)\)", printed).group(1).split(", ")):
                sums[c] += float(value) / 2
        for channel, value in zip(self.pixels("a.exr"), sums):
            self.assertAlmostEqual(channel[12 * 24 + 7], value, places=5)
        self.bad(2, "--groups says how many groups", *replay, "7,12,0")

    def test_mistakes(self):
        self.bad(2, "--sampler", "render", ROOM, "-o", "a.exr", *SMALL, "--sampler", "halton")


if __name__ == "__main__":
    unittest.main()
