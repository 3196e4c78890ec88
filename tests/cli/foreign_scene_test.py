# SPDX-License-Identifier: Apache-2.0
"""Scenes of forks of Mitsuba: what is refused, what info says of it, and --ignore-unknown; filters with negative lobes
in whole renders."""
import sys
import unittest

from cli_test import CliTest
from exr_reader import read_exr

CAMERA = """<sensor type="perspective"><float name="fov" value="30"/><transform name="to_world">
<lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform><film type="hdrfilm"><integer name="width" value="24"/>
<integer name="height" value="16"/></film></sensor>"""


class ForeignScenes(CliTest):
    def scene(self, name, body):
        return self.write(name, f'<scene version="3.0.0">\n{CAMERA}\n{body}</scene>'.encode())

    def render(self, scene, *more):
        estimator = () if "--estimator" in more else ("--estimator", "none")
        self.good("render", scene, "-o", "out.exr", "--overwrite", "--quiet", "--denoise", "none", *estimator, *more)
        image = read_exr((self.path / "out.exr").read_bytes())
        return [image[c] for c in "RGB"]

    def test_unknown_integrator(self):
        name = self.scene("s.xml", '<integrator type="manylights"><integer name="photons" value="9"/>'
                                   '<integer name="max_depth" value="2"/></integrator><emitter type="constant"/>')
        for command in (("render", name, "-o", "x.exr"), ("info", name)):
            self.bad(1, "--integrator path renders the scene by path tracing", *command)
        self.good("info", name, "--ignore-unknown")
        for words in (["--ignore-unknown"], ["--integrator", "path"]):
            for channel in self.render(name, "--spp", "2", *words):
                self.assertTrue(all(value == 1 for value in channel))

    def test_ignored_parameters_change_nothing(self):
        plain = '<shape type="sphere"><bsdf type="diffuse"/></shape><emitter type="constant"/>'
        fork = plain.replace('<bsdf type="diffuse"/>', '<bsdf type="lacquer"><rgb name="tint" value="1 0 0"/></bsdf>')
        images = [self.render(self.scene(f"{i}.xml", body), "--spp", "4", "--ignore-unknown")
                  for i, body in enumerate((plain, fork))]
        self.assertEqual(*images)
        self.assertIn("warning: ", self.good("info", "1.xml", "--ignore-unknown").stderr)

    def test_lobes_keep_the_mean(self):
        """A picture of the constant 1 stays 1 on the mean: 384 pixels of 64 samples whose weights have a variance of
        0.3 (mitchell) to 0.9 (lanczos), five standard errors of 0.006 at most."""
        name = self.scene("white.xml", '<emitter type="constant"/>')
        for rfilter in ("mitchell", "catmullrom", "lanczos"):
            for estimator in ("none", "iicv"):
                image = self.render(name, "--spp", "64", "--rfilter", rfilter, "--sampler", "independent",
                                    "--estimator", estimator)[1]
                self.assertAlmostEqual(sum(image) / len(image), 1, delta=0.03, msg=(rfilter, estimator))
                self.assertGreater(max(image), 1.001)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]] + sys.argv[1:])
