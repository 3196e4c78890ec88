# SPDX-License-Identifier: Apache-2.0
"""render(): the values of `covary render`, limits, interruption."""
import dataclasses
import json
import math
import os
import signal
import subprocess
import sys
import unittest
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import covary
import numpy
from common import PROGRAM, ROOM, SOURCE, PackageTest, rgb

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
        result = covary.render(scene, spp=24, oidn="off")
        self.same(result, "--spp", 24, "--oidn", "off")
        self.assertEqual(result.estimator, "mixture --denoise auto --oidn off")
        self.assertEqual(sorted(result.films), ["independent"])
        self.assertLess(result.predicted_relmse, result.risks["mean"])
        self.assertIn("known to a factor of ", result.prediction_doubt)
        low, high = result.predicted_bounds
        self.assertTrue(0 < low < result.predicted_relmse < high)
        self.assertEqual(("regression" in result.risks, 0 <= result.bias_share < 1, result.network), (True, True, ""))
        self.assertEqual(covary.render(scene, spp=4, denoise="none").estimator, "none")
        result = covary.render(scene, 24, "iicv")
        self.same(result, "--spp", 24, "--estimator", "iicv")
        self.assertEqual((result.risks, result.bias_share), ({}, None))
        self.assertEqual(sorted(result.films), ["crn", "independent"])
        self.assertEqual((result.samples_per_pixel, result.complete, result.estimator), (24, True, "iicv"))
        # Nothing keeps fireflies out of the image of iicv.
        self.assertIn("no interval can be given: ", result.prediction_doubt)
        self.assertIsNone(result.predicted_bounds)
        self.same(covary.render(scene, 6, "none", seed=5, filter="tent"), "--spp", 6, "--estimator", "none", "--seed",
                  5, "--rfilter", "tent")
        self.same(covary.render(scene, 24, "iicv", k=9, split=(1, 2), groups=4), "--spp", 24, "--estimator", "iicv",
                  "--set", "k=9", "--split", "1:2", "--groups", 4)
        self.same(covary.render(scene, 8, "none", sampler="sobol"), "--spp", 8, "--estimator", "none", "--sampler",
                  "sobol")
        self.same(covary.render(scene, 24, "iicv", integrator="controlled-path", aovs=True), "--spp", 24,
                  "--estimator", "iicv", "--integrator", "controlled-path", "--aovs")

    def test_bidirectional_with_properties(self):
        scene = self.scene(integrator="bdpt", integrator_options={"light_tracing": "off"}, max_depth=3)
        self.same(covary.render(scene, 8, "none"), "--spp", 8, "--estimator", "none", "--integrator", "bdpt",
                  "--set", "light-tracing=off", "--max-depth", 3)

    def test_until(self):
        result = covary.render(self.scene(), spp=400, until=0.05)
        self.assertTrue(result.until_reached)
        self.assertLessEqual(result.predicted_relmse, 0.05)
        self.assertLess(result.samples_per_pixel, 400)

    def test_layers(self):
        result = covary.render(self.scene(), 16, layers="direct", oidn="off")
        layers = result.aovs["Direct"], result.aovs["Indirect"]
        numpy.testing.assert_allclose(sum(layers), result.image, rtol=1e-5, atol=1e-5)
        self.assertTrue(all(layer.max() > 1e-3 for layer in layers))
        with self.assertRaisesRegex(covary.UsageError, "layers: films_only=True makes no image"):
            covary.render(self.scene(), 16, layers="direct", films_only=True)

    def test_films_only(self):
        whole, films = (covary.render(self.scene(), 24, "iicv", films_only=only) for only in (False, True))
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
        self.assertEqual(*(covary.Scene.load(file).content_hash for file in ("room", covary.scenes.path("room"))))
        result = covary.render(scene, 4, "none", groups=2)
        self.assertRegex(repr(result), r"^<covary\.RenderResult 36 x 24, 4 samples per pixel, none, predicted relMSE "
                                       r"[0-9.]+( \(([0-9.]+ to [0-9.]+|unsure|[0-9.]+ to [0-9.]+; unsure)\))?>$")
        without_pixels = dataclasses.replace(result, image=numpy.zeros((0, 0, 3), numpy.float32))
        self.assertIn("&lt;covary.RenderResult", without_pixels._repr_html_())
        self.assertIn("<iframe", result._repr_html_())
        self.assertEqual(len(scene.content_hash), len(self.scene().content_hash))

    def test_files_and_resume(self):
        whole = covary.render(self.scene(), 48, "iicv")
        out, passes = self.path / "a.exr", self.path / "passes"
        covary.render(self.scene(), 24, "iicv", output=out, passes=passes, groups=12)
        resumed = covary.render(self.scene(), 48, "iicv", output=out, passes=passes, groups=12, resume=True)
        self.assert_same_bits(whole.image, resumed.image)
        self.assert_same_bits(resumed.image.reshape(-1, 3), rgb(out))
        self.assertIn("seed", covary.Film.load(str(passes / "crn.exr")).attributes)

    def test_threads_render_one_scene(self):
        """What an integrator learns belongs to the render, and each of these learns something else."""
        for integrator in ("controlled-path", "guided-path"):
            scene = self.scene(integrator=integrator)

            def bits(seed, scene=scene):
                return covary.render(scene, 24, "none", seed=seed).image.tobytes()

            alone = [bits(seed) for seed in range(4)]
            self.assertEqual(len(set(alone)), 4)
            for _ in range(3):
                with ThreadPoolExecutor(4) as threads:
                    self.assertEqual(list(threads.map(bits, range(4))), alone, integrator)

    def test_why_there_is_no_prediction(self):
        few = covary.render("room", 3, resolution=(24, 16), oidn="off")
        self.assertIsNone(few.predicted_relmse)
        self.assertIn("fewer than 4 samples per pixel", few.prediction_doubt)
        film = covary.render("room", 8, "none", resolution=(24, 16)).films["independent"]
        self.assertEqual(film.attributes["complete"], "true")
        self.assertIn("in one group", covary.combine(None, film, oidn="off").prediction_doubt)
        self.assertIn("history has no effect with fewer than 4 samples",
                      self.message_of(covary.UsageError, covary.render_frames, "room", self.path / "h_#.exr", "1-2",
                                      spp=3, history=True))

    def test_frames_that_were_interrupted_are_not_complete(self):
        """They do not count for progress."""
        image, file = numpy.zeros((4, 4, 3), numpy.float32), str(self.path / "f.exr")
        self.assertFalse(covary._covary.is_complete_file(file))
        for complete in ("false", "true"):
            covary.write_image(file, image, {"covary:complete": complete})
            self.assertEqual(covary._covary.is_complete_file(file), complete == "true")

    def test_threads_load_render_denoise_and_save(self):
        """What is made when each thread begins from the file: meshes, the ray tracer's tree, films, images on disk."""
        def bits(seed):
            result = covary.render(self.scene(), 12, seed=seed, oidn="off")
            result.save(self.path / f"{seed}.exr")
            return result.image.tobytes(), rgb(self.path / f"{seed}.exr").tobytes()

        alone = [bits(seed) for seed in range(3)]
        for _ in range(3):
            with ThreadPoolExecutor(3) as threads:
                self.assertEqual(list(threads.map(bits, range(3))), alone)

    def test_progress(self):
        seen = []
        covary.render(self.scene(), spp=24, progress=lambda done, total: seen.append((done, total)))
        self.assertEqual(seen[-1][0], seen[-1][1])

    def test_progress_with_phases(self):
        """A function of three arguments hears of each phase, from the first; others of samples alone."""
        seen, counted = [], []
        covary.render(self.scene(), spp=24, oidn="off", progress=lambda done, total, phase: seen.append(phase))
        phases = [phase for phase, before in zip(seen, ["", *seen]) if phase != before]
        known = iter(("samples", "auxiliary images", "samples", "denoising", "writing"))
        self.assertTrue(all(phase in known for phase in phases), phases)  # in order; short ones may be missed
        self.assertEqual(phases[-1], "writing")
        covary.render(self.scene(), spp=24, oidn="off", progress=lambda done, total: counted.append(total))
        self.assertLessEqual(set(counted), {24 * SIZE[0] * SIZE[1]})
        code = "import covary, sys; covary.render(sys.argv[1], spp=4, oidn='off', progress=True)"
        run = subprocess.run([sys.executable, "-c", code, ROOM], capture_output=True, text=True, check=True)
        self.assertEqual(run.stderr.split("\n")[-2], "writing")
        self.assertIn("samples\n", run.stderr)

    def test_threads(self):
        self.assert_same_bits(covary.render(self.scene(), spp=8, oidn="off", threads=1).image,
                              covary.render(self.scene(), spp=8, oidn="off", threads=2).image)

    def test_facts(self):
        """A row for a table."""
        facts = covary.render(self.scene(), spp=8, oidn="off").to_dict()
        self.assertEqual((facts["width"], facts["height"], facts["samples_per_pixel"]), (*SIZE, 8))
        self.assertLess(facts["predicted_low"] or 0, facts["predicted_relmse"])
        self.assertTrue(all(value is None or isinstance(value, (bool, int, float, str)) for value in facts.values()))
        self.assertEqual(facts.keys(), covary.render(self.scene(), 4, "none").to_dict().keys(), "columns of one table")

    def test_advice(self):
        self.assertEqual(covary.render(self.scene(), 16, "iicv").warnings, [
            "with 16 samples per pixel, estimator iicv is blotchy; take 48 or more, or leave estimator out"])

    def test_images_of_other_settings_are_not_replaced(self):
        file = self.path / "a.exr"
        for _ in range(2):
            covary.render(self.scene(), 4, "none", output=file)
        self.assertIn("rendered with other settings (seed 0, now 1; spp 4, now 8); give another name, or",
                      self.message_of(covary.InputError, covary.render, self.scene(), 8, "none", output=file, seed=1))
        covary.render(self.scene(), 8, "none", output=file, seed=1, overwrite=True)

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
        self.assertIn("integrator_options: found 'x': []; expected a mapping",
                      self.message_of(TypeError, self.scene, integrator_options={"x": []}))
        (self.path / "bad.xml").write_text("<scene version='3.0.0'><shape type='cub'/></scene>")
        self.assertEqual(self.message_of(covary.InputError, covary.Scene.load, self.path / "bad.xml"),
                         self.failure_of_program("render", self.path / "bad.xml", "-o", "x.exr"))


# Two lights so strong that the sum of what they send to the wall is not finite, and one under which it is.
OVERFLOW = """<scene version="3.0.0"><default name="strength" value="3e38"/>
<integrator type="path"><integer name="max_depth" value="2"/></integrator>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="3"/>
<rfilter type="box"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/><scale value="9"/><translate z="3"/>
</transform></shape>
<emitter type="point"><point name="position" x="1" y="0" z="2.9"/><rgb name="intensity" value="$strength"/></emitter>
<emitter type="point"><point name="position" x="-1" y="0" z="2.9"/><rgb name="intensity" value="$strength"/></emitter>
</scene>"""


class Frames(PackageTest):
    def test_bits_of_the_program(self):
        seen = []
        path = SOURCE / "scenes" / "room-path.json"
        files = covary.render_frames(ROOM, self.path / "f_##.exr", range(1, 4), spp=4, estimator="none", seed=3,
                                     resolution=SIZE, camera_path=path,
                                     progress=lambda done, total: seen.append((done, total)))
        self.assertEqual(files, [self.path / f"f_0{frame}.exr" for frame in (1, 2, 3)])
        self.assertEqual(seen[-1], (3, 3))
        self.run_program("render", ROOM, "-o", "g_##.exr", "--resolution", TEXT, "--no-preview", "--quiet", "--spp", 4,
                         "--estimator", "none", "--seed", 3, "--camera-path", path, "--frames", "1-3")
        for frame in (1, 2, 3):
            self.assert_same_bits(rgb(self.path / f"f_0{frame}.exr"), rgb(self.path / f"g_0{frame}.exr"))
        again = {"spp": 4, "estimator": "none", "seed": 3, "resolution": SIZE, "camera_path": path}
        before = files[0].stat().st_mtime_ns
        covary.render_frames(ROOM, self.path / "f_##.exr", "1-3", resume=True, **again)
        self.assertEqual(files[0].stat().st_mtime_ns, before, "complete frames stay")
        self.assertIn("(seed 3, now 4); give another name, or overwrite=True to replace it", self.message_of(
            covary.Error, covary.render_frames, ROOM, self.path / "f_##.exr", "1-3", **{**again, "seed": 4}))

    def test_scene_of_the_package_and_options(self):
        files = covary.render_frames("room", self.path / "h_#.exr", "2", 4, resolution=SIZE, aovs=True, groups=2,
                                     denoise="none", threads=1)
        self.assertEqual(covary.read_image(files[0], "Albedo").shape, (24, 36, 3))
        self.assertIn("expected a name with '#'", self.message_of(covary.UsageError, covary.render_frames, "room",
                                                                  "h.exr", "2"))


class BadSamples(PackageTest):
    def setUp(self):
        super().setUp()
        self.file = self.path / "it's strong.xml"
        self.file.write_text(OVERFLOW)

    def replayed(self, bad):
        """What the sample's command prints, in a shell."""
        (self.path / "bin").mkdir(exist_ok=True)
        if not (self.path / "bin" / "covary").exists():
            (self.path / "bin" / "covary").symlink_to(Path(PROGRAM).resolve())
        run = subprocess.run(bad.replay, shell=True, cwd=self.path, capture_output=True, text=True, check=False,
                             env={**os.environ, "PATH": f"{self.path / 'bin'}:{os.environ['PATH']}"})
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stdout

    def test_none(self):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            result = covary.render(covary.Scene.load(self.file, defines={"strength": 1e-3}), 4, "none")
        self.assertEqual((result.not_finite_samples, result.negative_samples, result.bad_samples), (0, 0, []))

    def test_counts_and_replays_of_the_program(self):
        """In one pass, in both of IICV, and of a part of the frame of another size, whose pixels have other numbers."""
        self.run_program("render", self.file, "-o", "a.exr", "--estimator", "none", "--spp", 4, "--seed", 9,
                         "--quiet", "--no-preview", "--json", "facts.json")
        facts = json.loads((self.path / "facts.json").read_text())
        with self.assertWarnsRegex(covary.BadSamplesWarning, "samples were not finite and 0 negative") as warned:
            result = covary.render(self.file, 4, "none", seed=9)
        self.assertEqual(warned.filename, __file__)
        self.assertGreater(result.not_finite_samples, 0)
        self.assertEqual(result.not_finite_samples, facts["not_finite_samples"])
        self.assertEqual([(bad.x, bad.y, bad.sample) for bad in result.bad_samples],
                         [(bad["x"], bad["y"], bad["sample"]) for bad in facts["bad_samples"]])
        self.assertIn("they count as black", result.warnings[-1])
        with self.assertWarns(covary.BadSamplesWarning):
            of_iicv = covary.render(covary.Scene.load(self.file, resolution=(8, 6), max_depth=2,
                                                      defines={"strength": 2e38}), 24, "iicv", seed=5,
                                    crop=(1, 2, 5, 3), sampler="sobol")
        self.assertEqual({bad.film for bad in of_iicv.bad_samples}, {"crn", "independent"})
        for bad in (*result.bad_samples[:2], of_iicv.bad_samples[0], of_iicv.bad_samples[-1]):
            self.assertEqual(bad.value, (math.inf,) * 3)
            self.assertIn("radiance (inf, inf, inf)", self.replayed(bad))

    def test_light_paths(self):
        scene = covary.Scene.load(self.file, integrator="bdpt", integrator_options={"light_tracing": "on"})
        with self.assertWarns(covary.BadSamplesWarning):
            result = covary.render(scene, 8, "none")
        self.assertIn("inf", self.replayed(result.bad_samples[0]))
        # Light is traced beside independent numbers alone, unless asked for: the independent film of two is not that of
        # one, and says so.
        scene = covary.Scene.load(self.file, integrator="bdpt")
        with self.assertWarns(covary.BadSamplesWarning):
            of_iicv = covary.render(scene, 24, "iicv")
        self.assertIn("--set light-tracing=off --", of_iicv.bad_samples[-1].replay)
        self.assertIn("inf", self.replayed(of_iicv.bad_samples[-1]))


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

DENOISING = """
import covary, numpy, signal, sys, threading, os, pathlib, time
begins = pathlib.Path(os.environ["STAND_IN_BEGINS"])
def interrupt():
    while not begins.exists():
        time.sleep(0.01)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=interrupt, daemon=True).start()
try:
    covary.denoise(numpy.ones((8, 8, 3), "float32"), oidn=sys.argv[1])
except KeyboardInterrupt:
    print("interrupted", flush=True)
    os._exit(0)  # not waiting for the library
"""

LOADING = """
import covary, os, signal, sys, threading, time
def seconds():
    begin = time.process_time()
    covary.Scene.load(sys.argv[1])
    return time.process_time() - begin
whole = seconds()
threading.Timer(0.05, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
begin = time.process_time()
try:
    covary.Scene.load(sys.argv[1])
except KeyboardInterrupt:
    part = time.process_time() - begin
    print("interrupted" if part < 0.5 * whole else f"{part} of {whole} s")
"""


class Interruption(PackageTest):
    def run_interrupted(self, code, *arguments, **environment):
        run = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=100,
                             check=False, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
                             env={**os.environ, **environment})
        self.assertEqual((run.stdout, run.stderr), ("interrupted\n", ""))

    def test_ctrl_c_while_a_library_works(self):
        """It works for ten minutes, and cannot be stopped."""
        self.run_interrupted(DENOISING, os.environ["STAND_IN_DENOISER"], STAND_IN_BEGINS=str(self.path / "begins"))

    def test_ctrl_c(self):
        """Ends a render that would take hours, and what there is was kept."""
        out = self.path / "out.exr"
        self.run_interrupted(LONG, ROOM, out)
        self.assertEqual(covary.read_image(out).shape, (24, 36, 3))

    def test_ctrl_c_while_a_scene_is_loaded(self):
        """Meshes not yet read are left, and so is the hierarchy of those that were."""
        n = 700  # a height field of 2 n^2 triangles, in each of three shapes
        rows, columns = numpy.divmod(numpy.arange(n * n), n)
        points = numpy.stack([columns, rows, numpy.sin(rows * columns)], axis=1).astype("<f4")
        corners = (numpy.arange(n - 1)[:, None] * n + numpy.arange(n - 1)).ravel()
        faces = numpy.empty(2 * corners.size, dtype=[("n", "u1"), ("v", "<i4", 3)])
        faces["n"] = 3
        faces["v"][::2] = numpy.stack([corners, corners + 1, corners + n], axis=1)
        faces["v"][1::2] = numpy.stack([corners + 1, corners + n + 1, corners + n], axis=1)
        header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {n * n}\nproperty float x\nproperty float y\n"
                  f"property float z\nelement face {faces.size}\nproperty list uchar int vertex_indices\nend_header\n")
        (self.path / "field.ply").write_bytes(header.encode() + points.tobytes() + faces.tobytes())
        shapes = '<shape type="ply"><string name="filename" value="field.ply"/></shape>' * 3
        (self.path / "field.xml").write_text(f'<scene version="3.0.0"><integrator type="path"/>'
                                             f'<sensor type="perspective"/>{shapes}</scene>')
        self.run_interrupted(LOADING, self.path / "field.xml")

    def test_progress_that_raises(self):
        def fail(done, total):
            raise ValueError("enough")
        scene = covary.Scene.load(ROOM, resolution=SIZE)
        self.assertEqual(self.message_of(ValueError, covary.render, scene, 1 << 24, progress=fail), "enough")


if __name__ == "__main__":
    unittest.main()
