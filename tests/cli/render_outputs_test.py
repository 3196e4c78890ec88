# SPDX-License-Identifier: Apache-2.0
"""What `covary render` leaves behind: after Ctrl-C, short of the wanted error, beside films that are there already."""
import json
import os
import re
import shlex
import signal
import subprocess
import time
import unittest
from pathlib import Path

from cli_test import COVARY, SLOWDOWN, CliTest
from exr_reader import read_exr

SCENES = Path(os.environ["SCENES"])
ROOM = str(SCENES / "room.xml")
SMALL = ("--resolution", "64x48", "--quiet", "--no-preview")
IICV = ("--estimator", "iicv")

# Two lights so strong that the sum of what they send to the wall is not finite.
OVERFLOW = """<scene version="3.0.0">
<default name="how strong" value="1e-3"/>
<integrator type="path"><integer name="max_depth" value="2"/></integrator>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="3"/>
<rfilter type="box"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/><scale value="9"/><translate z="3"/>
</transform></shape>
<emitter type="point"><point name="position" x="1" y="0" z="2.9"/><rgb name="intensity" value="$how strong"/></emitter>
<emitter type="point"><point name="position" x="-1" y="0" z="2.9"/><rgb name="intensity" value="$how strong"/></emitter>
</scene>"""


class RenderTest(CliTest):
    def attributes(self, name):
        return json.loads(self.good("info", name, "--json").stdout)["attributes"]

    def start(self, *arguments):
        command = [COVARY, "render", ROOM, "--resolution", "64x48", *arguments]
        process = subprocess.Popen(command, cwd=self.path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def wait_for(self, condition, process):
        end = time.monotonic() + 60 * SLOWDOWN
        while not condition():
            self.assertIsNone(process.poll(), "the render ended too soon")
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)

    def stop(self, process, sent=signal.SIGINT):
        process.send_signal(sent)
        output, errors = process.communicate(timeout=60 * SLOWDOWN)
        return process.returncode, output, errors


# A ball before the sky.
BALL = """<scene version="3.0.0">
<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>
<sensor type="perspective"><transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/>
</transform><film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/>
<string name="pixel_format" value="rgba"/><rfilter type="box"/></film></sensor>
<shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>
<emitter type="constant"/></scene>"""


class Alpha(RenderTest):
    def test_is_how_much_surfaces_cover(self):
        self.write("ball.xml", BALL.encode())
        command = ("render", "ball.xml", "--spp", "64")
        said = self.good(*command, "-o", "plain.exr").stderr
        self.assertIn("alpha is written if `--alpha` asks for it", said)
        self.good(*command, "-o", "ball.exr", "--alpha", "--quiet")
        self.good(*command, "-o", "film.exr", "--alpha", "--denoise", "none", "--quiet")
        ball, plain, film = (read_exr((self.path / f"{name}.exr").read_bytes()) for name in ("ball", "plain", "film"))
        self.assertEqual(sorted(set(ball) - set(plain)), ["A"])
        self.assertEqual(ball["R"], plain["R"])
        alpha = ball["A"]
        self.assertEqual(film["A"], alpha)
        self.assertEqual((alpha[0], alpha[16 * 32 + 16]), (0, 1))
        self.assertTrue(any(0.2 < a < 0.8 for a in alpha), "on the edge")
        for i in range(32 * 32):  # premultiplied: a ball of reflectance 0.5 under a white sky
            self.assertAlmostEqual(film["R"][i], 0.5 * alpha[i], delta=0.15)
        self.good(*command, "-o", "part.exr", "--alpha", "--crop", "8,8,16,16", "--quiet")
        part = read_exr((self.path / "part.exr").read_bytes())["A"]
        self.assertEqual(part, [alpha[32 * (y + 8) + x + 8] for y in range(16) for x in range(16)])
        rendered = (self.path / "ball.png").read_bytes()
        self.assertEqual(rendered[25], 6, "colour type RGBA of the picture to look at")
        self.good("convert", "ball.exr", "ball.png", "--overwrite")


class Signals(RenderTest):
    def interrupt(self, sent, *arguments, film):
        """Interrupts a render once its unfinished films have been written a few times, so that all have samples."""
        process = self.start("-o", "a.exr", "--spp", "1000000", "--checkpoint", "0.05", "--json", "facts.json",
                             *arguments)
        path, written = self.path / film, set()

        def has_samples():
            if path.exists():
                written.add(path.stat().st_mtime_ns)
            return len(written) >= 3
        self.wait_for(has_samples, process)
        return self.stop(process, sent)

    def test_the_image_so_far(self):
        for sent, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(code):
                for path in (*self.path.glob("a.passes/*"), *self.path.glob("a.[ep]*")):
                    if path.is_file():
                        path.unlink()
                result, _, errors = self.interrupt(sent, *IICV, film="a.passes/independent.exr")
                self.assertEqual(result, code, errors)
                self.assertIn("'a.exr' is the image so far, 'a.passes' holds its films", errors)
                attributes = self.attributes("a.exr")
                self.assertEqual((attributes["covary:complete"], attributes["covary:estimator"]), ("false", "iicv"))
                self.assertGreater(float(attributes["covary:samples"]), 0)
                self.assertIn("StdError.R", read_exr((self.path / "a.exr").read_bytes()))
                self.assertTrue((self.path / "a.png").exists())
                facts = json.loads((self.path / "facts.json").read_text())
                self.assertTrue(facts["interrupted"])
                self.assertFalse(facts["complete"])

    def test_the_film_of_a_plain_render(self):
        code, _, errors = self.interrupt(signal.SIGINT, "--estimator", "none", "--aovs", film="a.exr")
        self.assertEqual(code, 130, errors)
        self.assertIn("'a.exr' is the image so far; the same command with --resume continues", errors)
        self.assertEqual(self.attributes("a.exr")["covary:complete"], "false")
        self.assertTrue((self.path / "a.png").exists())

    def test_an_ignored_signal_stays_ignored(self):
        command = f"trap '' INT; exec {shlex.join([COVARY, 'render', ROOM, *SMALL, '-o', 'a.exr', '--spp', '240'])}"
        process = subprocess.Popen(["sh", "-c", command], cwd=self.path, stderr=subprocess.PIPE, text=True)
        name = Path(f"/proc/{process.pid}/comm")
        while process.poll() is None and name.read_text().strip() != "covary":  # the shell has set the trap by then
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        errors = process.communicate(timeout=120 * SLOWDOWN)[1]
        self.assertEqual(process.returncode, 0, errors)


class Until(RenderTest):
    def test_not_reached(self):
        for limit in (("--spp", "48"), ("--time", "0.05")):
            result = self.run_covary("render", ROOM, *SMALL, "-o", "a.exr", *IICV, "--until", "relmse=1e-9", *limit,
                                     "--json", "-", "--overwrite")
            self.assertEqual(result.returncode, 3, result.stderr)
            self.assertRegex(result.stderr, r"\A(warning: --time 0.05 is too short: .*\n)?"
                         r"covary: --until relmse=1e-9 was not reached: 'a.exr' has a predicted "
                                            r"relMSE of \S+ after [\d.]+ samples per pixel(; that is "
                                            r"unreliable: .*)?\n$")
            facts = json.loads(result.stdout)
            self.assertIs(facts["until_reached"], False)
            self.assertGreater(facts["predicted_relmse"], 1e-9)
            self.assertTrue((self.path / "a.exr").exists())

    def test_a_prediction_that_hangs_on_few_pixels_is_called_unreliable(self):
        result = self.good("render", str(SCENES / "caustic.xml"), "--resolution", "48x36", "-o", "a.exr", "--quiet",
                           "--no-preview", *IICV, "--until", "relmse=5", "--json", "-")
        self.assertRegex(result.stderr, r"^warning: --until relmse=5 was reached, but the predicted error is "
                                        r"unreliable: no interval can be given: \d+ of 1728 pixels hold most of the "
                                        r"noise\n$")
        facts = json.loads(result.stdout)
        self.assertIs(facts["until_reached"], True)
        self.assertIs(facts["predicted_relmse_reliable"], False)
        self.assertRegex(facts["predicted_relmse_doubt"], r"^no interval can be given: ")

    def test_an_unreliable_prediction_at_most_doubles_the_samples(self):
        for scene, resolution, doubt, budgets in (("caustic", "48x36", True, "96 192 384 500"),
                                                  ("wall", "96x64", False, "96 384 500")):
            result = self.run_covary("render", str(SCENES / f"{scene}.xml"), "--resolution", resolution, "-o",
                                     f"{scene}.exr", "--quiet", "--no-preview", *IICV, "--until", "relmse=1e-9",
                                     "--spp", "500", "--passes", scene)
            self.assertEqual(result.returncode, 3, result.stderr)
            self.assertEqual("; that is unreliable: " in result.stderr, doubt, result.stderr)
            self.assertIn(f"covary:budgets: {budgets}\n", self.good("info", f"{scene}/crn.exr").stdout)

    def test_a_goal_that_is_met_is_not_rendered_again(self):
        render = ("render", ROOM, "--resolution", "64x48", "--no-preview", "-o", "made/a.exr", "--oidn", "off")
        self.good(*render, "--until", "relmse=0.05")
        before = (self.path / "made/a.exr").read_bytes()
        result = self.good(*render, "--until", "relmse=0.04", "--resume")
        said = re.search(r"(?m)^made/a.exr: complete, with a predicted relMSE of (0.0\d+); nothing to ", result.stderr)
        self.assertTrue(said, result.stderr)
        self.assertEqual((self.path / "made/a.exr").read_bytes(), before)
        self.bad(1, "--resume: the samples of 'made/a.exr' were not kept (--passes); --overwrite instead of --resume",
                 *render, "--until", f"relmse={0.7 * float(said[1])}", "--resume")
        self.assertEqual((self.path / "made/a.exr").read_bytes(), before)

    def test_reached(self):
        facts = json.loads(self.good("render", ROOM, *SMALL, "-o", "a.exr", "--until", "relmse=0.5", "--json",
                                     "-").stdout)
        self.assertIs(facts["until_reached"], True)
        facts = json.loads(self.good("render", ROOM, *SMALL, "-o", "a.exr", "--spp", "6", "--json", "-").stdout)
        self.assertNotIn("until_reached", facts)


class Passes(RenderTest):
    RENDER = ("render", ROOM, *SMALL, "-o", "a.exr", *IICV, "--passes", "films")

    def films(self):
        return {p.name: p.read_bytes() for p in (self.path / "films").iterdir() if p.suffix == ".exr"}

    def test_finished_films_are_safe(self):
        self.good(*self.RENDER, "--spp", "48")
        before = self.films()
        for options in (("--spp", "24"), ("--spp", "48"), ("--spp", "96"), ("--spp", "48", "--seed", "7"),
                        ("--spp", "48", "--max-depth", "3")):
            message = self.bad(1, "'films/crn.exr' already exists; --resume", *self.RENDER, *options).stderr
            self.assertIn("--overwrite replaces it", message)
        message = self.bad(1, "this command asks for 7", *self.RENDER, "--spp", "48", "--seed", "7", "--resume").stderr
        self.assertIn("--overwrite replaces it", message)
        self.bad(2, "--overwrite excludes --resume", *self.RENDER, "--resume", "--overwrite")
        self.assertEqual(before, self.films())
        self.good(*self.RENDER, "--spp", "24", "--seed", "7", "--overwrite")
        self.assertEqual(self.attributes("films/crn.exr")["covary:seed"], "7")

    def test_two_processes_on_one_folder(self):
        process = self.start("-o", "a.exr", *IICV, "--passes", "films", "--spp", "1000000", "--checkpoint", "0.05")
        self.wait_for((self.path / "films" / "crn.exr").exists, process)
        again = ("render", ROOM, *SMALL, "-o", "b.exr", *IICV, "--passes", "films", "--resume", "--spp", "24")
        result = self.run_covary(*again)
        self.assertEqual(result.returncode, 1)
        self.assertIn(f"process {process.pid} renders into the folder 'films'", result.stderr)
        process.kill()
        process.wait()
        self.assertTrue((self.path / "films" / ".lock").exists())
        self.good(*again)  # a lock of the dead is none
        self.assertFalse((self.path / "films" / ".lock").exists())

    def test_a_file_in_place_of_the_folder(self):
        (self.path / "films").write_text("text")
        self.bad(1, "'films' is not a folder; films of passes are kept in one", *self.RENDER, "--spp", "6")

    def test_costs_that_make_no_sense(self):
        self.good(*self.RENDER, "--spp", "24")
        for text in ('{"samples": "many", "rays": [], "seconds": {}}', '{"samples": 1, "rays": 1, "seconds": -5}', "["):
            (self.path / "films" / "crn.json").write_text(text)
            result = self.good(*self.RENDER, "--spp", "24", "--resume", "--json", "-")
            self.assertIn("warning: 'films/crn.json' is not used, so that times count this run alone", result.stderr)
            self.assertGreaterEqual(json.loads(result.stdout)["seconds"]["render"], 0)


class Replay(RenderTest):
    def test_printed_commands_run_in_a_shell(self):
        name = "it's a \"scene\" & more.xml"
        (self.path / name).write_text(OVERFLOW)
        strong = ("-D", "how strong=3e38")
        result = self.good("render", name, *strong, "-o", "a.exr", "--estimator", "none", "--spp", "4", "--seed", "9",
                           "--no-preview", "--json", "facts.json")
        self.assertIn("samples were not finite", result.stderr)
        printed = [line.strip() for line in result.stderr.splitlines() if line.startswith("    covary render ")]
        stored = [sample["replay"] for sample in json.loads((self.path / "facts.json").read_text())["bad_samples"]]
        self.assertTrue(printed)
        self.assertEqual(printed, stored)
        many = json.loads(self.good("render", name, *strong, "-o", "b.exr", "--estimator", "none", "--spp", "64",
                                    "--seed", "9", "--no-preview", "--quiet", "--json", "-").stdout)
        self.assertGreater(many["not_finite_samples"], 100)
        self.assertEqual(len(many["bad_samples"]), 10, "the first few, however many waves and rounds there were")
        (self.path / "bin").mkdir()
        (self.path / "bin" / "covary").symlink_to(COVARY)
        environment = {**os.environ, "PATH": f"{self.path / 'bin'}:{os.environ['PATH']}"}
        for command in printed[:2]:
            replayed = subprocess.run(command, shell=True, cwd=self.path, env=environment, capture_output=True,
                                      text=True)
            self.assertEqual(replayed.returncode, 0, replayed.stderr)
            self.assertIn("radiance (inf, inf, inf)", replayed.stdout)


class Numbers(RenderTest):
    def test_times_are_finite(self):
        for option in ("--time", "--checkpoint"):
            for value in ("nan", "inf", "-inf", "-1", "1e999"):
                message = self.bad(2, option, "render", ROOM, *SMALL, "-o", "a.exr", f"{option}={value}").stderr
                self.assertIn(value, message)
                self.assertLess(len(message), 120)
        self.bad(2, "--time", "render", ROOM, *SMALL, "-o", "a.exr", "--time", "0")


    def test_depths_without_light(self):
        (self.path / "long.xml").write_text(re.sub("(<integrator[^>]*>)", r'\1<integer name="min_depth" value="4"/>',
                                                   Path(ROOM).read_text()))
        for scene, depth, said in ((ROOM, "0", "paths of max_depth 0 have no light; 1 shows lights"), (ROOM, "1", None),
                                   ("long.xml", "3", "no path has min_depth 4 edges and not more than max_depth 3")):
            errors = self.good("render", scene, *SMALL, "-o", "a.exr", "--spp", "8", "--overwrite", "--max-depth",
                               depth).stderr
            self.assertEqual("the image is black" in errors, said is not None, errors)
            self.assertIn(said or "", errors)


class Memory(RenderTest):
    def test_more_than_there_is(self):
        start = time.monotonic()
        self.bad(2, "65536 x 65536 pixels need 50.5 TB of memory", "render", ROOM, "-o", "a.exr", "--resolution",
                 "65536x65536", "--spp", "48", "--groups", "480", *IICV)
        self.assertLess(time.monotonic() - start, 5 * SLOWDOWN)

    def test_known_beforehand(self):
        info = json.loads(self.good("info", ROOM, "--json").stdout)
        width, height = info["frame"]
        self.assertEqual(info["memory_bytes"]["none"], width * height * (12 + 4 + 12))
        self.assertIn("memory of a render beside the scene: ", self.good("info", ROOM).stdout)

    @unittest.skipIf("SANITIZED" in os.environ, "sanitizers take memory of their own")
    def test_the_program_takes_about_as_much(self):
        """The difference between a large and a small image, in which program and scene cancel."""
        for estimator, groups in (("none", 4), ("iicv", 4), ("iicv", 12), ("cv-baseline", 4), ("iduw", 4)):
            with self.subTest(estimator, groups=groups):
                planned, taken = [], []
                for resolution in ("80x60", "1000x750"):
                    facts = json.loads(self.good(
                        "render", ROOM, "--resolution", resolution, "--quiet", "-o", "a.exr", "--json", "-",
                        "--estimator", estimator, "--max-depth", "1", "--groups", str(groups),
                        "--spp", str(2 * groups)).stdout)
                    planned.append(facts["planned_memory_bytes"])
                    taken.append(facts["peak_memory_bytes"])
                self.assertGreater(planned[1] - planned[0], 0.7 * (taken[1] - taken[0]))
                self.assertLess(planned[1] - planned[0], 1.5 * (taken[1] - taken[0]))


class AuxiliaryImages(RenderTest):
    def test_timed_as_rendering(self):
        times = []
        for options in ((), ("--aovs",)):
            facts = json.loads(self.good("render", ROOM, "--resolution", "400x300", "--quiet", "--no-preview", "-o",
                                         "a.exr", "--spp", "1", "--estimator", "none", "--max-depth", "0", "--json",
                                         "-", *options).stdout)
            times.append(facts["seconds"]["render"] - facts["passes"][0]["seconds"])
        self.assertEqual(times[0], 0)
        self.assertGreater(times[1], 0.001)


if __name__ == "__main__":
    unittest.main()
