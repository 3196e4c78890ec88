# SPDX-License-Identifier: Apache-2.0
"""The commands that repeat one sample: printed for bad samples, they give the values of the films, in every bit. After
training but for the last: vertices are shaded side by side, and GCC 14 fuses other products and sums where there are
few."""
import os
import re
import shlex
import struct
import unittest

from cli_test import CliTest
from exr_reader import read_exr

WIDTH, HEIGHT, GROUPS = 16, 12, 8
CROP = (4, 1, 11, 10)
# A corner of a room and two lights, the smaller of which has texels that take red light away.
SCENE = """<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="4"/></integrator>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/>
<rfilter type="box"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/><scale value="9"/><translate z="3"/>
</transform></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="9"/><translate y="-1"/>
</transform></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><scale value="0.5"/>
<translate y="1.5" z="2"/></transform><emitter type="area"><rgb name="radiance" value="9"/></emitter></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/><scale value="0.2"/>
<translate y="0.6" z="2.9"/></transform><emitter type="area"><texture name="radiance" type="bitmap">
<string name="filename" value="light.pfm"/><boolean name="raw" value="true"/></texture></emitter></shape>
</scene>"""
NUMBER = r"(\S+?)"
COLOUR = rf"\({NUMBER}, {NUMBER}, {NUMBER}\)"


def bits(colour):
    """Of numbers as text, in single precision."""
    return struct.pack("3f", *map(float, colour))


class ReplayTest(CliTest):
    def setUp(self):
        super().setUp()
        texels = [(-1, 2, 2) if (x + y) % 3 == 0 else (2, 2, 2) for y in range(8) for x in range(8)]
        self.write("light.pfm", b"PF\n8 8\n-1.0\n" + struct.pack("<192f", *sum(texels, ())))
        self.write("scene.xml", SCENE.encode())

    def render(self, *options, training=0):
        """Makes films of one sample in each group. Of each bad sample what it is, its pixel, value and command."""
        passes = 1 if "none" in options else 2
        result = self.good("render", "scene.xml", *options, "--spp", str(GROUPS * passes + training), "--groups",
                           str(GROUPS), "--seed", "5", "-o", "a.exr", "--no-preview", "--quiet", "--passes", "films",
                           "--overwrite")
        found = re.finditer(rf"  pixel \((\d+), (\d+)\), (sample|light path) \d+: {COLOUR}\n    (.*)", result.stderr)
        return [(match[3], match.group(1, 2), match.group(4, 5, 6), match[7]) for match in found]

    def assert_same(self, replayed, value, training, message):
        """Both are colours as texts or numbers."""
        if not training:
            self.assertEqual(bits(replayed), bits(value), message)
            return
        for ours, other in zip(map(float, replayed), map(float, value), strict=True):
            self.assertAlmostEqual(ours, other, delta=2e-7 * abs(other), msg=message)

    def replayed(self, words):
        return self.good(*words).stdout

    def value(self, words):
        return re.search(f"radiance {COLOUR}\n", self.replayed(words)).groups()

    def check(self, *options, drop=(), training=0):
        """Bad samples have their values, and other samples those of the films, with the same command. Without `drop`,
        which makes samples bad, too."""
        crop = CROP if "--crop" in options else (0, 0, WIDTH, HEIGHT)
        commands = {}
        for what, pixel, value, command in self.render(*options, *drop, training=training):
            words = shlex.split(command)[1:]
            if what == "light path":
                if "light" not in commands:
                    splats = re.findall(rf"pixel \((\d+), (\d+)\): {COLOUR}\n", self.replayed(words))
                    self.assertIn((pixel, bits(value)), [(splat[:2], bits(splat[2:])) for splat in splats])
                    commands["light"] = None
                continue
            film = words[words.index("--sampling") + 1]
            if film not in commands:
                self.assertEqual(bits(self.value(words)), bits(value), command)
                commands[film] = words
        commands.pop("light", None)
        self.assertEqual(len(commands), 1 if "none" in options else 2, "films with bad samples")
        if drop:
            self.render(*options, training=training)
        for film, words in commands.items():
            if drop:  # an option and its value
                at = words.index(drop[-1])
                del words[at - 1:at + 1]
            channels = read_exr((self.path / "films" / f"{film}.exr").read_bytes())
            for x, y, sample in ((crop[0] + 1, crop[1] + 2, 1), (13, 9, GROUPS - 1)):
                at = (y - crop[1]) * crop[2] + x - crop[0]
                words[words.index("--replay") + 1] = f"{x},{y},{sample}"
                self.assert_same(self.value(words), [channels[f"group{sample:02}.{c}"][at] for c in "RGB"], training,
                                 (film, *words))

    def check_all(self, *options, **more):
        cropped, sobol = ("--crop", ",".join(map(str, CROP))), ("--sampler", "sobol")
        for choice in (("none",), ("none", *cropped, *sobol), ("iicv", *cropped), ("iicv", *sobol)):
            with self.subTest(choice=choice):
                self.check(*options, "--estimator", *choice, **more)


class Path(ReplayTest):
    def test_samples_of_films(self):
        self.check_all()

    def test_without_a_film_named(self):
        """The sample of each film of the estimator."""
        for estimator in ("iicv", "dependent-tests"):
            self.render("--estimator", estimator)
            replayed = self.replayed(["render", "scene.xml", "--estimator", estimator, "--seed", "5", "--replay",
                                      "3,4,2"])
            values = re.findall(rf"(\S+): pixel \(3, 4\), sample 2, .*\nradiance {COLOUR}\n", replayed)
            self.assertEqual([film for film, *_ in values], ["crn", "independent"])
            for film, *value in values:
                channels = read_exr((self.path / "films" / f"{film}.exr").read_bytes())
                self.assertEqual(bits(value), bits(channels[f"group02.{c}"][4 * WIDTH + 3] for c in "RGB"))


class Bdpt(ReplayTest):
    def test_samples_of_films(self):
        self.check_all("--integrator", "bdpt")


class ControlledPath(ReplayTest):
    def test_samples_of_films(self):
        # With control variates samples may be negative.
        self.check_all("--integrator", "controlled-path", "--set", "cv-train=8", "--set", "lights=learned",
                       drop=("--set", "cv=off"), training=8)


class GuidedPath(ReplayTest):
    def test_samples_of_films(self):
        self.check_all("--integrator", "guided-path", "--set", "guiding-train=8", training=8)

    def test_with_control_variates(self):
        self.check("--integrator", "guided-path", "--set", "guiding-train=8", "--crop", ",".join(map(str, CROP)),
                   "--estimator", "iicv", training=8)


if __name__ == "__main__":
    unittest.main()
