# SPDX-License-Identifier: Apache-2.0
"""covary render with bidirectional path tracing, as a user runs it."""
import re
import unittest

from cli_test import CliTest
from exr_reader import read_exr

SCENE = """<scene version="3.0.0">
<integrator type="bdpt"><integer name="max_depth" value="4"/><string name="light_tracing" value="off"/></integrator>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/>
<rfilter type="box"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate y="1" angle="180"/><translate z="6"/>
</transform></shape>
<shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/>
<translate y="-1" z="4"/></transform></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="90"/>
<translate y="1" z="4"/></transform><emitter type="area"><rgb name="radiance" value="8"/></emitter></shape></scene>
"""


class Bdpt(CliTest):
    def setUp(self):
        super().setUp()
        (self.path / "scene.xml").write_text(SCENE)
        path = SCENE.replace("bdpt", "path").replace('<string name="light_tracing" value="off"/>', "")
        (self.path / "path.xml").write_text(path)

    def render(self, output, *arguments):
        self.good("render", "scene.xml", "-o", output, "--estimator", "none", "--quiet", "--no-preview", *arguments)
        return self.pixels(output)

    def pixels(self, name):
        channels = read_exr((self.path / name).read_bytes())
        return [channels[c] for c in "RGB"]

    def test_a_sample_with_common_random_numbers_is_replayed(self):
        arguments = ("--sampling", "crn", "--spp", "1")
        image = self.render("crn.exr", *arguments)
        printed = self.good("render", "scene.xml", *arguments[:2], "--replay", "7,12,0").stdout
        values = re.search(r"radiance \((.*)\)", printed).group(1).split(", ")
        for channel, value in zip(image, values):
            self.assertAlmostEqual(channel[12 * 24 + 7], float(value), places=6)

    def test_scenes_without_light_are_black(self):
        (self.path / "scene.xml").write_text(re.sub(r"<emitter.*?</emitter>", "", SCENE).replace('value="off"',
                                                                                              'value="auto"'))
        for options in ((), ("--set", "light-tracing=on"), ("--estimator", "none", "--adaptive"),
                        ("--estimator", "iicv"),
                        ("--estimator", "iicv", "--adaptive"), ("--estimator", "dependent-tests"),
                        ("--estimator", "dependent-tests", "--paper"),
                        ("--estimator", "dependent-tests", "--until", "relative=0.1", "--set", "max-spp=9")):
            self.good("render", "scene.xml", "-o", "a.exr", "--spp", "16", "--quiet", "--no-preview", "--environment",
                      "none", *options)
            self.assertEqual({v for channel in self.pixels("a.exr") for v in channel}, {0.0}, options)


if __name__ == "__main__":
    unittest.main()
