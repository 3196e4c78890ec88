# SPDX-License-Identifier: Apache-2.0
"""Plans of passes and estimators: covary render with image-space control variates, as a user runs it."""
import json
import math
import os
import re
import shlex
import signal
import statistics
import subprocess
import time
import unittest
from pathlib import Path

from cli_test import COVARY, SLOWDOWN, CliTest
from exr_reader import header, read_exr

SCENES = Path(os.environ["SCENES"])
ROOM = str(SCENES / "room.xml")
SMALL = ("--resolution", "64x48", "--quiet", "--no-preview")
IICV = ("--estimator", "iicv")


class RenderTest(CliTest):
    def relmse(self, image, reference):
        return json.loads(self.good("compare", image, "--reference", reference, "--json", "-").stdout)["relmse"]

    def same(self, a, b):
        self.assertEqual(self.relmse(a, b), 0.0, f"{a} and {b} differ")

    def statistics(self, *arguments):
        return json.loads(self.good("render", ROOM, *SMALL, "--json", "-", *arguments).stdout)

    def interrupted(self, command, film):
        """What a render said that got SIGINT once it had written its unfinished film, or had ended; its exit code."""
        def written():
            path = self.path / film
            return path.stat().st_mtime_ns if path.exists() else 0
        before = written()
        process = subprocess.Popen([*command, "--checkpoint", "0.02"], cwd=self.path, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        while process.poll() is None and written() in (0, before):
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        return process.communicate(timeout=60 * SLOWDOWN)[1], process.returncode


def cube(scale, centre):
    """A closed wall: half sides and centre."""
    xyz = [" ".join(f'{axis}="{v}"' for axis, v in zip("xyz", values)) for values in (scale, centre)]
    return (f'<shape type="cube"><transform name="to_world"><scale {xyz[0]}/><translate {xyz[1]}/></transform>'
            '<bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf></shape>')


#: A room whose light comes through a small window in the wall on the left: few paths find it.
WINDOW_ROOM = '<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="6"/></integrator>' \
    '<sensor type="perspective"><float name="fov" value="84"/><transform name="to_world">' \
    '<lookat origin="0,-3.6,1.5" target="0,2,1.1" up="0,0,1"/></transform><film type="hdrfilm">' \
    '<integer name="width" value="40"/><integer name="height" value="24"/><rfilter type="box"/></film></sensor>' \
    '<emitter type="constant"><rgb name="radiance" value="3"/></emitter>' + "".join(
        cube(*wall) for wall in (((3, 4, .1), (0, 0, -.1)), ((3, 4, .1), (0, 0, 3.1)), ((3.2, .1, 1.7), (0, 4.1, 1.5)),
                                 ((3.2, .1, 1.7), (0, -4.1, 1.5)), ((.1, 4, 1.7), (3.1, 0, 1.5)),
                                 ((.1, 2.2, 1.7), (-3.1, -1.8, 1.5)), ((.1, 1.2, 1.7), (-3.1, 2.8, 1.5)),
                                 ((.1, .6, .5), (-3.1, 1, .5)), ((.1, .6, .4), (-3.1, 1, 2.6)))) + "</scene>"


class RareLight(RenderTest):
    """Where no sample of the CRN image finds the window, whole regions of it are black, without any variance."""

    def render(self, output, *arguments):
        self.good("render", "window.xml", "-o", output, "--quiet", "--no-preview", *arguments)

    def test_what_one_image_misses_is_not_black_and_not_certain(self):
        (self.path / "window.xml").write_text(WINDOW_ROOM)
        self.render("reference.exr", "--estimator", "none", "--spp", "1024", "--seed", "9")
        self.render("plain.exr", "--estimator", "none", "--spp", "24")
        for options in (IICV, (*IICV, "--paper"), ("--estimator", "cv-baseline", "--set", "ridge=0.001")):
            self.render("a.exr", "--spp", "24", *options, "--passes", "films", "--overwrite")
            image, crn, independent = (read_exr((self.path / name).read_bytes())
                                       for name in ("a.exr", "films/crn.exr", "films/independent.exr"))
            blind = [c == 0 and i > 0 for c, i in zip(crn["R"], independent["R"])]
            self.assertGreater(sum(blind), 100, "the scene has lost its point")
            self.assertTrue(all(error > 0 for error, b in zip(image["StdError.R"], blind) if b), options)
            if options == IICV:
                self.assertLess(self.relmse("a.exr", "reference.exr"),
                                0.35 * self.relmse("plain.exr", "reference.exr"))


class Plans(RenderTest):
    def test_default_is_the_denoised_mean_of_independent_samples(self):
        default = ("--spp", "24", "--seed", "3", "--oidn", "off")
        facts = self.statistics("-o", "a.exr", *default, "--passes", "films")
        self.assertEqual(facts["estimator"], "mixture --denoise auto --oidn off")
        self.assertEqual([(p["sampling"], p["samples_per_pixel"], p["groups"]) for p in facts["passes"]],
                         [("independent", 24, 12)])
        self.assertLess(facts["predicted_relmse"], facts["risks"]["mean"])
        self.assertTrue(0 <= facts["predicted_bias_share"] < 1)
        self.assertNotIn("denoiser_missing", facts, "--oidn off: nothing is missing")
        self.good("render", ROOM, *SMALL, "-o", "b.exr", *default, "--estimator", "none", "--denoise", "auto")
        self.same("a.exr", "b.exr")
        self.good("combine", "--independent", "films/independent.exr", "-o", "c.exr", "--denoise", "auto", "--oidn",
                  "off", "--quiet")
        self.assertGreater(self.relmse("c.exr", "a.exr"), 0, "without features")
        said = self.good("render", ROOM, *SMALL[:2], "-o", "b.exr", *default, "--verbose").stderr
        self.assertRegex(said, r"(?m)^predicted relMSE 0\.0\d+, .*\d+ % of it squared bias; the mean of the samples "
                               r"has 0\.")

    def test_what_is_named_is_not_denoised(self):
        for options in (("--estimator", "none"), ("--denoise", "none"), ("--sampling", "independent")):
            self.assertEqual(self.statistics("-o", "a.exr", "--spp", "4", *options)["estimator"], "none")
        self.assertEqual(self.statistics("-o", "a.exr", "--spp", "8", *IICV)["estimator"], "iicv")

    def test_a_missing_network_is_said_once_and_is_no_error(self):
        if self.run_covary("denoise", "--check").returncode == 0:
            self.assertRegex(self.statistics("-o", "a.exr", "--spp", "4")["denoiser"], r"^Open Image Denoise 2\.")
            return
        facts = self.statistics("-o", "a.exr", "--spp", "4")
        self.assertIn("Open Image Denoise is not installed", facts["denoiser_missing"])
        errors = self.good("render", ROOM, *SMALL[:2], "-o", "b.exr", "--spp", "4").stderr
        self.assertEqual(errors.count("note: Open Image Denoise is not installed"), 1)

    def test_iicv_equals_combine_of_the_two_passes(self):
        facts = self.statistics("-o", "a.exr", *IICV, "--spp", "48", "--seed", "3")
        self.assertEqual(facts["estimator"], "iicv")
        self.assertEqual([(p["sampling"], p["samples_per_pixel"], p["groups"]) for p in facts["passes"]],
                         [("crn", 24, 12), ("independent", 24, 12)])
        self.assertEqual(facts["samples_per_pixel"], 48)
        self.assertGreater(facts["predicted_relmse"], 0)
        for sampling in ("crn", "independent"):
            self.good("render", ROOM, *SMALL, "-o", f"{sampling}.exr", "--sampling", sampling, "--groups", "12",
                      "--spp", "24", "--seed", "3")
        self.good("combine", "--crn", "crn.exr", "--independent", "independent.exr", "-o", "b.exr", "--error",
                  "--estimator", "iicv", "--quiet")
        self.same("a.exr", "b.exr")
        info = json.loads(self.good("info", "a.exr", "--json").stdout)
        self.assertEqual(set(info["channels"]),
                         {f"{layer}{c}" for layer in ("", "StdError.") for c in "RGB"})
        self.assertEqual(info["attributes"]["covary:estimator"], "iicv")
        self.assertFalse(list(self.path.glob("*.passes")), "passes are not left behind")

    def test_less_error_than_plain_at_equal_samples(self):
        self.good("render", ROOM, *SMALL, "-o", "r.exr", "--estimator", "none", "--spp", "1024", "--seed", "9")
        self.good("render", ROOM, *SMALL, "-o", "plain.exr", "--estimator", "none", "--spp", "48", "--seed", "3")
        self.good("render", ROOM, *SMALL, "-o", "iicv.exr", *IICV, "--spp", "48", "--seed", "3")
        self.assertLess(self.relmse("iicv.exr", "r.exr"), 0.7 * self.relmse("plain.exr", "r.exr"))

    def test_estimators_share_passes(self):
        first = self.statistics("-o", "a.exr", *IICV, "--spp", "48", "--passes", "films")
        self.assertEqual(sorted(p.name for p in (self.path / "films").iterdir()),
                         ["crn.exr", "crn.json", "independent.exr", "independent.json"])
        films = {p.name: p.stat().st_mtime_ns for p in (self.path / "films").iterdir() if p.suffix == ".exr"}
        for estimator in ("cv-baseline", "iduw", "iicv"):
            facts = self.statistics("-o", f"{estimator}.exr", "--spp", "48", "--passes", "films", "--resume",
                                    "--estimator", estimator)
            self.assertEqual(facts["seconds"]["render"], first["seconds"]["render"],
                             "the cost of shared passes is known")
            self.assertEqual(facts["samples"], first["samples"])
        self.same("a.exr", "iicv.exr")
        self.assertGreater(self.relmse("iduw.exr", "a.exr"), 0)
        self.assertEqual(set(films), {"crn.exr", "independent.exr"})

    def test_split(self):
        facts = self.statistics("-o", "a.exr", *IICV, "--spp", "96", "--split", "1:3")
        self.assertEqual([p["samples_per_pixel"] for p in facts["passes"]], [24, 72])

    def test_few_samples_have_fewer_groups(self):
        facts = self.statistics("-o", "a.exr", *IICV, "--spp", "8")
        self.assertEqual([(p["samples_per_pixel"], p["groups"]) for p in facts["passes"]], [(4, 4), (4, 4)])
        facts = self.statistics("-o", "a.exr", *IICV, "--spp", "1")
        self.assertEqual([(p["samples_per_pixel"], p["groups"]) for p in facts["passes"]], [(4, 4), (4, 4)])
        facts = self.statistics("-o", "a.exr", *IICV, "--spp", "7", "--groups", "3")
        self.assertEqual([(p["samples_per_pixel"], p["groups"]) for p in facts["passes"]], [(4, 3), (3, 3)])

    def test_samples_are_those_that_were_asked_for(self):
        for spp, options, passes in (("32", IICV, [(16, 8), (16, 8)]), ("25", IICV, [(13, 12), (12, 12)]),
                                     ("32", ["--oidn", "off"], [(32, 8)]), ("7", ["--oidn", "off"], [(7, 7)]),
                                     ("32", ["--sampling", "crn"], [(32, 8)]),
                                     ("32", ["--estimator", "none"], [(32, 1)]),
                                     ("32", ["--estimator", "none", "--groups", "12"], [(32, 12)])):
            facts = self.statistics("-o", "a.exr", "--spp", spp, *options)
            self.assertEqual([(p["samples_per_pixel"], p["groups"]) for p in facts["passes"]], passes)
        result = self.good("render", ROOM, *SMALL, "-o", "a.exr", *IICV, "--spp", "7")
        self.assertIn("8 samples per pixel instead of 7: each of 4 groups needs one in every pass", result.stderr)

    def test_methods_share_films_of_few_samples(self):
        for spp in ("6", "7", "9", "13"):
            self.statistics("-o", "a.exr", *IICV, "--spp", spp, "--passes", "films" + spp)
            for estimator in ("iduw", "cv-baseline", "iicv"):
                facts = self.statistics("-o", "b.exr", "--spp", spp, "--passes", "films" + spp, "--resume",
                                        "--estimator", estimator)
            self.same("a.exr", "b.exr")

    def test_merging_what_denoise_made(self):
        for seed in ("1", "2"):
            self.good("render", ROOM, *SMALL, "-o", f"{seed}.exr", "--estimator", "none", "--spp", "4", "--seed", seed)
        self.good("denoise", "1.exr", "2.exr", "-o", "out.exr", "--oidn", "off")
        refused = self.bad(1, "merge the films that it was made of", "merge", "1.exr", "out.exr", "-o", "m.exr").stderr
        self.assertNotIn("--passes", refused)  # covary denoise has no such option

    def test_merging_images_names_what_to_merge_instead(self):
        for seed in ("1", "2"):
            self.statistics("-o", f"{seed}.exr", *IICV, "--spp", "8", "--seed", seed)
        refused = self.run_covary("merge", "1.exr", "2.exr", "-o", "both.exr").stderr
        self.assertIn("covary: 1.exr is not a film but an image that 'iicv' made from films", refused)
        again = [line.strip() for line in refused.splitlines() if line.startswith("  covary render ")]
        self.assertEqual([line.rsplit(" --passes ")[-1] for line in again], ["1.films", "2.films"])
        for line in again:
            self.good(*shlex.split(line)[1:])
        refused = self.run_covary("merge", "1.exr", "2.exr", "-o", "both.exr").stderr
        self.assertIn("its films are there", refused)
        for line in refused.splitlines():
            if line.startswith("  covary "):
                self.good(*shlex.split(line)[1:])
        info = json.loads(self.good("info", "both.exr", "--json").stdout)
        self.assertEqual(info["attributes"]["covary:estimator"], "iicv")

    def test_groups_give_standard_errors_to_plain_renders(self):
        """StdError is sqrt(sum (m_t - m)^2 / (T - 1) / T) of the group means m_t, for resumed and merged films, too."""
        def check(name):
            channels = read_exr((self.path / name).read_bytes())
            for c in "RGB":
                for pixel in range(0, len(channels[c]), 101):
                    groups = [channels[f"group{t:02}.{c}"][pixel] for t in range(12)]
                    error = statistics.stdev(groups) / math.sqrt(12)
                    self.assertAlmostEqual(channels[f"StdError.{c}"][pixel], error, delta=1e-6 + 1e-4 * error)
        plain = ("--estimator", "none", "--groups", "12")
        facts = self.statistics("-o", "a.exr", "--spp", "24", *plain)
        self.assertGreater(facts["predicted_relmse"], 0)
        check("a.exr")
        self.statistics("-o", "a.exr", "--spp", "36", "--resume", *plain)
        self.statistics("-o", "b.exr", "--spp", "36", "--seed", "5", *plain)
        self.good("merge", "a.exr", "b.exr", "-o", "both.exr")
        check("both.exr")
        info = json.loads(self.good("info", "both.exr", "--json").stdout)
        self.assertEqual(info["attributes"]["covary:samples"], "72")
        self.statistics("-o", "one.exr", "--spp", "24", "--estimator", "none")
        self.assertNotIn("StdError.R", read_exr((self.path / "one.exr").read_bytes()))

    def test_any_split_gives_the_bits_of_one_go(self):
        for options in (["--estimator", "none"], ["--estimator", "none", "--groups", "5"], ["--oidn", "off"], [*IICV]):
            self.statistics("-o", "whole.exr", "--spp", "100", "--passes", "whole", *options)
            for spp in ("35", "50", "57", "100"):
                self.statistics("-o", "part.exr", "--spp", spp, "--passes", "part", "--resume", *options,
                                *([] if "none" in options else ["--groups", "10"]))
            self.same("part.exr", "whole.exr")
            for folder in ("whole", "part"):
                for file in (self.path / folder).iterdir():
                    file.unlink()

    def test_until(self):
        facts = self.statistics("-o", "a.exr", *IICV, "--until", "relmse=0.003")
        self.assertLessEqual(facts["predicted_relmse"], 0.003)
        self.assertGreater(facts["samples_per_pixel"], 48)
        self.good("render", ROOM, *SMALL, "-o", "b.exr", *IICV, "--spp",
                  str(int(facts["samples_per_pixel"])))
        self.same("a.exr", "b.exr")
        self.assertLessEqual(self.statistics("-o", "c.exr", "--until", "relmse=0.002", "--oidn", "off")
                             ["predicted_relmse"], 0.002)
        facts = self.statistics("-o", "d.exr", "--until", "relmse=0.02", "--estimator", "none")
        self.assertLessEqual(facts["predicted_relmse"], 0.02)

    def test_aovs(self):
        self.good("render", ROOM, *SMALL, "-o", "a.exr", "--spp", "24", "--aovs")
        channels = json.loads(self.good("info", "a.exr", "--json").stdout)["channels"]
        self.assertTrue({"Albedo.R", "N.X", "P.Z", "StdError.B", "G"} <= set(channels))

    def test_layers_add_up(self):
        films = ("--spp", "16", "--groups", "8", "--seed", "5")
        for options, error in ((("--oidn", "off"), 1e-5), (("--estimator", "none"), 1e-5),
                               (("--estimator", "none", "--groups", "1"), 1e-5)):
            self.good("render", ROOM, *SMALL, *films[:2], "-o", "a.exr", "--layers", "direct", "--seed", "5", *options)
            channels = read_exr((self.path / "a.exr").read_bytes())
            for c in "RGB":
                for whole, *parts in zip(*(channels[layer + c] for layer in ("", "Direct.", "Indirect."))):
                    self.assertAlmostEqual(whole, sum(parts), delta=error * (1 + abs(whole)))
        self.good("render", ROOM, *SMALL, *films, "-o", "b.exr", "--max-depth", "2", "--estimator", "none")
        self.good("render", ROOM, *SMALL, *films, "-o", "a.exr", "--layers", "direct", "--estimator", "none")
        direct = [read_exr((self.path / name).read_bytes())[channel]
                  for name, channel in (("a.exr", "Direct.G"), ("b.exr", "G"))]
        self.assertEqual(*direct, "the same paths, but shorter")
        self.good("render", ROOM, *SMALL, *films, "-o", "c.exr", "--estimator", "none")
        self.assertEqual(*(read_exr((self.path / name).read_bytes())["G"] for name in ("a.exr", "c.exr")))
        self.bad(2, "iicv makes no --layers", "render", ROOM, "-o", "d.exr", *IICV, "--layers", "direct")
        self.bad(2, "--layers direct needs an integrator that separates direct from indirect light: path", "render",
                 ROOM, "-o", "d.exr", "--layers", "direct", "--integrator", "bdpt")

    def test_wrong_options(self):
        render = ("render", ROOM, "-o", "a.exr")
        for options, noted in ((("--sampling", "crn"), True), (("--sampling", "crn", "--estimator", "none"), False)):
            errors = self.good("render", ROOM, "--resolution", "8x6", "--no-preview", "-o", "s.exr", "--overwrite",
                               "--spp", "4", *options).stderr
            self.assertEqual("note: --sampling renders a single pass without --denoise"
                             in errors, noted)
        self.bad(2, "--sampling is an option of --estimator none", *render, "--estimator", "iicv", "--sampling", "crn")
        self.bad(2, "--split is an option of estimators with two passes", *render, "--estimator", "none", "--split",
                 "1:2")
        self.bad(2, "expected CRN:INDEPENDENT", *render, "--split", "half")
        self.bad(2, "expected relmse=X", *render, "--until", "0.01")
        self.bad(2, "expected relmse=X", *render, "--until", "relmse=0.01x")
        self.bad(2, "iduw does not estimate its error", *render, "--until", "relmse=0.01", "--estimator", "iduw")
        self.bad(2, "--paper is an option of --estimator iicv, dependent-tests, not of cv-baseline", *render,
                 "--estimator", "cv-baseline", "--paper")
        self.bad(2, "--set k is an option of", *render, "--estimator", "none", "--set", "k=3")
        self.bad(2, "at least 3 groups", *render, *IICV, "--groups", "2")
        self.bad(2, "at least 4 groups", *render, "--groups", "3", "--estimator", "iduw")
        self.bad(2, "window", *render, *IICV, "--set", "window=4")

    def test_predictions_from_few_samples_are_called_unreliable(self):
        words = "(unreliable: fewer than 48 samples per pixel)"
        for spp, estimator, reliable in (("24", "cv-baseline", False), ("48", "cv-baseline", True)):
            result = self.good("render", ROOM, "--resolution", "48x32", "-o", "a.exr", "--spp", spp, "--estimator",
                               estimator, "--json", "facts.json", "--verbose")
            self.assertEqual(words in result.stderr, not reliable)
            facts = json.loads((self.path / "facts.json").read_text())
            self.assertIs(facts["predicted_relmse_reliable"], reliable)


#: Hair without pigments under a sky of 1: it keeps all light, so nothing is seen of it.
CLEAR_HAIR = '<scene version="3.0.0"><integrator type="path"/><emitter type="constant"/><sensor type="perspective">' \
    '<float name="fov" value="30"/><transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/>' \
    '</transform><film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/></film>' \
    '</sensor><shape type="bsplinecurve"><string name="filename" value="hair.txt"/><bsdf type="hair">' \
    '<float name="eumelanin" value="0"/><float name="pheomelanin" value="0"/></bsdf></shape></scene>'


class Hair(RenderTest):
    """64 samples, one seed: over 576 pixels the standard error of the mean is 0.0008, six of which are accepted."""

    def test_without_pigments_keeps_all_light(self):
        self.write("hair.txt", b"-2 0 0 .5\n-1 .2 0 .5\n0 0 0 .4\n1 -.2 .1 .5\n2 0 0 .5\n3 0 0 .5\n")
        self.write("hair.xml", CLEAR_HAIR.encode())
        self.good("render", "hair.xml", "--spp", "64", "--estimator", "none", "--denoise", "none", "--quiet",
                  "--no-preview", "-o", "hair.exr")
        green = read_exr((self.path / "hair.exr").read_bytes())["G"]
        self.assertAlmostEqual(statistics.fmean(green), 1, delta=0.005)
        self.assertGreater(statistics.pstdev(green), 0.005)  # it is there


class Files(RenderTest):
    RENDER = ("render", ROOM, *SMALL[:-1], "--spp", "6")

    def test_names_say_what_is_written(self):
        for name in ("a.png", "a.jpg", "a.hdr", "a", ROOM):
            self.bad(2, f"-o '{name}': the name must end in .exr", *self.RENDER, "-o", name)
        self.bad(2, "with -o 'a.exr', 'a.png' is written, too, to look at", *self.RENDER, "-o", "a.png")
        self.bad(2, "--json 'a.exr' names an image", *self.RENDER, "-o", "b.exr", "--json", "a.exr")
        self.bad(2, "--json 'b.png' names an image", *self.RENDER, "-o", "b.exr", "--json", "b.png")
        self.bad(2, "-o '/dev/null' is not a regular file", *self.RENDER, "-o", "/dev/null")
        self.write("file", b"")

    def test_parameters_of_integrators_have_hints(self):
        for given, right in (("max_dept", "max_depth"), ("rr_dept", "rr_depth")):
            (self.path / "slip.xml").write_text(
                f'<scene version="3.0.0"><integrator type="path"><integer name="{given}" value="6"/></integrator>'
                "</scene>")
            self.bad(1, f"unknown parameter '{given}' of integrator 'path'; did you mean '{right}'", "render",
                     "slip.xml", "-o", "a.exr")

    def test_small_scenes_have_names(self):
        hashes = [json.loads(self.good("info", image, "--json").stdout)["attributes"]["covary:scene_hash"]
                  for image, scene in (("name.exr", "room"), ("file.exr", ROOM))
                  if self.good("render", scene, *SMALL, "--spp", "4", "--estimator", "none", "-o", image)]
        self.assertEqual(*hashes)
        self.bad(1, "there is no file 'rooom', and no built-in scene of that name; did you mean 'room'? Built-in are "
                    "box, ", "render", "rooom", "-o", "out.exr")
        self.bad(1, "there is no file 'scenes/room.xml'; the built-in scene is called 'room'", "render",
                 "scenes/room.xml", "-o", "out.exr")
        (self.path / "room").write_text("not a scene")  # a file of this name comes first
        self.bad(1, "room", "render", "room", *SMALL, "-o", "out.exr")

    def test_no_file_of_the_scene_is_overwritten(self):
        self.image("sky.exr", (1, 1, 1), size=(8, 4))
        self.write("scene.xml",
                   b"<scene version='3.0.0'><emitter type='envmap'><string name='filename' value='sky.exr'/></emitter>"
                   b"<sensor type='perspective'/></scene>")
        os.symlink("scene.xml", self.path / "scene.exr")
        render = ("render", "scene.xml", "--resolution", "8x8", "--spp", "3", "--quiet")
        for name in ("sky.exr", "./sky.exr", "scene.exr"):
            if name != "scene.exr":  # of which it is known before the scene is read
                self.bad(2, f"-o '{name}' already exists, and 'covary render' did not make it", *render, "-o", name)
            self.bad(2, f"-o '{name}' is a file that the same command reads", *render, "-o", name, "--overwrite")
        os.symlink("scene.xml", self.path / "statistics")
        self.bad(2, "--json 'statistics' is a file that the same command reads", *render, "-o", "a.exr", "--json",
                 "statistics")
        self.good(*render, "-o", "a.exr")

    def test_the_preview_replaces_only_its_own(self):
        self.good(*self.RENDER, "-o", "a.exr")
        self.good(*self.RENDER, "-o", "a.exr")
        self.write("a.png", b"a photograph")
        self.bad(2,
                 "the preview would replace 'a.png', which covary did not make; use --no-preview, or another name "
                 "for -o", *self.RENDER, "-o", "a.exr")
        self.good(*self.RENDER, "-o", "a.exr", "--no-preview")
        self.assertEqual((self.path / "a.png").read_bytes(), b"a photograph")

    def test_films_of_passes_are_outputs_too(self):
        (self.path / "films").mkdir()
        self.bad(2, "-o 'films/crn.exr' and --passes 'films/crn.exr' are the same file", *self.RENDER, "-o",
                 "films/crn.exr",
                 "--passes", "films")
        self.good(*self.RENDER, *IICV, "-o", "films/image.exr", "--passes", "films")

    def test_statistics_of_a_name_that_is_not_utf_8(self):
        output = b"caf\xe9.exr"
        done = subprocess.run([COVARY, *self.RENDER, "-o", output, "--json", "-"], cwd=self.path, capture_output=True,
                              timeout=60 * SLOWDOWN)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout.decode("utf-8"))["output"], "caf\ufffd.exr")

    def test_numbers(self):
        render = (*self.RENDER, "-o", "a.exr", "--no-preview")
        facts = json.loads(self.good(*render, "--seed", "010", "--json", "-").stdout)
        self.assertEqual(facts["seed"], 10)
        facts = json.loads(self.good(*render, "--seed", "18446744073709551615", "--json", "-").stdout)
        self.assertEqual(facts["seed"], 18446744073709551615)
        for text in ("-1", "18446744073709551616", "0x10", "1.0", "ten"):
            self.bad(2, f"--seed: '{text}': expected a whole number of at least 0", *render, f"--seed={text}")
        self.bad(2, "of at least 0, at most 18446744073709551615", *render, "--seed=18446744073709551616")
        for text in ("0x20", "99999999999999999999", "1e3"):
            for option in ("spp", "groups", "max-depth", "threads"):
                self.bad(2, f"--{option}: '{text}': expected a whole number", *render, f"--{option}={text}")
            self.bad(2, f"--set k: '{text}': expected a whole number", *render, "--estimator", "iicv", "--set",
                     f"k={text}")
        for text in ("nan", "inf", "1e400"):
            self.bad(2, f"--time: '{text}': expected a number above 0", *render, f"--time={text}")
            self.bad(2, f"--checkpoint: '{text}': expected a number of at least 0", *render, f"--checkpoint={text}")
            self.bad(2, f"--until 'relmse={text}': expected relmse=X", *render, f"--until=relmse={text}")


class Polynomials(RenderTest):
    OPTIONS = ("--estimator", "polynomials", "--spp", "48", "--max-depth", "2")

    def attributes(self, name):
        return json.loads(self.good("info", name, "--json").stdout)["attributes"]

    def test_less_error_than_plain_at_equal_samples(self):
        for name, *options in (("r.exr", "none", "--spp", "2048", "--seed", "9"), ("plain.exr", "none", "--spp", "96"),
                               ("p.exr", "polynomials", "--spp", "96")):
            self.good("render", str(SCENES / "wall.xml"), *SMALL, "-o", name, "--max-depth", "2", "--estimator",
                      *options)
        self.assertLess(self.relmse("p.exr", "r.exr"), 0.9 * self.relmse("plain.exr", "r.exr"))

    def test_statistics_and_attributes(self):
        facts = self.statistics("-o", "a.exr", *self.OPTIONS, "--aovs")
        self.assertEqual(facts["estimator"], "polynomials")
        self.assertEqual([(p["sampling"], p["samples_per_pixel"], p["groups"]) for p in facts["passes"]],
                         [("independent", 48, 1)])
        seconds = facts["seconds"]
        self.assertGreater(seconds["estimate"], 0)
        self.assertGreater(seconds["render"] + seconds["estimate"], facts["passes"][0]["seconds"], "auxiliary images")
        attributes = self.attributes("a.exr")
        self.assertEqual(attributes["covary:estimator"], "polynomials")
        self.assertIn("polynomials dimensions=4 samples=48", attributes["covary:settings"])
        self.assertEqual((attributes["covary:samples"], attributes["covary:complete"]), ("48", "true"))
        self.assertIn("Albedo.R", json.loads(self.good("info", "a.exr", "--json").stdout)["channels"])

    def test_bits_depend_on_the_fit_alone(self):
        self.statistics("-o", "a.exr", *self.OPTIONS)
        for i, options in enumerate((["--threads", "1"], ["--passes", "films"])):
            self.statistics("-o", f"b{i}.exr", *self.OPTIONS, *options)
            self.same("a.exr", f"b{i}.exr")
        self.statistics("-o", "crop.exr", *self.OPTIONS, "--crop", "9,8,21,17")
        self.same("crop.exr", "a.exr")

    def test_films_are_kept_and_belong_to_one_fit(self):
        first = self.statistics("-o", "a.exr", *self.OPTIONS, "--passes", "films")
        again = (*self.OPTIONS, "--passes", "films", "--resume")
        facts = self.statistics("-o", "b.exr", *again)
        self.assertEqual(facts["seconds"]["render"], first["seconds"]["render"])
        self.assertEqual(facts["seconds"]["estimate"], first["seconds"]["estimate"])
        self.same("a.exr", "b.exr")
        result = self.bad(1, "--resume: 'films/independent.exr' was rendered with settings", "render", ROOM, *SMALL,
                          "-o", "c.exr", *("96" if word == "48" else word for word in again))
        self.assertIn("dimensions=4 samples=48, this command asks for", result.stderr)
        self.assertIn("dimensions=4 samples=96", result.stderr)
        self.bad(1, "was rendered with settings", "render", ROOM, *SMALL, "-o", "a.exr", "--resume", "--estimator",
                 "none", "--spp", "48", "--max-depth", "2")

    def test_wrong_options(self):
        render = ("render", ROOM, *SMALL, "-o", "a.exr", "--estimator", "polynomials")
        self.bad(2, "polynomials renders one pass with independent random numbers", *render, "--sampling", "crn")
        self.bad(2, "--split is an option of estimators with two passes, not of polynomials", *render, "--split", "1:2")
        self.bad(2, "--groups: polynomials are fitted to the samples of a pixel themselves", *render, "--groups", "4")
        self.bad(2, "--until: polynomials does not estimate its error", *render, "--until", "relmse=0.1")
        self.bad(2, "so their number must be known; use --spp", *render, "--time", "1")
        self.bad(2, "--set k is an option of --estimator iicv, cv-baseline, not of polynomials", *render,
                 "--set", "k=3")
        self.bad(2, "15 samples per pixel are too few to fit the 15 coefficients of 4 dimensions, expected at least 16",
                 *render, "--spp", "15")
        self.bad(2, "polynomials are fitted to the samples of each pixel, which images do not hold", "combine", "--crn",
                 "a.exr", "--independent", "b.exr", "-o", "c.exr", "--estimator", "polynomials")


class Time(RenderTest):
    """Bars are wide, because other programs may use the machine: they tell what is counted from what is not."""

    def timed(self, seconds, estimator, *arguments, resolution="400x300", code=0):
        start = time.monotonic()
        result = self.run_covary("render", ROOM, "--resolution", resolution, "--quiet", "--no-preview", "-o", "a.exr",
                                 "--time", str(seconds), "--estimator", estimator, "--json", "-", "--overwrite",
                                 *arguments)
        self.assertEqual(result.returncode, code, result.stderr)
        facts = json.loads(result.stdout)
        self.assertLess(facts["seconds"]["total"], time.monotonic() - start)
        return facts

    def test_rendering_leaves_time_for_the_estimate(self):
        # Slow ones, so that the time left for the estimate is more than the noise of a busy machine; a render that
        # leaves none ends after the limit in every attempt.
        slow = ("--set", "k=100", "--set", "window=21")
        for estimator, *arguments in (("iicv", *slow), ("cv-baseline", *slow), ("iduw", "--set", "window=21")):
            with self.subTest(estimator):
                limit, attempts = 1, []
                while len(attempts) < 3:
                    facts = self.timed(limit, estimator, *arguments, resolution="120x90")
                    if facts["samples_per_pixel"] <= 2 * sum(p["groups"] for p in facts["passes"]):
                        limit *= 2  # the first samples alone took this long
                        self.assertLess(limit, 200)
                        continue
                    seconds = facts["seconds"]
                    self.assertGreater(seconds["trial"], 0)
                    self.assertGreater(seconds["render"] + seconds["trial"] + seconds["estimate"], 0.5 * limit)
                    self.assertFalse(facts["complete"])
                    attempts.append(seconds["render"] + seconds["trial"])
                    if attempts[-1] < limit:
                        break
                self.assertLess(min(attempts), limit)

    def test_a_plain_render_uses_all_of_it(self):
        seconds = self.timed(1, "none")["seconds"]
        self.assertEqual(seconds["estimate"], 0)
        self.assertTrue(0.5 < seconds["trial"] + seconds["render"] + seconds["write"] < 3 * SLOWDOWN, seconds)

    def test_every_pixel_has_samples_however_short_the_time(self):
        self.timed(0.001, "none")
        samples = read_exr((self.path / "a.exr").read_bytes())["samples"]
        self.assertGreaterEqual(min(samples), 1)
        facts = self.timed(0.001, "iicv")
        self.assertEqual([(p["groups"], p["samples_per_pixel"]) for p in facts["passes"]], [(4, 4), (4, 4)])
        result = self.good("render", ROOM, "--resolution", "400x300", "-o", "b.exr", *IICV, "--time", "0.001")
        self.assertIn("warning: --time 0.001 was exceeded", result.stderr)

    def test_what_the_clock_decided_makes_the_same_image(self):
        for arguments in (("none",), ("none", "--denoise", "auto", "--oidn", "off"), ("iicv",)):
            with self.subTest(arguments):
                facts = self.timed(1, *arguments, resolution="64x48")
                choice = facts["time_choice"].split()
                self.assertEqual(choice[:2], ["--spp", f"{facts['samples_per_pixel']:g}"])
                self.assertEqual("--groups" in choice, arguments != ("none",))
                timed = (self.path / "a.exr").read_bytes()
                self.assertIn(facts["time_choice"].encode(), header(timed)[0]["covary:time_choice"])
                self.good("render", ROOM, *SMALL, "-o", "b.exr", "--estimator", *arguments, *choice)
                self.assertEqual(read_exr(timed), read_exr((self.path / "b.exr").read_bytes()))

    def test_too_short_a_time_is_told_beforehand(self):
        for options in (IICV, [*IICV, "--adaptive"], ["--oidn", "off", "--adaptive"],
                        ["--oidn", "off", "--until", "relmse=100"]):
            with self.subTest(options):
                result = self.good("render", ROOM, "--resolution", "200x150", "-o", "a.exr", "--overwrite",
                                   "--time", "0.001", *options)
                told = re.search(r"warning: --time 0.001 is too short: the minimum takes about (.*) s \((.*)\)",
                                 result.stderr)
                self.assertRegex(told[2], r"1 sample per pixel|[2-9]\d* samples per pixel")
                parts = [float(part.split()[0]) for part in told[2].split(", ")]
                self.assertAlmostEqual(float(told[1]), sum(parts), delta=0.1 * float(told[1]))
                late = result.stderr.find("was exceeded")
                self.assertTrue(late < 0 or result.stderr.index("too short") < late, result.stderr)

    def test_training_that_takes_most_of_the_time_is_told_beforehand(self):
        result = self.good("render", ROOM, "--resolution", "64x48", "-o", "a.exr", "--time", "0.01", "--estimator",
                           "none", "--denoise", "none", "--integrator", "guided-path")
        self.assertRegex(result.stderr, r"\Awarning: of --time 0.01, training with 16 samples per pixel takes about ")

    def test_with_until(self):
        facts = self.timed(60, "iicv", "--until", "relmse=0.02", resolution="64x48")
        self.assertLessEqual(facts["predicted_relmse"], 0.02)
        self.assertLess(facts["seconds"]["render"], 30 * SLOWDOWN)
        facts = self.timed(1, "iicv", "--until", "relmse=1e-9", resolution="64x48", code=3)
        self.assertGreater(facts["predicted_relmse"], 1e-9)
        self.assertLess(facts["seconds"]["render"] + facts["seconds"]["estimate"], 3 * SLOWDOWN)

    def test_interrupted_and_resumed(self):
        command = [COVARY, "render", ROOM, "--resolution", "128x96", "--no-preview", "-o", "a.exr", *IICV]
        message, code = self.interrupted([*command, "--time", "60"], "a.passes/crn.exr")
        self.assertEqual(code, 130, message)
        self.assertIn("interrupted after", message)
        before = json.loads(self.good("info", "a.passes/crn.exr", "--json").stdout)["attributes"]
        # Whatever the number of groups that the shorter time would choose.
        result = self.good(*command[1:], "--time", "0.5", "--resume", "--json", "-", "--quiet")
        facts = json.loads(result.stdout)
        self.assertEqual([str(p["groups"]) for p in facts["passes"]], [before["covary:groups"]] * 2)
        self.assertFalse((self.path / "a.passes").exists())


class Interruption(RenderTest):
    def test_interrupted_and_resumed(self):
        for estimator in ("iicv", "polynomials"):
            with self.subTest(estimator):
                self.interrupt_and_resume(estimator)

    def interrupt_and_resume(self, estimator):
        """Interrupted at several moments, resumed each time: the bits of an uninterrupted render, and no film left
        over."""
        spp = {"iicv": "600", "polynomials": "1000"}[estimator]
        arguments = ["render", ROOM, "--resolution", "64x48", "--spp", spp, "--no-preview", "--estimator", estimator,
                     "--threads", "2"]
        self.good(*arguments, "--quiet", "-o", "whole.exr")
        film = "parts.exr" if estimator == "polynomials" else "parts.passes/crn.exr"
        (self.path / "parts.exr").unlink(missing_ok=True)
        interruptions = 0
        while interruptions < 3:
            message, code = self.interrupted([COVARY, *arguments, "-o", "parts.exr", "--resume"], film)
            if "interrupted after" in message:
                interruptions += 1
                self.assertEqual(code, 130, message)
                self.assertIn(film.split("/")[0], message)
                self.assertTrue((self.path / film).exists())
            elif "\ntime: " in message:  # the image was complete before the signal came
                (self.path / "parts.exr").unlink()
        self.good(*arguments, "-o", "parts.exr", "--resume")
        self.same("whole.exr", "parts.exr")
        self.assertFalse((self.path / "parts.passes").exists())

    def test_passes_of_another_render_are_refused(self):
        self.good("render", ROOM, *SMALL, "-o", "a.exr", "--spp", "24", "--passes", "films")
        again = ("render", ROOM, *SMALL, "-o", "b.exr", "--spp", "24", "--passes", "films", "--resume")
        self.bad(1, "was rendered with seed 0, this command asks for 7", *again, "--seed", "7")
        self.bad(1, "was rendered with groups 12, this command asks for 6", *again, "--groups", "6")


class Pbrt(RenderTest):
    SCENE = str(SCENES / "spheres.pbrt")

    def test_scenes_of_pbrt_are_scenes(self):
        self.assertIn("480 x 320 pixels, 48 samples per pixel, integrator path", self.good("info", self.SCENE).stdout)
        small = ("render", self.SCENE, "--resolution", "48x32", "--quiet", "--no-preview", "--spp", "24")
        self.good(*small, "-o", "a.exr")
        self.good(*small, "-o", "b.exr", "--estimator", "none", "--threads", "1")
        self.good(*small, "-o", "c.exr", "--estimator", "none", "--threads", "3")
        self.same("b.exr", "c.exr")
        # Within the noise the default shows what path tracing does.
        self.assertLess(self.relmse("a.exr", "b.exr"), 0.1)
        self.bad(2, "scenes of pbrt have no parameters to define", *small, "-o", "d.exr", "-D", "a=1")

    def test_mistakes_have_a_place(self):
        (self.path / "wrong.pbrt").write_text('WorldBegin\nShape "teapot"\n')
        self.bad(1, 'wrong.pbrt:2:1: Shape "teapot" is not supported; supported: shapes', "render", "wrong.pbrt", "-o",
                 "a.exr")


if __name__ == "__main__":
    unittest.main()
