# SPDX-License-Identifier: Apache-2.0
"""Light passes, as a user runs them: bidirectional path tracing of a small caustic."""
import json
import os
import signal
import subprocess
import time
import unittest
from pathlib import Path

from cli_test import COVARY, SLOWDOWN, CliTest
from exr_reader import read_exr

CAUSTIC = str(Path(os.environ["SCENES"]) / "caustic.xml")
SMALL = ("--resolution", "32x24", "--quiet", "--no-preview")
IICV = ("--estimator", "iicv")
PIXELS = 32 * 24


class LightTest(CliTest):
    def render(self, *arguments):
        return json.loads(self.good("render", CAUSTIC, *SMALL, "--json", "-", *arguments).stdout)

    def channels(self, name):
        return read_exr((self.path / name).read_bytes())

    def attributes(self, name):
        return json.loads(self.good("info", name, "--json").stdout)["attributes"]

    def assert_sum(self, name, *parts):
        """The image is the sum of the others, but for rounding."""
        whole, summands = self.channels(name), [self.channels(part) for part in parts]
        for c in "RGB":
            for value, *values in zip(whole[c], *(s[c] for s in summands)):
                self.assertAlmostEqual(value, sum(values), delta=1e-5 * (1 + abs(value)))


class Render(LightTest):
    def test_a_plain_render_traces_light(self):
        facts = self.render("-o", "a.exr", "--estimator", "none", "--spp", "8", "--passes", "films")
        self.assertEqual(facts["light_paths"], 8 * PIXELS)
        self.assertEqual([p.get("light_paths") for p in facts["passes"]], [None, 8 * PIXELS])
        self.assertEqual(facts["samples"], 8 * PIXELS)
        self.assertEqual(sorted(p.name for p in (self.path / "films").iterdir()),
                         ["independent.exr", "independent.json", "light.exr", "light.json"])
        self.assert_sum("a.exr", "films/independent.exr", "films/light.exr")
        self.assertEqual(self.attributes("films/light.exr")["covary:light_paths_per_sample"], "256")
        self.assertEqual(self.attributes("a.exr")["covary:light_film"], "added")
        facts = self.render("-o", "c.exr", "--estimator", "none", "--spp", "8", "--set", "light-tracing=off")
        self.assertNotIn("light_paths", facts)
        self.assertIn("light_tracing=off", self.attributes("c.exr")["covary:settings"])

    def test_beside_common_random_numbers(self):
        facts = self.render("-o", "off.exr", *IICV, "--spp", "24")
        self.assertNotIn("light_paths", facts)
        facts = self.render("-o", "on.exr", *IICV, "--spp", "24", "--set", "light-tracing=on", "--passes", "films")
        self.assertEqual(facts["light_paths"], 24 * PIXELS)
        self.assertGreater(facts["predicted_relmse"], 0)
        combine = ("combine", "--crn", "films/crn.exr", "--independent", "films/independent.exr", "--error", "--quiet",
                   *IICV)
        self.good(*combine, "--light", "films/light.exr", "-o", "same.exr")
        on, same = self.channels("on.exr"), self.channels("same.exr")
        self.assertEqual(on, same)
        warned = self.good(*combine, "-o", "dark.exr").stderr
        self.assertIn("lacks the light of a light film", warned)
        self.bad(1, "is not a light film", *combine, "--light", "off.exr", "-o", "bad.exr")
        self.bad(1, "is a light film, which --light adds", "combine", "--crn", "films/light.exr", "--independent",
                 "films/independent.exr", "-o", "bad.exr", "--quiet")
        self.bad(2, "are the same file", *combine, "--light", "films/crn.exr", "-o", "bad.exr")

    def test_merge(self):
        for seed in "12":
            self.render("-o", f"{seed}.exr", "--estimator", "none", "--spp", "8", "--seed", seed, "--passes", seed)
        self.good("merge", "1/light.exr", "2/light.exr", "-o", "light.exr")
        one, two, both = (self.channels(n) for n in ("1/light.exr", "2/light.exr", "light.exr"))
        for c in "RGB":
            for a, b, m in zip(one[c], two[c], both[c]):
                self.assertAlmostEqual(m, (a + b) / 2, delta=1e-5 * (1 + m))
        self.good("merge", "1.exr", "2.exr", "-o", "image.exr")
        self.bad(1, "merge each kind alone", "merge", "1/light.exr", "2/independent.exr", "-o", "bad.exr")

    def test_replay(self):
        common = ("render", CAUSTIC, "--resolution", "32x24", "--estimator", "none", "--seed", "4")
        first = self.good(*common, "--replay", "light,0").stdout
        self.assertRegex(first, r"^light path 0, \d+ rays, \d+ splats\n")
        self.assertEqual(self.good(*common, "--replay", "light,0").stdout, first)
        self.bad(2, "there are no light paths", "render", CAUSTIC, *IICV, "--replay", "light,0")

    def test_other_integrators_have_no_such_options(self):
        self.bad(2, "--set light-tracing is an option of --integrator bdpt, not of path", "render", CAUSTIC,
                 "--integrator", "path", "-o", "a.exr", "--set", "light-tracing=on")
        self.bad(2, "--replay light is for integrators that trace light; 'path' does not", "render", CAUSTIC,
                 "--integrator", "path", "-o", "a.exr", "--replay", "light,3")
        self.bad(2, "'yes': expected auto, on, off", "render", CAUSTIC, "-o", "a.exr", "--set", "light-tracing=yes")
        self.assertNotIn("light_paths", self.render("-o", "a.exr", "--integrator", "path", "--spp", "24"))
        # The settings of an integrator that another one replaces are no mistakes.
        element = '<string name="light_tracing" value="on"/></integrator>'
        text = Path(CAUSTIC).read_text().replace("</integrator>", element)
        self.write("own.xml", text.encode())
        self.good("render", "own.xml", *SMALL, "-o", "own.exr", "--spp", "24", "--integrator", "path")
        self.bad(1, "unknown parameter", "render", "own.xml", *SMALL, "-o", "own.exr", "-D", "integrator=path")

    def test_lights_without_area_behind_glass(self):
        text = Path(CAUSTIC).read_text()
        start, end = text.index('  <shape type="disk">'), text.index('  <shape type="rectangle"> <!-- floor')
        lamp = '<emitter type="point"><point name="position" x="1.3" y="2" z="0.3"/></emitter>'
        self.write("point.xml", (text[:start] + lamp + text[end:]).encode())
        lacks = "without light tracing the image lacks visible caustics"
        render = ("render", "point.xml", *SMALL, "-o", "a.exr", *IICV, "--spp", "24")
        self.assertIn(lacks, self.good(*render).stderr)
        self.assertNotIn(lacks, self.good(*render, "--set", "light-tracing=on").stderr)
        self.assertNotIn(lacks, self.good(*render, "--integrator", "path").stderr)
        self.assertNotIn(lacks, self.good("render", CAUSTIC, *SMALL, "-o", "a.exr", *IICV, "--spp", "24").stderr)
        self.assertNotIn(lacks, self.good(*(word for word in render if word not in IICV)).stderr, "it traces light")

    def test_time(self):
        facts = self.render("-o", "a.exr", "--estimator", "none", "--time", "0.5")
        self.assertLess(facts["seconds"]["render"], 3 * SLOWDOWN)
        ratio = facts["light_paths"] / facts["samples"]
        self.assertGreater(ratio, 0.2)
        self.assertLess(ratio, 5)

    def test_interrupted_and_resumed(self):
        arguments = ["render", CAUSTIC, "--resolution", "32x24", "--no-preview", "--estimator", "none", "--spp", "400"]
        self.good(*arguments, "--quiet", "-o", "whole.exr")
        for attempt in range(40):
            process = subprocess.Popen([COVARY, *arguments, "-o", "parts.exr", "--resume"], cwd=self.path,
                                       stderr=subprocess.PIPE, text=True)
            time.sleep((0.1 + 0.07 * attempt) * SLOWDOWN)
            process.send_signal(signal.SIGINT)
            message = process.communicate(timeout=60 * SLOWDOWN)[1]
            if process.returncode == 0:
                break
            self.assertIn(process.returncode, (130, -signal.SIGINT), message)
        self.assertEqual(process.returncode, 0)
        self.assertEqual(self.channels("parts.exr"), self.channels("whole.exr"))
        self.assertFalse((self.path / "parts.passes").exists())


if __name__ == "__main__":
    unittest.main()
