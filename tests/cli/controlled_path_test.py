# SPDX-License-Identifier: Apache-2.0
"""`covary render --integrator controlled-path`: its options, what it reports, and films that belong together."""
import json
import os
import re
import shutil
import subprocess
import unittest
from pathlib import Path

from cli_test import COVARY, CliTest
from exr_reader import read_exr
from training_tests import LearningFiles, LearningFilms, LearningTest

ROOM = str(Path(os.environ["SCENES"]) / "room.xml")
RENDER = ("render", ROOM, "--resolution", "48x32", "--no-preview", "--integrator", "controlled-path")
PLAIN = (*RENDER, "--estimator", "none", "--set", "cv-train=4")


class Options(CliTest):
    def test_refuses_options_of_another_integrator(self):
        self.bad(2, "--set cv is an option of --integrator controlled-path, guided-path, not of path", "render", ROOM,
                 "-o", "a.exr", "--set", "cv=off")
        self.bad(2, "--set lights is an option of --integrator controlled-path, not of bdpt", "render", ROOM, "-o",
                 "a.exr", "--integrator", "bdpt", "--set", "lights=power")

    def test_refuses_grids_of_no_cells(self):
        for grid in ("-1", "half", "65537"):
            self.bad(2, f"--set cv-grid: '{grid}': expected auto or a whole number from 0 to 65536", *RENDER, "-o",
                     "a.exr", "--set", "cv-grid=" + grid)

    def test_refuses_options_without_effect(self):
        for name, value, other in (("cv-grid", "8", "cv=off"), ("cv-variance", "absolute", "cv=optimal-mis"),
                                   ("lights", "learned", "cv-train=4")):
            self.bad(2, f"--set {name} has no effect with --set {other}: ", *RENDER, "-o", "a.exr", "--set",
                     f"{name}={value}", "--set", other)
        self.good(*RENDER, "--estimator", "none", "--spp", "20", "-o", "a.exr", "--set", "cv=off",
                  "--set", "lights=learned", "--set", "cv-train=8")

    def test_refuses_more_training_than_samples(self):
        self.bad(2, "16 samples per pixel, of which the training takes 16, leave none for the image", *RENDER, "-o",
                 "a.exr", "--spp", "16")

    def test_counts_training_as_samples_and_reports_it(self):
        self.good(*PLAIN, "--spp", "12", "-o", "a.exr", "--json", "a.json")
        report = json.loads((self.path / "a.json").read_text())
        self.assertEqual((report["samples_per_pixel"], report["training_samples_per_pixel"]), (8, 4))
        self.assertGreater(report["control_variates"]["cells"], 10)
        seconds = report["seconds"]
        self.assertGreater(min(seconds["surrogate"], seconds["solve"]), 0)
        self.assertLess(seconds["surrogate"] + seconds["solve"], seconds["train"])
        self.assertGreater(report["planned_memory_bytes"], 3 * 256 << 20)
        self.good(*RENDER, "--set", "cv=off", "--estimator", "none", "--spp", "12", "-o", "b.exr", "--json", "b.json")
        report = json.loads((self.path / "b.json").read_text())
        self.assertEqual((report["samples_per_pixel"], report["training_samples_per_pixel"]), (12, 0))
        self.assertNotIn("control_variates", report)
        self.assertLess(report["planned_memory_bytes"], 1 << 20)


class Controlled:
    RENDER, PLAIN, OTHER_SETTING = (*RENDER, "--set", "cv-train=4"), PLAIN, ("--set", "cv-grid=7")


class Films(Controlled, LearningFilms, CliTest):
    def test_the_image_holds_the_samples_of_training_too(self):
        self.good(*PLAIN, "--spp", "6", "-o", "a.exr", "--cv-paper", "--json", "a.json")
        report = json.loads((self.path / "a.json").read_text())
        self.assertEqual(report["training_counts_as_samples"], 4)
        self.good(*PLAIN, "--spp", "6", "-o", "b.exr", "--passes", "films", "--cv-paper")
        both, film = self.pixels("a.exr"), self.pixels("films/independent.exr")
        self.assertEqual(both["R"], self.pixels("b.exr")["R"])
        self.assertEqual(both["group00.R"], film["R"])
        self.assertNotEqual(both["R"], film["R"])
        self.good(*PLAIN, "--spp", "8", "-o", "crn.exr", "--sampling", "crn")
        self.assertNotIn("covary:shown", json.loads(self.good("info", "crn.exr", "--json").stdout)["attributes"])

    def test_films_of_different_training_can_be_merged_and_not_continued(self):
        for seed in "12":
            self.good(*PLAIN, "--spp", "8", "-o", seed + ".exr", "--seed", seed)
        self.good("merge", "1.exr", "2.exr", "-o", "both.exr")
        one, two, both = (self.pixels(name) for name in ("1.exr", "2.exr", "both.exr"))
        self.assertAlmostEqual(both["R"][700], (one["group00.R"][700] + two["group00.R"][700]) / 2, delta=1e-6)
        (self.path / "2.exr").write_bytes((self.path / "1.exr").read_bytes())
        self.good(*PLAIN, "--spp", "12", "-o", "2.exr", "--seed", "1", "--resume")
        self.bad(1, "seed", *PLAIN, "--spp", "12", "-o", "1.exr", "--seed", "2", "--resume")


class Surrogate(LearningTest, CliTest):
    def test_does_not_follow_from_what_is_installed(self):
        self.good(*PLAIN, "--spp", "6", "-o", "a.exr")
        self.good(*PLAIN, "--spp", "6", "-o", "b.exr", "--set", "cv-variance=relative",
                  env={**os.environ, "COVARY_OIDN": "/nowhere"})
        self.assertEqual(self.pixels("a.exr")["R"], self.pixels("b.exr")["R"])
        attributes = json.loads(self.good("info", "a.exr", "--json").stdout)["attributes"]
        self.assertNotIn("oidn", attributes["covary:settings"])

    def test_by_a_denoiser_that_is_missing(self):
        result = self.run_covary(*PLAIN, "--spp", "6", "-o", "a.exr", "--passes", "films", "--set",
                                 "cv-variance=relative-oidn", env={**os.environ, "COVARY_OIDN": "/nowhere"})
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("Open Image Denoise was not found (/nowhere", result.stderr)
        self.assertFalse((self.path / "a.exr").exists())

    def test_library_that_pip_installed_beside_the_program(self):
        packages = self.path / "lib" / "python3.11" / "site-packages"
        program, library = packages / "covary" / "bin" / "covary", packages / "pyoidn" / "oidn" / "lib"
        for place, file in ((program, COVARY), (library / "libOpenImageDenoise.so.2", os.environ["STAND_IN_DENOISER"])):
            place.parent.mkdir(parents=True)
            shutil.copy(file, place)
        bare = {name: value for name, value in os.environ.items() if name != "COVARY_OIDN"}
        told = subprocess.run([program, "denoise", "--check"], env=bare, capture_output=True, text=True, check=True)
        self.assertIn(f"\n{library}/libOpenImageDenoise.so.2\n", told.stdout)

    def test_by_the_denoiser_that_is_named(self):
        """Another one that the machine has is not taken."""
        library = os.environ["STAND_IN_DENOISER"]
        by_oidn = (*PLAIN, "--spp", "6", "--set", "cv-variance=relative-oidn")
        nowhere = {**os.environ, "COVARY_OIDN": "/nowhere"}
        self.good(*PLAIN, "--spp", "6", "-o", "a.exr")
        self.good(*by_oidn, "-o", "b.exr", "--oidn", library, env=nowhere)
        self.assertNotEqual(self.pixels("a.exr")["R"], self.pixels("b.exr")["R"])
        self.good(*by_oidn, "-o", "c.exr", env={**os.environ, "COVARY_OIDN": library})
        self.assertEqual(self.pixels("b.exr")["R"], self.pixels("c.exr")["R"])
        replay = self.good(*by_oidn, "--oidn", library, "--replay", "7,5,0", env=nowhere).stdout
        self.assertNotEqual(replay, self.good(*PLAIN, "--spp", "6", "--replay", "7,5,0").stdout)
        self.bad(2, "Open Image Denoise was not found (/nowhere/lib.so", *by_oidn, "-o", "d.exr", "--oidn",
                 "/nowhere/lib.so")
        self.bad(2, "--set cv-variance=relative-oidn needs Open Image Denoise, which --oidn off leaves out", *by_oidn,
                 "-o", "d.exr", "--oidn", "off")
        self.bad(2, "--oidn has no effect without --denoise auto, bias, balanced or error, and no training with "
                 "--set cv-variance=relative-oidn", *PLAIN, "--spp", "6", "-o", "d.exr", "--oidn", library)

    def test_by_a_denoiser_that_is_there(self):
        if self.run_covary("denoise", "--check").returncode != 0:
            self.skipTest("Open Image Denoise is not installed")
        self.good(*PLAIN, "--spp", "6", "-o", "a.exr")
        self.good(*PLAIN, "--spp", "6", "-o", "b.exr", "--set", "cv-variance=relative-oidn")
        self.assertNotEqual(self.pixels("a.exr")["R"], self.pixels("b.exr")["R"])
        attributes = json.loads(self.good("info", "b.exr", "--json").stdout)["attributes"]
        self.assertIn("variance=relative-oidn", attributes["covary:settings"])
        self.bad(1, "variance=relative-oidn", *PLAIN, "--spp", "8", "-o", "b.exr", "--resume")


class PathLengths(CliTest):
    def test_add_up_to_the_film(self):
        self.good(*PLAIN, "--spp", "8", "--max-depth", "4", "--layers", "path-lengths", "-o", "a.exr")
        channels = read_exr((self.path / "a.exr").read_bytes())
        self.assertEqual(sorted(name for name in channels if name.startswith("Edges") and name.endswith("R")),
                         [f"Edges0{n}.R" for n in range(1, 5)])
        for name in "RGB":
            lengths = zip(*(channels[f"Edges0{n}.{name}"] for n in range(1, 5)))
            for whole, parts in zip(channels["group00." + name], lengths):
                self.assertAlmostEqual(whole, sum(parts), delta=1e-4 * (1 + sum(map(abs, parts))))
        for n in range(1, 5):
            self.assertGreater(max(map(abs, channels[f"Edges0{n}.G"])), 1e-3)

    def test_are_parts_of_what_shorter_paths_see(self):
        off = ("--set", "cv=off", "--spp", "4", "--estimator", "none")
        self.good(*RENDER, *off, "--max-depth", "4", "--layers", "path-lengths", "-o", "a.exr")
        text = Path(ROOM).read_text()
        (self.path / "direct.xml").write_text(re.sub("(<integrator[^>]*>)", r'\1<integer name="min_depth" value="2"/>',
                                                     text))
        self.good("render", "direct.xml", *RENDER[2:], *off, "--max-depth", "2", "-o", "b.exr")
        parts = (read_exr((self.path / name).read_bytes()) for name in ("a.exr", "b.exr"))
        for a, b in zip(*(channels[name] for channels, name in zip(parts, ("Edges02.G", "G")))):
            self.assertAlmostEqual(a, b, delta=1e-5 * (1 + b))

    def test_need_the_integrator(self):
        self.bad(2, "--layers path-lengths is for --integrator controlled-path", "render", ROOM, "-o", "a.exr",
                 "--layers", "path-lengths")


class TrainingFiles(Controlled, LearningFiles, CliTest):
    def test_keep_the_learned_probabilities_of_lights(self):
        learned = (*RENDER, "--estimator", "none", "--set", "cv-train=8", "--set", "lights=learned")
        self.good(*learned, "--spp", "12", "-o", "l.exr", "--save-training", "l.training")
        self.good(*learned, "--spp", "4", "-o", "m.exr", "--load-training", "l.training")
        self.assertEqual(self.pixels("l.exr")["group00.G"], self.pixels("m.exr")["G"])

    def test_belong_to_control_variates(self):
        self.bad(2, "only the integrator controlled-path with control variates", *RENDER, "--set", "cv=off",
                 *self.WANTED, "a.training")


if __name__ == "__main__":
    unittest.main()
