# SPDX-License-Identifier: Apache-2.0
"""covary render --estimator dependent-tests and --estimator none --adaptive, as a user runs them."""
import json
import signal
import subprocess
import unittest

from cli_test import COVARY
from exr_reader import read_exr
from render_test import ROOM, SMALL, RenderTest

METHOD = ("--estimator", "dependent-tests")
STAGES = ("dependent", "independent", "filtered", "combined", "samples", "region", "centre_weight", "bound")


class DependentTests(RenderTest):
    def test_passes_and_statistics(self):
        facts = self.statistics("-o", "a.exr", *METHOD, "--spp", "48")
        self.assertEqual(facts["estimator"], "dependent-tests")
        self.assertEqual([p["sampling"] for p in facts["passes"]], ["crn", "independent"])
        self.assertEqual(facts["passes"][0]["samples_per_pixel"], 24)
        self.assertAlmostEqual(facts["samples_per_pixel"], 48, delta=0.5)
        info = json.loads(self.good("info", "a.exr", "--json").stdout)
        self.assertEqual(info["attributes"]["covary:estimator"], "dependent-tests")
        self.assertFalse(list(self.path.glob("*.passes")), "passes are not left behind")

    def test_less_error_than_plain_and_than_published(self):
        self.good("render", ROOM, *SMALL, "-o", "r.exr", "--estimator", "none", "--spp", "768", "--seed", "9")
        errors = {}
        for name, options in (("plain", ("--estimator", "none")), ("paper", (*METHOD, "--paper")), ("exact", METHOD)):
            self.good("render", ROOM, *SMALL, "-o", f"{name}.exr", *options, "--spp", "48", "--seed", "3")
            errors[name] = self.relmse(f"{name}.exr", "r.exr")
        self.assertLess(errors["exact"], 0.7 * errors["plain"])
        self.assertLess(errors["exact"], errors["paper"])

    def test_combine_of_kept_films_gives_the_same_bits(self):
        for options in ((), ("--paper", "--set", "max-region=3")):
            self.good("render", ROOM, *SMALL, "-o", "a.exr", *METHOD, *options, "--spp", "32", "--passes", "films",
                      "--overwrite")
            self.good("combine", "--crn", "films/crn.exr", "--independent", "films/independent.exr", "-o", "b.exr",
                      *METHOD, *options, "--quiet")
            self.same("a.exr", "b.exr")
            self.good("combine", "--crn", "films/crn.exr", "--independent", "films/independent.exr", "-o", "c.exr",
                      *METHOD, *options, "--quiet", "--memory", "0.2")
            self.same("a.exr", "c.exr")

    def test_stages(self):
        self.good("render", ROOM, *SMALL, "-o", "a.exr", *METHOD, "--spp", "24", "--save-stages", "steps", "--passes",
                  "films")
        self.assertEqual(sorted(p.name for p in (self.path / "steps").iterdir()),
                         sorted(f"{name}.{end}" for name in STAGES for end in ("exr", "png")))
        self.same("steps/combined.exr", "a.exr")
        samples = read_exr((self.path / "steps/samples.exr").read_bytes())["Y"]
        self.assertAlmostEqual(sum(samples) / len(samples), 12, delta=0.12)
        self.good("combine", "--crn", "films/crn.exr", "--independent", "films/independent.exr", "-o", "b.exr",
                  *METHOD, "--quiet", "--save-stages", "again")
        self.same("again/filtered.exr", "steps/filtered.exr")

    def test_stages_of_an_image_that_missed_its_target(self):
        result = self.run_covary("render", ROOM, *SMALL, "-o", "a.exr", *METHOD, "--until", "relative=1e-9",
                                 "--set", "max-spp=24", "--save-stages", "steps")
        self.assertEqual(result.returncode, 3, result.stderr)
        self.assertEqual(sorted(p.name for p in (self.path / "steps").iterdir()),
                         sorted(f"{name}.{end}" for name in STAGES for end in ("exr", "png")))
        self.same("steps/combined.exr", "a.exr")

    def test_interrupted_and_resumed(self):
        arguments = ("render", ROOM, "--resolution", "160x120", "--quiet", "--no-preview", *METHOD, "--spp", "64",
                     "--seed", "4")
        self.good(*arguments, "-o", "whole.exr")
        process = subprocess.Popen([COVARY, *arguments, "-o", "a.exr", "--checkpoint", "0.05"], cwd=self.path,
                                   stderr=subprocess.DEVNULL)
        try:
            process.wait(timeout=0.7)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
        process.wait()
        self.good(*arguments, "-o", "a.exr", "--resume")
        self.same("a.exr", "whole.exr")

    def test_relative_error_and_time(self):
        coarse = self.statistics("-o", "a.exr", *METHOD, "--until", "relative=1")
        fine = self.statistics("-o", "a.exr", *METHOD, "--until", "relative=0.5")
        self.assertGreater(fine["samples_per_pixel"], coarse["samples_per_pixel"])
        timed = self.statistics("-o", "a.exr", *METHOD, "--time", "0.3")
        self.assertTrue(timed["complete"] or timed["samples_per_pixel"] > 1)

    def test_a_relative_error_that_is_not_reached_ends_like_until(self):
        for method in (METHOD, ("--estimator", "iicv", "--adaptive"), ("--estimator", "none", "--adaptive")):
            for limit in (("--spp", "48"), ("--set", "max-spp=24")):
                result = self.run_covary("render", ROOM, *SMALL, "-o", "a.exr", *method, "--until", "relative=1e-9",
                                         *limit)
                self.assertEqual(result.returncode, 3, result.stderr)
                self.assertIn("--until relative=1e-9 was not reached: 'a.exr' has ", result.stderr)
                (self.path / "a.exr").unlink()

    def test_wrong_options(self):
        render = ("render", ROOM, *SMALL, "-o", "a.exr", *METHOD)
        self.bad(2, "--split: the first pass of dependent-tests has its own number", *render, "--split", "1:2")
        self.bad(2, "does not estimate its error; use relative=X", *render, "--until", "relmse=0.1")
        self.bad(2, "expected relmse=X, relmse-p95=X or relative=X with X > 0", *render, "--until", "relative=0")
        self.bad(2, "expected a whole number from 1 to 63", *render, "--set", "max-region=0")
        self.bad(2, "--set dependent-spp: '0': expected a whole number of at least 1", *render,
                 "--set", "dependent-spp=0")
        self.bad(2, "20 samples per pixel are too few for dependent-tests: its first pass takes 20", *render, "--spp",
                 "20", "--set", "dependent-spp=20")
        self.bad(2, "--set k is an option of --estimator iicv, cv-baseline, not of dependent-tests", *render,
                 "--set", "k=3")
        self.bad(2, "--set max-region is an option of --estimator dependent-tests, not of mixture", "render", ROOM,
                 "-o", "a.exr", "--set", "max-region=3")
        self.bad(2, "--save-stages: iicv has no single steps", "render", ROOM, "-o", "a.exr", "--save-stages", "s",
                 "--estimator", "iicv")
        self.bad(2, "--save-stages: none has no single steps", "render", ROOM, "-o", "a.exr", "--save-stages", "s",
                 "--estimator", "none", "--adaptive")


class Adaptive(RenderTest):
    def test_an_unbiased_mean_of_the_last_pass(self):
        facts = self.statistics("-o", "a.exr", "--estimator", "none", "--adaptive", "--spp", "40", "--passes", "films")
        self.assertEqual(facts["passes"][0]["samples_per_pixel"], 20)
        self.assertEqual(sorted(p.name for p in (self.path / "films").glob("*.exr")),
                         ["independent.exr", "pilot-1.exr"])
        self.same("a.exr", "films/independent.exr")
        info = json.loads(self.good("info", "a.exr", "--json").stdout)
        self.assertEqual(info["attributes"]["covary:estimator"], "none --adaptive")

    def test_a_denoised_mean_has_both_passes(self):
        facts = self.statistics("-o", "a.exr", "--adaptive", "--oidn", "off", "--spp", "48", "--passes", "films")
        self.assertEqual(facts["estimator"], "mixture --adaptive --denoise auto --oidn off")
        self.assertEqual([p["samples_per_pixel"] for p in facts["passes"]], [12, 36])
        self.assertEqual(sorted(p.name for p in (self.path / "films").glob("*.exr")),
                         ["first-1.exr", "independent.exr"])
        self.statistics("-o", "b.exr", "--adaptive", "--oidn", "off", "--spp", "48", "--passes", "films", "--resume")
        self.same("a.exr", "b.exr")
        render = ("render", ROOM, *SMALL, "-o", "c.exr", "--adaptive")
        self.bad(2, "--until relative is for an image that is not denoised", *render, "--until", "relative=0.1")

    def test_until(self):
        first = self.statistics("-o", "a.exr", "--estimator", "none", "--adaptive", "--spp", "96")
        facts = self.statistics("-o", "b.exr", "--estimator", "none", "--adaptive", "--until",
                                f"relmse={0.6 * first['predicted_relmse']}")
        self.assertTrue(facts["until_reached"])

    def test_wrong_options(self):
        render = ("render", ROOM, *SMALL, "-o", "a.exr", "--estimator", "none")
        self.bad(2, "--set max-spp has no effect without --adaptive", *render, "--set", "max-spp=8")
        self.bad(2, "--adaptive always takes independent random numbers", *render, "--adaptive", "--sampling", "crn")
        self.bad(2, "--set max-spp is 1, expected at least 12, one sample for each group", "render", ROOM, *SMALL,
                 "-o", "a.exr", "--estimator", "iicv", "--adaptive", "--set", "max-spp=1", "--spp", "96")


if __name__ == "__main__":
    unittest.main()
