# SPDX-License-Identifier: Apache-2.0
"""render(): the values of `covary render`, limits, interruption."""
import signal
import subprocess
import sys
import unittest

import covary
import numpy
from common import ROOM, PackageTest, rgb

SIZE, TEXT = (36, 24), "36x24"


class Render(PackageTest):
    def scene(self, **keywords):
        return covary.Scene.load(ROOM, resolution=SIZE, **keywords)

    def program_image(self, *words):
        self.run_program("render", ROOM, "-o", "out.exr", "--resolution", TEXT, "--no-preview", "--quiet", *words)
        return rgb(self.path / "out.exr")

    def same(self, result, *words):
        self.assert_same_bits(result.image.reshape(-1, 3), self.program_image(*words))

    def test_bits_of_the_program(self):
        scene = self.scene()
        result = covary.render(scene, spp=24)
        self.same(result, "--spp", 24)
        self.assertEqual(sorted(result.films), ["crn", "independent"])
        self.assertEqual((result.samples_per_pixel, result.complete, result.estimator), (24, True, "iicv"))
        self.same(covary.render(scene, 6, "none", seed=5, filter="tent"), "--spp", 6, "--estimator", "none", "--seed",
                  5, "--rfilter", "tent")
        self.same(covary.render(scene, 24, "iicv", k=9, split=(1, 2), groups=4), "--spp", 24, "--k", 9, "--split",
                  "1:2", "--groups", 4)
        self.same(covary.render(scene, 8, "none", sampler="sobol"), "--spp", 8, "--estimator", "none", "--sampler",
                  "sobol")
        self.same(covary.render(scene, 24, integrator="controlled-path", aovs=True), "--spp", 24, "--integrator",
                  "controlled-path", "--aovs")

    def test_bidirectional_with_properties(self):
        scene = self.scene(integrator="bdpt", integrator_options={"light_paths": 2.0}, max_depth=3)
        self.same(covary.render(scene, 8, "none"), "--spp", 8, "--estimator", "none", "--integrator", "bdpt",
                  "--light-paths", 2, "--max-depth", 3)

    def test_until(self):
        result = covary.render(self.scene(), spp=400, until=0.05)
        self.assertTrue(result.until_reached)
        self.assertLessEqual(result.predicted_relmse, 0.05)
        self.assertLess(result.samples_per_pixel, 400)

    def test_films_only(self):
        whole, films = (covary.render(self.scene(), 24, films_only=only) for only in (False, True))
        for name in ("crn", "independent"):
            self.assert_same_bits(whole.films[name].groups, films.films[name].groups)
        self.assertEqual((films.std_error, films.estimator), (None, "none"))
        numpy.testing.assert_allclose(films.image, sum(film.mean for film in films.films.values()) / 2, rtol=1e-5)

    def test_scene(self):
        scene = self.scene()
        self.assertEqual((scene.resolution, scene.path, scene.integrator), (SIZE, str(ROOM), "path"))
        self.assertIs(scene.with_integrator(""), scene)
        self.assertEqual(scene.with_integrator("bdpt").integrator, "bdpt")
        self.assertIn("36 x 24", repr(scene))
        self.assertEqual(len(scene.content_hash), len(self.scene().content_hash))

    def test_files_and_resume(self):
        whole = covary.render(self.scene(), spp=48)
        out, passes = self.path / "a.exr", self.path / "passes"
        covary.render(self.scene(), spp=24, output=out, passes=passes, groups=12)
        resumed = covary.render(self.scene(), spp=48, output=out, passes=passes, groups=12, resume=True)
        self.assert_same_bits(whole.image, resumed.image)
        self.assert_same_bits(resumed.image.reshape(-1, 3), rgb(out))
        self.assertIn("seed", covary.Film.load(str(passes / "crn.exr")).attributes)

    def test_progress(self):
        seen = []
        covary.render(self.scene(), spp=24, progress=lambda done, total: seen.append((done, total)))
        self.assertEqual(seen[-1][0], seen[-1][1])

    def test_errors(self):
        scene = self.scene()
        for words, keywords in (
                (["--integrator", "pth"], {"integrator": "pth"}),
                (["--crop", "1,2,3,400"], {"crop": (1, 2, 3, 400)}),
                (["--estimator", "iduw", "--until", "relmse=0.1"], {"estimator": "iduw", "until": 0.1})):
            message = self.message_of(covary.UsageError, covary.render, scene, spp=8, **keywords)
            self.assertGreater(len(message), 10, words)
        self.assertIn("did you mean 'path'?",
                      self.message_of(covary.UsageError, covary.render, scene, integrator="pth"))
        self.assertEqual(self.message_of(covary.IoError, covary.render, "nix.xml"),
                         self.failure_of_program("render", "nix.xml", "-o", "x.exr"))
        self.assertIn("accepted are bool, int, float and str",
                      self.message_of(TypeError, self.scene, integrator_options={"x": []}))
        (self.path / "bad.xml").write_text("<scene version='3.0.0'><shape type='cub'/></scene>")
        self.assertEqual(self.message_of(covary.InputError, covary.Scene.load, self.path / "bad.xml"),
                         self.failure_of_program("render", self.path / "bad.xml", "-o", "x.exr"))


LONG = """
import covary, signal, sys, threading, os
scene = covary.Scene.load(sys.argv[1], resolution=(36, 24))
calls = []
def progress(done, total):
    calls.append(done)
    if len(calls) == 2:
        os.kill(os.getpid(), signal.SIGINT)
try:
    covary.render(scene, spp=1 << 24, output=sys.argv[2], progress=progress)
except KeyboardInterrupt:
    print("interrupted")
"""


class Interruption(PackageTest):
    def test_ctrl_c(self):
        """Ends a render that would take hours, and what there is was kept."""
        out = self.path / "out.exr"
        run = subprocess.run([sys.executable, "-c", LONG, ROOM, out], capture_output=True, text=True, timeout=100,
                             check=False, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
        self.assertEqual((run.stdout, run.stderr), ("interrupted\n", ""))
        self.assertEqual(covary.read_image(out).shape, (24, 36, 3))

    def test_progress_that_raises(self):
        def fail(done, total):
            raise ValueError("enough")
        scene = covary.Scene.load(ROOM, resolution=SIZE)
        self.assertEqual(self.message_of(ValueError, covary.render, scene, 1 << 24, progress=fail), "enough")


if __name__ == "__main__":
    unittest.main()
