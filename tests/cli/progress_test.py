# SPDX-License-Identifier: Apache-2.0
"""The line of progress, as a terminal shows it: what is done, how far it is, and nothing that stays."""
import json
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
        text = self.shown(*RENDER, "--spp", "8", "-o", "a.exr", "--oidn", "off")
        self.in_order(text, "room: loading", "room: auxiliary images", "room: samples", "room: denoising",
                      "room: writing", "\r\033[K", "a.exr: ")
        self.assertNotIn("training", text)
        self.assertNotIn("room: ", text[text.index("a.exr: "):])
        text = self.shown(*RENDER, "--spp", "8", "--denoise", "balanced", "--integrator", "guided-path",
                          "--set", "guiding-train=4", "-o", "b.exr")
        self.in_order(text, "loading", "training", "auxiliary images", "samples", "denoising", "writing")
        text = self.shown(*RENDER, "--estimator", "iicv", "--spp", "8", "-o", "c.exr", "--passes", "films")
        self.in_order(text, "loading", "samples", "combining", "writing")
        text = self.shown("combine", "--crn", "films/crn.exr", "--independent", "films/independent.exr", "-o", "d.exr")
        self.in_order(text, "d: loading", "d: estimating", "d: writing", "d.exr: ")

    def test_the_time_left_is_that_of_all_phases(self):
        """Also before their numbers are known; of a sequence, of all of its frames, which are named."""
        text = self.shown(*RENDER[:2], "--resolution", "480x320", "--spp", "16", "--no-preview", "--oidn", "off", "-o",
                          "a.exr")
        for phase in ("auxiliary images", "samples"):
            self.assertRegex(text, rf"room: {phase} (?:\[[ =]+\])? +\d+ %  \d+:\d\d left")
        text = self.shown(*RENDER, "--spp", "8", "--estimator", "none", "--frames", "2-4", "-o", "f_#.exr")
        self.in_order(text, "frame 2 (1 of 3): samples", "frame 2 (1 of 3): f_2.exr in ", "frame 4 (3 of 3): samples",
                      "f_#.exr: 3 frames", "\ntime: ", "\nnext: `covary convert 'f_#.exr' video.mp4` makes a video")
        text = self.shown(*RENDER, "--spp", "8", "--estimator", "none", "--frames", "2-5", "-o", "f_#.exr", "--resume")
        self.in_order(text, "f_4.exr: complete", "f_#.exr: 1 of 4 frames; the others were there",
                      "\nnext: `covary convert")

    def test_the_time_left_counts_on_the_processors_that_are_to_be_had(self):
        """Eight threads on one processor: denoising takes as long by the clock as processor time, and not an eighth."""
        processors = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {min(processors)})
        self.addCleanup(os.sched_setaffinity, 0, processors)
        text = self.shown(*RENDER[:2], "--resolution", "480x300", "--spp", "1", "--no-preview", "--oidn", "off",
                          "--threads", "8", "-o", "a.exr")
        self.assertGreaterEqual(int(re.search(r"room: denoising  0:(\d\d) left", text)[1]), 1, text)

    def test_the_error_that_is_reached_is_shown_with_its_bounds(self):
        text = self.shown(*RENDER, "--estimator", "iicv", "--until", "relmse=0.003", "-o", "a.exr", columns=120)
        self.in_order(text, "samples", "  goal relMSE 0.003", "combining", "samples  relMSE ", ", goal 0.003",
                      "combining", "writing")
        known = r"  relMSE ([0-9.e-]+) \((?:([0-9.e-]+) to ([0-9.e-]+)|unreliable)\), goal 0.003"
        reached = [float(x) for x, _, _ in re.findall(known, text)]
        self.assertGreater(reached[0], 0.003)
        self.assertLessEqual(reached[-1], 0.003)
        bounds = [tuple(map(float, found)) for found in re.findall(known, text) if found[1]]
        self.assertTrue(bounds, text)
        self.assertTrue(all(low < middle < high for middle, low, high in bounds), bounds)
        self.assertRegex(text, r"\d %  at least \d+:\d\d left  relMSE ")
        text = self.shown(*RENDER, "--estimator", "iicv", "--spp", "48", "-o", "b.exr", columns=120)
        self.assertRegex(text, r"writing  relMSE [0-9.e-]+ \([^)]+\)(?!, goal)")

    def test_the_line_fits_the_terminal(self):
        text = self.shown(*RENDER, "--spp", "96", "--oidn", "off", "-o", "a.exr", columns=30)
        lines = [line.replace("\033[K", "") for line in text[:text.index("a.exr: ")].split("\r")]
        self.assertGreater(len(lines), 3)
        self.assertLess(max(map(len, lines)), 30, lines)

    def test_silence(self):
        self.assertEqual(self.shown(*RENDER, "--spp", "8", "-o", "a.exr", "--quiet"), "")
        done = self.good(*RENDER, "--spp", "8", "-o", "b.exr")
        self.assertNotRegex(done.stderr, "\r|room: ")


class Summary(CliTest):
    """The lines at the end."""

    def said(self, *arguments):
        return self.good(*RENDER[:2], "--resolution", "120x80", "--oidn", "off", *arguments).stderr

    def test_four_lines(self):
        lines = self.said("--spp", "16", "-o", "a.exr", "--json", "a.json").splitlines()
        facts = json.loads((self.path / "a.json").read_text())
        self.assertEqual(lines[-4], "a.exr: 120 x 80 pixels, 16 samples per pixel; a.png to look at")
        self.assertRegex(lines[-3], r"^time: [\d.]+ s: ((loading|auxiliary images) [\d.]+ s, .*)?samples [\d.]+ s")
        left = re.match(r"how good: about ([\d.]+) % (?:grain|error) left; a new render of `--spp 64` leaves about "
                        r"([\d.]+) %$",
                        lines[-2])
        self.assertTrue(left, lines[-2])
        percent = 100 * facts["predicted_relmse"] ** 0.5
        self.assertAlmostEqual(float(left[1]) / percent, 1, delta=0.06)
        self.assertAlmostEqual(float(left[2]) / percent, 0.5 ** 0.5, delta=0.06)
        hint = r"next: `--until relmse=([\de.-]+) --overwrite` instead of --spp renders until half of it is left"
        goal = float(re.fullmatch(hint, lines[-1])[1])
        self.assertAlmostEqual(goal / facts["predicted_relmse"], 0.25, delta=0.13)
        self.assertNotIn("predicted relMSE", "".join(lines))
        said = self.said("--spp", "16", "-o", "a.exr", "--verbose")
        self.assertRegex(said, r"(?m)^predicted relMSE .* % of it squared bias; the mean of the samples has ")
        self.assertRegex(said, r"(?m)^load [\d.]+ s, build [\d.]+ s, render [\d.]+ s \(.* samples/s, .* rays/s\)$")

    def test_the_mean_is_halved_by_four_times_the_samples(self):
        said = self.good(*RENDER, "--spp", "16", "--estimator", "none", "--groups", "8", "-o", "a.exr").stderr
        self.assertRegex(said, r"(?m)^how good: about [\d.]+ % grain left( \(unsure.*\))?; "
                               "`--resume --spp 64` halves it$")
        self.assertRegex(self.good(*RENDER, "--spp", "16", "--estimator", "none", "-o", "b.exr").stderr,
                         "(?m)^how good: unknown, as no error is predicted here$")

    def test_a_picture_that_is_mostly_black_is_told(self):
        """An error in relation to what is bright says nothing of a camera that looks past the scene."""
        (self.path / "far.xml").write_text(
            '<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"><film type="hdrfilm">'
            '<integer name="width" value="40"/><integer name="height" value="30"/></film></sensor>'
            '<shape type="sphere"><point name="center" x="0" y="0" z="40"/><emitter type="area"/></shape></scene>')
        said = self.good("render", "far.xml", "--spp", "16", "-o", "a.exr").stderr
        self.assertRegex(said, r"(?m)^how good: 9\d % of the picture is black, as if the camera saw next to nothing "
                               r"that is lit; of the whole, (about|at most) ")

    def test_the_json_has_every_phase(self):
        self.said("--spp", "16", "-o", "a.exr", "--json", "a.json")
        seconds = json.loads((self.path / "a.json").read_text())["seconds"]
        phases = ("load", "build", "train", "trial", "auxiliary", "samples", "estimate", "write")
        self.assertAlmostEqual(sum(seconds[phase] for phase in phases), seconds["total"], 6)
        self.assertAlmostEqual(seconds["auxiliary"] + seconds["samples"], seconds["render"], 6)
        self.assertTrue(all(seconds[phase] > 0 for phase in ("auxiliary", "samples", "estimate", "write", "processor")))

    def test_options_that_do_little_are_told(self):
        self.assertIn("note: around 16 independent samples per pixel, --denoise balanced is nearly the same as auto; "
                      "for less bias take 64 or more, or --estimator iicv with --denoise balanced",
                      self.said("--spp", "16", "--denoise", "balanced", "-o", "a.exr"))
        self.assertIn("note: with 16 samples per pixel, --estimator iicv is blotchy; take 48 or more, or leave "
                      "--estimator out", self.good(*RENDER, "--spp", "16", "--estimator", "iicv", "-o", "b.exr").stderr)
        self.assertNotIn("note: ", self.said("--spp", "64", "--denoise", "balanced", "-o", "c.exr"))

    def test_few_bright_pixels_are_not_grain_everywhere(self):
        """A tiny lamp inside glass lights a wall that is lit evenly: a path in thousands finds it."""
        (self.path / "rare.xml").write_text("""<scene version="3.0.0"><integrator type="path"/>
            <sensor type="perspective"><float name="fov" value="40"/><transform name="to_world">
              <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform></sensor>
            <emitter type="constant"/>
            <shape type="rectangle"><transform name="to_world"><scale value="3"/></transform></shape>
            <shape type="sphere"><point name="center" x="0" y="0" z="7"/><float name="radius" value="0.5"/>
              <bsdf type="dielectric"/></shape>
            <shape type="sphere"><point name="center" x="0" y="0" z="7"/><float name="radius" value="0.05"/>
              <emitter type="area"><rgb name="radiance" value="10000"/></emitter></shape></scene>""")
        ways = set()
        for seed in range(4):
            said = self.good("render", "rare.xml", "--resolution", "128x96", "--spp", "4", "--oidn", "off", "-o",
                             "a.exr", "--no-preview", "--json", "a.json", "--overwrite", "--seed", str(seed)).stderr
            facts = json.loads((self.path / "a.json").read_text())
            few = facts["predicted_relmse"] > 4 * facts["predicted_relmse_p95"]
            error = facts["predicted_relmse_p95" if few else "predicted_relmse"]
            ways.add(few)
            kind = "error" if facts.get("predicted_bias_share", 0) > 0.5 else "grain"
            self.assertIn(f"how good: {'at most' if few else 'about'} {100 * error ** 0.5:.2g} % {kind} left"
                          f"{' in 95 % of the picture, more in few bright pixels' if few else ''} (unsure", said)
        self.assertEqual(ways, {False, True})

    def made(self, name, *options):
        """-o and the name of an image that is rendered with these options."""
        self.assertEqual(self.run_covary(*RENDER, *options, "-o", name).returncode, 0)
        return "-o", name

    def test_what_changes_the_scene_is_named(self):
        plain = ("--spp", "1", "--estimator", "none")
        output = self.made("a.exr", *plain)
        for option, value, told in (("--camera", "auto", "camera default, now auto"),
                                    ("--environment", "sky", "environment default, now sky"),
                                    ("--background", "1", "background default, now 1"),
                                    ("-D", "max_depth=3", "define default, now max_depth=3")):
            self.bad(1, f"'a.exr' was rendered with other settings ({told}); ", *RENDER, *plain, *output, option, value)
        (self.path / "room.xml").write_text(Path(ROOM).read_text().replace("0.78", "0.77"))
        self.bad(1, "'a.exr' was rendered with other settings (another scene, or a changed one); ", "render",
                 "room.xml", *RENDER[2:], *plain, *output)
        text = Path(ROOM).read_text()
        (self.path / "path.json").write_text(json.dumps({"keyframes": [{"time": 0, "to_world": [
            [-1, 0, 0, 0.5], [0, 1, 0, 1.3], [0, 0, -1, 3.5], [0, 0, 0, 1]]}]}))
        frames = (*RENDER, *plain, "--frames", "1", "-o", "f_#.exr")
        self.assertEqual(self.run_covary(*frames).returncode, 0)
        self.bad(1, "'f_1.exr' was rendered with other settings (another place of the camera); ", *frames,
                 "--camera-path", "path.json")
        moving = text.replace("</scene>", """<shape type="sphere"><animation name="to_world">
            <transform time="1"><translate x="0"/></transform><transform time="2"><translate x="1"/></transform>
            </animation></shape></scene>""")
        (self.path / "moving.xml").write_text(moving)
        frames = ("render", "moving.xml", *RENDER[2:], *plain, "--frames", "2", "-o", "m_#.exr")
        self.assertEqual(self.run_covary(*frames).returncode, 0)
        self.bad(1, "'m_2.exr' was rendered with other settings (time 2, now 1); ", *frames, "--fps", "2")

    def test_images_of_other_settings_are_not_replaced(self):
        first = (*RENDER, "--spp", "4", "--estimator", "none", "-o", "a.exr")
        for _ in range(2):  # the same may be made again
            self.assertEqual(self.run_covary(*first).returncode, 0)
        self.bad(1, "'a.exr' was rendered with other settings (seed default, now 2; spp 4, now 8); give another "
                    "name, or --overwrite to replace it", *RENDER, "--spp", "8", "--estimator", "none", "-o", "a.exr",
                 "--seed", "2")
        self.assertEqual(self.run_covary(*RENDER, "--spp", "8", "--estimator", "none", "-o", "a.exr",
                                         "--overwrite").returncode, 0)
        self.bad(1, "--resume: 'b.exr' was rendered with other settings (estimator none, now default)", *RENDER,
                 *self.made("b.exr", "--spp", "4", "--estimator", "none"), "--spp", "4", "--resume")
        self.bad(1, "--resume: 'd.exr' was rendered with other settings (spp 8, now 4), and its samples were not kept "
                 "(--passes); give another name, or --overwrite to replace it", *RENDER,
                 *self.made("d.exr", "--spp", "8", "--oidn", "off"), "--oidn", "off", "--spp", "4", "--resume")
        again = (*RENDER, "-o", "d.exr", "--oidn", "off", "--resume")
        self.assertIn("d.exr: complete, with a predicted relMSE of 0.", self.good(*again, "--spp", "8").stderr)
        before = (self.path / "d.exr").read_bytes()
        for more in (("--spp", "12"), ("--until", "relmse=1e-9", "--spp", "12")):
            self.bad(1, "--resume: the samples of 'd.exr' were not kept (--passes); --overwrite instead of --resume "
                     "renders all", *again, *more)
        self.assertEqual((self.path / "d.exr").read_bytes(), before)
        self.bad(1, "--resume: 'c.exr' was rendered with other settings (estimator default, now none)", *RENDER,
                 *self.made("c.exr", "--spp", "4"), "--spp", "4", "--estimator", "none", "--resume")
        frames = (*RENDER, "--spp", "4", "--estimator", "none", "--frames", "1-2", "-o", "f_#.exr")
        for _ in range(2):
            self.assertEqual(self.run_covary(*frames).returncode, 0)
        self.bad(1, "'f_1.exr' was rendered with other settings (max-depth default, now 3); ", *frames, "--max-depth",
                 "3")
        self.bad(1, "--resume: 'f_1.exr' is not a frame of this command (max-depth default, now 3); --overwrite "
                    "instead of --resume replaces it", *frames, "--max-depth", "3", "--resume")


if __name__ == "__main__":
    unittest.main()
