# SPDX-License-Identifier: Apache-2.0
"""--denoise of covary render and covary combine, and covary denoise --check, as a user runs them."""
import json
import math
import os
import random
import struct
import unittest

from exr_reader import header, read_exr
from exr_writer import exr
from render_test import IICV, ROOM, SMALL, RenderTest

# Without Open Image Denoise, so that results do not depend on what is installed.
PLAIN = ("--oidn", "off")
# Whose noise lies in many pixels, so that there are intervals.
MATERIALS = ROOM.replace("room", "materials")


#: Lights of two groups, of which one has a lamp and a point, and a sky that is in none; $fog: media or nothing.
LAMPS = """<scene version="3.0.0">
  <default name="fill" value="1"/>
  <integrator type="path"/>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0, 1, 4" target="0, 0.5, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film></sensor>
  <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="4"/></transform></shape>
  <shape type="sphere"><float name="radius" value="0.5"/><point name="center" x="0" y="0.5" z="0"/>
    <bsdf type="dielectric"/></shape>
  <emitter type="area" id="key"><rgb name="radiance" value="9, 8, 7"/></emitter>
  <shape type="sphere"><float name="radius" value="0.3"/><point name="center" x="1" y="2" z="0"/><ref id="key"/></shape>
  <shape type="sphere"><float name="radius" value="0.2"/><point name="center" x="-1" y="2" z="1"/>
    <ref id="key"/></shape>
  <emitter type="point" id="fill"><point name="position" x="-2" y="2" z="2"/>
    <rgb name="intensity" value="$fill, $fill, $fill"/></emitter>
  <emitter type="constant"><rgb name="radiance" value="0.1, 0.2, 0.3"/></emitter>
  $fog
</scene>"""
FOG = """<shape type="cube"><transform name="to_world"><scale value="3.5"/></transform><bsdf type="null"/>
  <medium name="interior" type="homogeneous"><float name="sigma_t" value="0.1"/></medium></shape>"""


def exponential_noise(seed):
    """Numbers of an exponential distribution, as noise of renders is skewed."""
    generator = random.Random(seed)
    return lambda: generator.expovariate(1)


def line_of(start, text):
    """The last line that begins so."""
    return [line for line in text.splitlines() if line.startswith(start)][-1]


class Denoise(RenderTest):
    def channels(self, name):
        return set(read_exr((self.path / name).read_bytes()))

    def test_less_error_in_the_order_of_the_dial(self):
        self.good("render", ROOM, *SMALL, "-o", "r.exr", "--estimator", "none", "--spp", "512", "--seed", "99")
        errors = {}
        for mode in ("none", "bias", "balanced", "error"):
            options = () if mode == "none" else PLAIN
            errors[mode] = 0
            for seed in map(str, range(10)):  # one firefly more or less is a fifth of one image's error
                self.good("render", ROOM, *SMALL, "-o", f"{mode}{seed}.exr", *IICV, "--denoise", mode, *options,
                          "--spp", "48", "--seed", seed, "--passes", f"films{seed}", "--resume")
                errors[mode] += self.relmse(f"{mode}{seed}.exr", "r.exr") / 10
        self.assertLess(errors["bias"], 1.1 * errors["none"])
        self.assertLess(errors["balanced"], 0.9 * errors["none"])
        self.assertLess(errors["error"], 0.8 * errors["none"])

    def test_combine_of_films_and_features_gives_the_same_bits(self):
        self.good("render", ROOM, *SMALL, "-o", "a.exr", *IICV, "--denoise", "balanced", *PLAIN, "--spp", "24",
                  "--aovs", "--passes", "films", "--save-stages", "steps")
        self.good("combine", "--crn", "films/crn.exr", "--independent", "films/independent.exr", "-o", "b.exr",
                  "--denoise", "balanced", *PLAIN, "--features", "a.exr", "--quiet", "--error")
        self.same("a.exr", "b.exr")
        self.assertTrue({"StdError.G", "Bias.G"} <= self.channels("b.exr"))
        names = ["sharp", "sharp-independent", "smooth", "demodulated"]
        self.assertEqual({p.name for p in (self.path / "steps").iterdir()},
                         {f"{kind}-{name}.{end}" for kind in ("candidate", "weight") for name in names
                          for end in ("exr", "png")})
        # Without features it is another image.
        self.good("combine", "--crn", "films/crn.exr", "--independent", "films/independent.exr", "-o", "c.exr",
                  "--denoise", "balanced", *PLAIN, "--quiet")
        self.assertNotEqual((self.path / "b.exr").read_bytes(), (self.path / "c.exr").read_bytes())

    def test_threads_resume_and_attributes(self):
        options = (*IICV, "--denoise", "error", *PLAIN, "--spp", "24")
        self.good("render", ROOM, *SMALL, "-o", "a.exr", *options, "--threads", "1")
        self.good("render", ROOM, *SMALL, "-o", "b.exr", *options, "--threads", "3", "--passes", "films")
        self.same("a.exr", "b.exr")
        self.good("render", ROOM, *SMALL, "-o", "c.exr", *options, "--passes", "films", "--resume")
        self.same("a.exr", "c.exr")
        self.assertNotIn("Albedo.R", self.channels("a.exr"), "features are only written where --aovs asks for them")
        info = json.loads(self.good("info", "a.exr", "--json").stdout)
        self.assertEqual(info["attributes"]["covary:estimator"], "iicv --denoise error --oidn off")

    def test_until_and_few_samples(self):
        facts = self.statistics("-o", "a.exr", *IICV, "--denoise", "error", *PLAIN, "--until", "relmse=0.01")
        self.assertLessEqual(facts["predicted_relmse"], 0.01)
        facts = self.statistics("-o", "c.exr", *IICV, "--denoise", "error", *PLAIN, "--until", "relmse-p95=0.03")
        self.assertLessEqual(facts["predicted_relmse_p95"], 0.03)
        self.assertGreater(facts["predicted_relmse_p95"], facts["predicted_relmse"])
        facts = self.statistics("-o", "b.exr", *IICV, "--denoise", "error", *PLAIN, "--spp", "4")
        self.assertEqual(facts["samples_per_pixel"], 12, "six groups in each pass")

    def test_what_cannot_be(self):
        self.bad(2, "--denoise needs an estimator that predicts its error (", "render", ROOM, "-o", "a.exr",
                 "--estimator", "iduw", "--denoise", "error")
        self.bad(2, "--denoise of a single pass needs --sampling independent", "render", ROOM, "-o", "a.exr",
                 "--sampling", "crn", "--denoise", "error")
        self.bad(2, "--oidn has no effect without --denoise auto, bias, balanced or error", "render", ROOM, "-o",
                 "a.exr", *IICV, *PLAIN)
        self.bad(2, "--denoise", "render", ROOM, "-o", "a.exr", "--denoise", "much")
        self.bad(2, "Open Image Denoise was not found (/nowhere/lib.so", "render", ROOM, *SMALL, "-o", "a.exr",
                 "--denoise", "error", "--oidn", "/nowhere/lib.so", "--spp", "24")
        self.good("render", ROOM, *SMALL, "-o", "b.exr", *IICV, "--spp", "24", "--passes", "films")
        inputs = ("combine", "--crn", "films/crn.exr", "--independent", "films/independent.exr", "-o", "c.exr")
        self.bad(1, "--features 'b.exr' has no layer Albedo", *inputs, "--denoise", "error", *PLAIN, "--features",
                 "b.exr")
        self.bad(2, "--features is an option of --denoise", *inputs, *IICV, "--features", "b.exr")
        size = struct.unpack("<4i", header((self.path / "b.exr").read_bytes())[0]["dataWindow"])
        width, height = size[2] + 1, size[3] + 1
        for value in (math.nan, math.inf, -math.inf):
            layers = {f"{layer}.{c}": [0.5] * (width * height) for layer, names in (("Albedo", "RGB"), ("N", "XYZ"))
                      for c in names}
            for name, layer in (("Albedo.G", "Albedo"), ("N.X", "N")):
                bad = {**layers, name: [0.5] * (width + 3) + [value] + [0.5] * (width * (height - 1) - 4)}
                grey = {c: [0.5] * (width * height) for c in "RGB"}
                self.write("features.exr", exr({**bad, **grey}, (width, height)))
                said = self.good(*inputs, "--denoise", "error", *PLAIN, "--features", "features.exr").stderr
                self.assertIn(f"features.exr: the layer {layer}: 1 of {width * height} pixels of this feature are left "
                              f"out, the first with the value {value} at (3, 1)", said)
            seen = {f"{layer}.{c}": [0.5] * (width * height) for layer, names in (("DenoisingAlbedo", "RGB"),
                                                                                 ("DenoisingNormal", "XYZ"))
                    for c in names} | {"DenoisingNormal.Y": [value] * (width * height)}
            self.write("features.exr", exr({**layers, **seen, **{c: [0.5] * (width * height) for c in "RGB"}},
                                         (width, height)))
            said = self.good(*inputs, "--denoise", "error", *PLAIN, "--features", "features.exr").stderr
            self.assertIn(f"features.exr: the layer DenoisingNormal: {width * height} of {width * height} pixels", said)
        self.bad(2, "--explain: a pixel that is denoised", *inputs, "--denoise", "error", *PLAIN, "--explain", "1,1")

    def test_single_pass(self):
        self.good("render", ROOM, *SMALL, "-o", "r.exr", "--estimator", "none", "--spp", "512", "--seed", "9")
        single = ("--estimator", "none", "--spp", "24")
        self.good("render", ROOM, *SMALL, "-o", "plain.exr", *single)
        facts = self.statistics("-o", "a.exr", *single, "--denoise", "error", *PLAIN, "--aovs", "--passes", "films",
                                "--save-stages", "steps")
        self.assertEqual(facts["estimator"], "mixture --denoise error --oidn off")
        self.assertNotIn("note", facts)
        self.assertTrue((self.path / "steps/weight-regression.exr").exists())
        self.assertLess(self.relmse("a.exr", "r.exr"), 0.5 * self.relmse("plain.exr", "r.exr"))
        # The independent film alone.
        alone = ("combine", "--independent", "films/independent.exr", "-o", "b.exr", "--quiet", "--error")
        self.good(*alone, "--denoise", "error", *PLAIN, "--features", "a.exr")
        self.same("a.exr", "b.exr")
        self.bad(2, "without --crn, independent images can only be denoised", *alone, "--denoise", "none")
        self.bad(2, "--estimator iicv needs the image with common random numbers, --crn", *alone, "--denoise", "error",
                 *PLAIN, "--estimator", "iicv")
        # A film with groups, the same samples; two renders of other seeds.
        self.good("render", ROOM, *SMALL, "-o", "film.exr", *single, "--groups", "12", "--aovs")
        self.good("denoise", "film.exr", "-o", "c.exr", *PLAIN, "--quiet")
        self.assertLess(self.relmse("c.exr", "r.exr"), 0.5 * self.relmse("plain.exr", "r.exr"))
        self.good("render", ROOM, *SMALL, "-o", "other.exr", *single, "--seed", "1")
        self.good("denoise", "plain.exr", "other.exr", "-o", "d.exr", *PLAIN, "--quiet")
        self.assertLess(self.relmse("d.exr", "r.exr"), 0.5 * self.relmse("plain.exr", "r.exr"))
        self.assertIn("StdError.G", self.channels("d.exr"))
        self.bad(2, "are the same file", "denoise", "plain.exr", "plain.exr", "-o", "e.exr", *PLAIN)
        self.bad(2, "--mode error needs a second render of another seed", "denoise", "plain.exr", "-o", "e.exr",
                 "--mode", "error")
        self.bad(2, "'plain.exr' is one image, which only Open Image Denoise denoises: leave out --oidn off, or give a "
                    "second render of another seed, too", "denoise", "plain.exr", "-o", "e.exr", *PLAIN)
        (self.path / "copy.exr").write_bytes((self.path / "plain.exr").read_bytes())
        self.bad(1, "plain.exr and copy.exr are identical: the same seed was rendered twice", "denoise", "plain.exr",
                 "copy.exr", "-o", "e.exr", *PLAIN)

    def test_positions(self):
        """Filters with features, from films and from files of features."""
        self.good("render", ROOM, *SMALL, "-o", "film.exr", "--estimator", "none", "--spp", "8", "--groups", "4",
                  "--aovs")
        self.good("denoise", "film.exr", "-o", "a.exr", "--albedo", "Albedo", "--normal", "N", *PLAIN, "--quiet")
        data = (self.path / "film.exr").read_bytes()
        size = struct.unpack("<4i", header(data)[0]["dataWindow"])
        for layers in (("Albedo", "N", "P"), ("Albedo", "N")):
            features = {name: values for name, values in read_exr(data).items() if name.split(".")[0] in layers}
            rgb = {c: features["Albedo.R"] for c in "RGB"}
            self.write("features.exr", exr(features | rgb, (size[2] + 1, size[3] + 1)))
            self.good("combine", "--independent", "film.exr", "--features", "features.exr", "-o", "b.exr", "--denoise",
                      "auto", *PLAIN, "--quiet")
            if "P" in layers:
                self.same("a.exr", "b.exr")
        self.assertGreater(self.relmse("a.exr", "b.exr"), 0)

    def test_interval(self):
        render = ("render", MATERIALS, *SMALL[:2], "-o", "a.exr", "--spp", "48", *PLAIN, "--passes", "films", "--json",
                  "a.json", "--verbose")
        last = line_of("predicted relMSE", self.good(*render).stderr)
        facts = json.loads((self.path / "a.json").read_text())
        low, middle, high = (facts[f"predicted_relmse{end}"] for end in ("_low", "", "_high"))
        self.assertTrue(0 < low < middle < high, facts)
        self.assertRegex(last, r"^predicted relMSE 0\.0\d+, between 0\.0\d+ and 0\.0\d+ \(80 %\), \d+ % of it")
        factor = max(high / middle, middle / low)
        self.assertIs(facts["predicted_relmse_reliable"], factor <= 1.5)
        self.assertEqual("(unreliable: known to a factor of" in last, factor > 1.5)
        attributes = json.loads(self.good("info", "a.exr", "--json").stdout)["attributes"]
        self.assertAlmostEqual(float(attributes["covary:predicted_relmse"]) / middle, 1, 3)
        for told, bound in zip(attributes["covary:predicted_relmse_80"].split(), (low, high), strict=True):
            self.assertAlmostEqual(float(told) / bound, 1, 3)
        self.good("combine", "--independent", "films/independent.exr", "-o", "b.exr", "--denoise", "auto", *PLAIN,
                  "--json", "b.json")
        self.assertIn("predicted_relmse_high", json.loads((self.path / "b.json").read_text()))
        # The standard error in colours, whose scale is told.
        width, height = map(int, SMALL[1].split("x"))
        told = self.good("convert", "a.exr", "errors.png", "--layer", "StdError", "--false-colours").stderr
        self.assertRegex(told, r"^errors.png: [\d.e-]+ black, .* pale yellow \(logarithmic\)\n"
                               r"errors.png: 64 x 48 pixels\n$")
        self.assertEqual((self.path / "errors.png").read_bytes()[16:24], bytes([0, 0, 0, width, 0, 0, 0, height]))

    def test_intervals_of_all_kinds(self):
        for name, options in (("mean", ("--estimator", "none", "--groups", "12")), ("pair", ("--estimator", "iicv")),
                              ("denoised pair", ("--estimator", "iicv", "--denoise", "auto", *PLAIN))):
            with self.subTest(name):
                told = self.good("render", MATERIALS, *SMALL[:2], "-o", "k.exr", "--spp", "96", *options, "--json",
                                 "k.json", "--overwrite", "--verbose").stderr
                facts = json.loads((self.path / "k.json").read_text())
                low, middle, high = (facts[f"predicted_relmse{end}"] for end in ("_low", "", "_high"))
                self.assertTrue(0 < low < middle < high, facts)
                self.assertRegex(told, r"predicted relMSE 0\.\d+, between 0\.\d+ and 0\.\d+ \(80 %\)")
                attributes = json.loads(self.good("info", "k.exr", "--json").stdout)["attributes"]
                for value, bound in zip(attributes["covary:predicted_relmse_80"].split(), (low, high), strict=True):
                    self.assertAlmostEqual(float(value) / bound, 1, 3)
        for seed in "12":
            self.good("render", MATERIALS, *SMALL[:2], "-o", f"{seed}.exr", "--spp", "48", "--estimator", "none",
                      "--denoise", "none", "--rfilter", "box", "--seed", seed, "--quiet")
        denoise = ("denoise", "1.exr", "2.exr", "-o", "two.exr", *PLAIN, "--overwrite")
        plain, detailed = (self.good(*denoise, *words).stderr.splitlines() for words in ((), ("--verbose",)))
        good = r"^how good: about [\d.]+ % (grain|error) left( \(unsure: .+\))?$"
        self.assertRegex(plain[-1], good)
        self.assertEqual(detailed[-2], plain[-1])
        self.assertRegex(detailed[-1], r"^predicted relMSE 0\.\d+, between 0\.\d+ and 0\.\d+ \(80 %\)")
        # What a film says of its image is no part of the film.
        film = ("render", MATERIALS, *SMALL[:2], "--estimator", "none", "--groups", "12", "--quiet", "--spp", "24")
        self.good(*film, "-o", "f.exr", "--json", "f.json")
        self.assertIn("predicted_relmse_high", json.loads((self.path / "f.json").read_text()))
        self.good(*film, "-o", "g.exr", "--seed", "1")
        self.good("merge", "f.exr", "g.exr", "-o", "h.exr")
        self.assertNotIn("covary:predicted_relmse",
                         json.loads(self.good("info", "h.exr", "--json").stdout)["attributes"])

    def test_layers_of_other_renderers(self):
        """Picture, albedo and normal by each renderer's names (docs/other-renderers.md)."""
        noise, n, size = exponential_noise(5), 48 * 32, (48, 32)
        names = {
            "blender": ("ViewLayer.Combined.R G B", "ViewLayer.Denoising Albedo.R G B",
                        "ViewLayer.Denoising Normal.X Y Z"),
            "mitsuba": ("R G B", "albedo.R G B", "sh_normal.X Y Z"),
            "pbrt": ("R G B", "Albedo.R G B", "Ns.X Y Z"),
            "arnold": ("R G B", "denoise_albedo.R G B", "N.X Y Z"),
            "renderman": ("Ci.r g b", "albedo.r g b", "normal.r g b"),
            "v-ray": ("R G B", "VRayDiffuseFilter.red green blue", "bump_normals.X Y Z"),
        }

        def channels(layer):
            first, *others = layer.rsplit(" ", 2)
            stem, dot, letter = first.rpartition(".")
            return [stem + dot + c for c in (letter, *others)]

        results = set()
        albedo, normal = [0.2 + 0.6 * (i % 48 > 24) for i in range(n)], [0.5] * n
        pictures = [[a * noise() for a in albedo] for _ in range(2)]
        for renderer, (picture, albedo_name, normal_name) in names.items():
            for i, values in enumerate(pictures):
                layers = {c: values for c in channels(picture)}
                layers.update({c: albedo for c in channels(albedo_name)})
                layers.update({c: normal for c in channels(normal_name)})
                layers.update({f"other.{c}": normal for c in "RGB"})
                self.write(f"{renderer}{i}.exr", exr(layers, size))
            files = (f"{renderer}0.exr", f"{renderer}1.exr")
            said = self.good("denoise", *files, "-o", f"{renderer}.exr", *PLAIN).stderr
            self.assertIn("guided by albedo and normal", said, renderer)
            results.add(tuple(read_exr((self.path / f"{renderer}.exr").read_bytes())[channels(picture)[0]]))
        self.assertEqual(len(results), 1, "the same pixels by every renderer's names")
        # Features by name, and in files of their own as LuxCore writes them.
        self.write("albedo.exr", exr({c: albedo for c in "RGB"}, size))
        two = ("denoise", "mitsuba0.exr", "mitsuba1.exr", "-o", "a.exr", *PLAIN)
        said = self.good(*two, "--albedo", "albedo.exr", "--normal", "sh_normal").stderr
        self.assertIn("guided by albedo and normal", said)
        self.bad(1, "no layer 'albdo'; did you mean 'albedo'?", *two, "--albedo", "albdo")
        self.write("small.exr", exr({c: [0.5] * 6 for c in "RGB"}, (3, 2)))
        self.bad(1, "mitsuba0.exr has a frame of 48 x 32 pixels, small.exr one of 3 x 2", *two, "--albedo", "small.exr")
        self.bad(2, "--albedo and --normal have no effect with --no-features", *two, "--no-features", "--albedo", "x")
        # A larger data window in a frame of the same size, and one that lacks pixels.
        self.good(*two, "--albedo", "albedo.exr", "--normal", "sh_normal")
        placed = (self.path / "a.exr").read_bytes()
        wide = [v for y in range(32) for v in (9.0, *albedo[48 * y:48 * y + 48], 9.0)]
        self.write("wide.exr", exr({c: wide for c in "RGB"}, size, window=(-1, 0, 50, 32)))
        self.good(*two, "--albedo", "wide.exr", "--normal", "sh_normal")
        self.assertEqual(read_exr((self.path / "a.exr").read_bytes()), read_exr(placed))
        self.write("part.exr", exr({c: albedo for c in "RGB"}, size, window=(4, 0, 48, 32)))
        self.bad(1, "'part.exr' has the pixels 48 x 32 at (4, 0); 'mitsuba0.exr' needs 48 x 32 at (0, 0)", *two,
                 "--albedo", "part.exr")

    def test_the_network_alone_takes_the_mean_of_renders(self):
        greys = [[0.25 * (i % 7), 0.5 * (i % 3)] for i in range(96)]
        for k, name in enumerate("ab"):
            self.write(f"{name}.exr", exr({c: [grey[k] for grey in greys] for c in "RGB"}, (12, 8)))
        command = ("denoise", "a.exr", "b.exr", "--mode", "oidn", "--oidn", os.environ["STAND_IN_DENOISER"], "-o")
        self.assertNotIn("one render does not tell", self.good(*command, "o.exr").stderr)
        means = [sum(grey) / 2 for grey in greys]
        self.assertEqual(read_exr((self.path / "o.exr").read_bytes())["G"], means[::-1], "upside down")
        self.write("b.exr", exr({c: [0.5] * 24 for c in "RGB"}, (6, 4)))
        self.bad(1, "'b.exr' has the pixels", *command, "p.exr")

    def test_frames_of_one_render_take_no_history(self):
        chance = random.Random(4)
        for n in (1, 2):
            planes = {c: [chance.random() for _ in range(96)] for c in "RGB"}
            self.write(f"f_{n}.exr", exr(planes | {f"Motion.{c}": [0.0] * 96 for c in "XYZ"}, (12, 8)))
        command = ("denoise", "f_#.exr", "-o", "d_#.exr", "--oidn", os.environ["STAND_IN_DENOISER"])
        self.assertIn("d_2.exr, of one render, which takes no history", self.good(*command).stderr)
        self.assertIn("0 frames in", self.good(*command, "--resume").stderr)

    def test_bands_with_a_network(self):
        """The network sees the whole picture: the stand-in's pixels come from the other end of it."""
        size, chance = (16, 700), random.Random(3)
        n = size[0] * size[1]
        for name in "ab":
            planes = {c: [chance.expovariate(1) for _ in range(n)] for c in "RGB"}
            planes |= {f"albedo.{c}": [0.3 + 0.4 * (i // 640 % 2) for i in range(n)] for c in "RGB"}
            self.write(f"{name}.exr", exr(planes, size))
        command = ("denoise", "a.exr", "b.exr", "--oidn", os.environ["STAND_IN_DENOISER"], "-o")
        self.good(*command, "whole.exr")
        self.good(*command, "bands.exr", "--memory", "4")
        whole, bands = (read_exr((self.path / f"{name}.exr").read_bytes()) for name in ("whole", "bands"))
        self.assertEqual(bands, whole)

    def test_memory_is_told(self):
        """At least the values of both renders and of the result are planned; the program itself takes more."""
        size = (24, 16)
        for name in ("a", "b"):
            self.write(f"{name}.exr", exr({c: [0.5] * (size[0] * size[1]) for c in "RGB"}, size))
        facts = json.loads(self.good("denoise", "a.exr", "b.exr", "-o", "out.exr", "--json", "-", "--quiet", "--force",
                                     *PLAIN).stdout)
        self.assertGreater(facts["planned_memory_bytes"], 3 * 12 * size[0] * size[1])
        self.assertGreater(facts["peak_memory_bytes"], facts["planned_memory_bytes"])

    @unittest.skipIf("SANITIZED" in os.environ, "sanitizers take memory of their own")
    def test_memory_of_renders(self):
        """What is planned is what is taken, or up to 1.3 times that; the program cancels between two sizes."""
        sizes, chance = ((120, 90), (360, 270)), random.Random(5)
        noise = [chance.expovariate(1) for _ in range(360 * 270)]
        features = [f"albedo.{c}" for c in "RGB"] + [f"normal.{c}" for c in "XYZ"]
        for layers, renders in (((), 2), (features, 2), (features, 4), ((), 40)):
            planned, taken = [], []
            for size in sizes:
                n = size[0] * size[1]
                for i in range(renders):
                    planes = {c: noise[7 * i:n] + noise[:7 * i] for c in "RGB"} | {c: [0.5] * n for c in layers}
                    self.write(f"{i}.exr", exr(planes, size))
                facts = json.loads(self.good("denoise", *(f"{i}.exr" for i in range(renders)), "-o", "out.exr",
                                             "--overwrite", "--json", "-", "--quiet", "--force", *PLAIN).stdout)
                planned.append(facts["planned_memory_bytes"]), taken.append(facts["peak_memory_bytes"])
            ratio = (planned[1] - planned[0]) / (taken[1] - taken[0])
            with self.subTest(layers=len(layers), renders=renders, ratio=ratio):
                self.assertGreater(ratio, 0.95)  # processors differ in the width of their registers
                self.assertLess(ratio, 1.3)

    def test_layers_add_up(self):
        """Of two renders, with and without a network, by covary denoise and combine."""
        for seed in ("1", "2"):
            self.good("render", ROOM, *SMALL, "-o", f"{seed}.exr", "--estimator", "none", "--spp", "8", "--layers",
                      "direct", "--seed", seed)
        two = ("denoise", "1.exr", "2.exr", "-o", "a.exr")
        for oidn in ("off", os.environ["STAND_IN_DENOISER"]):
            self.good(*two, "--layers", "Direct", "Indirect", "--oidn", oidn)
            self.assert_add_up("a.exr", "Direct", "Indirect")
            self.good(*two, "--layers", "Direct", "--oidn", oidn)
            self.assert_add_up("a.exr", "Direct", "Rest")
        self.good(*two, "--oidn", oidn)
        plain = read_exr((self.path / "a.exr").read_bytes())
        self.good("combine", "--independent", "1.exr", "2.exr", "-o", "b.exr", "--denoise", "auto", "--oidn", oidn,
                  "--layers", "Direct", "Indirect")
        self.assert_add_up("b.exr", "Direct", "Indirect")
        first = read_exr((self.path / "1.exr").read_bytes())
        self.assertEqual(set(plain), {"R", "G", "B", "StdError.R", "StdError.G", "StdError.B", "Bias.R", "Bias.G",
                                      "Bias.B", *(f"{layer}.{c}" for layer in ("Direct", "Indirect") for c in "RGB")})
        self.assertEqual(plain["Direct.R"], first["Direct.R"], "as they are in the first render")
        self.bad(1, "no layer 'Dirct'; did you mean 'Direct'?", *two, "--layers", "Dirct")
        self.bad(2, "--layers are denoised by a mixture, which needs a second render of another seed", "denoise",
                 "1.exr", "-o", "c.exr", "--layers", "Direct")
        refused = self.run_covary("combine", "--crn", "1.exr", "--independent", "2.exr", "-o", "c.exr", "--layers",
                                  "Direct", "--force")
        self.assertEqual(refused.returncode, 2)
        self.assertIn(" makes no --layers; denoised independent images have them", refused.stderr)

    def test_light_groups(self):
        """By the ids of lights, on surfaces and in media; they add up, and each has its lights alone."""
        layers = ("Combined_key", "Combined_fill", "Rest")
        for fog in ("", FOG):
            self.write("lamps.xml", LAMPS.replace("$fog", fog).encode())
            lamps = ("render", "lamps.xml", "--spp", "8", "--layers", "light-groups", "--no-preview")
            for options in (("--estimator", "none"), ("--oidn", "off"), ("--oidn", os.environ["STAND_IN_DENOISER"])):
                self.good(*lamps, "-o", "a.exr", *options)
                self.assert_add_up("a.exr", *layers)
            self.good(*lamps, "-o", "a.exr", "--estimator", "none")
            self.good(*lamps, "-o", "b.exr", "--estimator", "none", "-D", "fill=2")
            once, twice = (read_exr((self.path / name).read_bytes()) for name in ("a.exr", "b.exr"))
            self.assertGreater(min(sum(once[f"{layer}.G"]) for layer in layers), 0)
            for a, b in zip(once["Combined_fill.G"], twice["Combined_fill.G"]):
                self.assertAlmostEqual(2 * a, b, delta=1e-5 * b)
            self.assertEqual([once[name] for name in ("Combined_key.G", "Rest.G")],
                             [twice[name] for name in ("Combined_key.G", "Rest.G")])
        self.good("render", "lamps.xml", "--spp", "4", "--estimator", "none", "-o", "c.exr", "--no-preview")
        self.good("render", "lamps.xml", "--spp", "8", "--estimator", "none", "-o", "c.exr", "--resume", "--no-preview")
        self.assertEqual(read_exr((self.path / "c.exr").read_bytes())["G"], once["G"], "the image is as without")
        room = ("render", ROOM, "-o", "d.exr", "--layers", "light-groups")
        self.bad(2, "no light of the scene has an id", *room)
        self.bad(2, "--layers light-groups needs an integrator that separates lights: path", *lamps, "-o", "d.exr",
                 "--integrator", "bdpt")

    def assert_add_up(self, name, *layers):
        channels = read_exr((self.path / name).read_bytes())
        for c in "RGB":
            for whole, *parts in zip(channels[c], *(channels[f"{layer}.{c}"] for layer in layers)):
                self.assertAlmostEqual(whole, sum(parts), delta=1e-5 * (1 + abs(whole)))

    def test_runs_of_the_network(self):
        """Three images, of all samples and of both halves; and two features where these have noise."""
        for options in ((), (*IICV, "--denoise", "error")):
            runs = self.path / "runs"
            self.good("render", ROOM, *SMALL, "-o", "a.exr", "--spp", "24", *options, "--json", "a.json", "--oidn",
                      os.environ["STAND_IN_DENOISER"], env={**os.environ, "STAND_IN_RUNS": str(runs)})
            self.assertEqual(json.loads((self.path / "a.json").read_text())["denoiser_runs"], 3)
            self.assertEqual(len(runs.read_bytes()), 3)
            runs.unlink()

    def test_renders_that_do_not_fit(self):
        noise, n, size = exponential_noise(6), 96 * 64, (96, 64)
        grey = lambda values, **more: exr({c: values for c in "RGB"}, size, **more)  # noqa: E731
        first, second = ([noise() for _ in range(n)] for _ in range(2))
        self.write("a.exr", grey(first))
        self.write("b.exr", grey(second))
        self.write("bright.exr", grey([1.5 * v for v in second]))
        smooth = [[sum(values[max(0, i - 7):i + 8]) / 15 for i in range(n)] for values in (first, second)]
        self.write("smooth0.exr", grey(smooth[0]))
        self.write("smooth1.exr", grey(smooth[1]))
        out = ("-o", "out.exr", *PLAIN)
        self.good("denoise", "a.exr", "b.exr", *out)
        self.bad(1, "exposure", "denoise", "a.exr", "bright.exr", *out)
        self.bad(1, "(--force denoises them anyway)", "denoise", "a.exr", "bright.exr", *out)
        self.bad(1, "they were denoised before", "denoise", "smooth0.exr", "smooth1.exr", *out)
        forced = self.good("denoise", "smooth0.exr", "smooth1.exr", *out, "--force").stderr
        self.assertRegex(forced, "warning: .*they were denoised before")
        self.write("near.exr", grey([v * (1 + 1e-6 * (i % 5)) for i, v in enumerate(first)]))
        self.bad(1, "a.exr and near.exr have the same noise: the same seed was rendered twice", "denoise", "a.exr",
                 "near.exr", *out)
        # Of covary by their attributes, of Cycles by its layer.
        self.good("denoise", "b.exr", "a.exr", "-o", "other.exr", *PLAIN)
        self.bad(1, "out.exr … other.exr is denoised already (mixture --denoise auto --oidn off)", "denoise",
                 "out.exr", "other.exr", "-o", "again.exr", *PLAIN)
        for name, values in (("x", first), ("y", second)):
            self.write(f"{name}.exr", exr({f"ViewLayer.{layer}.{c}": values for layer in ("Combined", "Noisy Image")
                                           for c in "RGB"}, size))
        self.bad(1, "is denoised already (by Cycles", "denoise", "x.exr", "y.exr", "-o", "again.exr", *PLAIN,
                 "--layer", "ViewLayer.Combined")
        for name, samples in (("few", "16"), ("many", "64")):
            self.write(f"{name}.exr", grey(first, attributes={"cycles.ViewLayer.samples": samples}))
        self.bad(1, "many.exr: has 64 samples per pixel, few.exr 16;", "denoise", "few.exr", "many.exr", *out)

    def test_values_that_cannot_be_used(self):
        """Of one render or both; what is left has the error that it has without them."""
        noise, (width, height) = exponential_noise(8), (96, 64)
        truth = [1 + 0.5 * math.sin(0.2 * (i % width)) for i in range(width * height)]
        renders = [[value * noise() for value in truth] for _ in range(2)]
        at = 30 * width + 40
        far = [i for i in range(width * height) if abs(i % width - 40) > 3 or abs(i // width - 30) > 3]

        def error(*bad):
            for name, values, value in zip("ab", renders, bad, strict=True):
                values = values if value is None else [*values[:at], value, *values[at + 1:]]
                self.write(f"{name}.exr", exr({c: values for c in "RGB"}, (width, height)))
            said = self.good("denoise", "a.exr", "b.exr", "-o", "out.exr", *PLAIN, "--verbose").stderr
            image = read_exr((self.path / "out.exr").read_bytes())
            self.assertLess(image["R"][at], 100)
            return said, sum((image["R"][i] - truth[i]) ** 2 for i in far) / len(far)

        _, usual = error(None, None)
        for value in (3e8, 1e9, 1e15, 1e19, 1e30, 3e38, math.inf, math.nan):
            for bad in ((value, None), (None, value), (value, value)):
                if bad[0] == bad[1] and 1 < value < 1e16:
                    continue  # both confirm it
                said, left = error(*bad)
                self.assertRegex(said, r"warning: the renders: 1 .* at \(40, 30\) in [ab].exr", bad)
                self.assertLess(abs(left / usual - 1), 0.05, bad)
                self.assertRegex(said, r"predicted relMSE 0\.0\d+,", bad)

    def test_few_samples_of_a_single_pass(self):
        options = ("--estimator", "none", "--denoise", "error", *PLAIN)
        self.assertIn("fewer than 4 samples per pixel",
                      self.statistics("-o", "a.exr", *options, "--spp", "3")["note"])
        self.assertIn("all samples are in one group, so that denoised",
                      self.statistics("-o", "c.exr", *options, "--spp", "5", "--groups", "1")["note"])
        facts = self.statistics("-o", "b.exr", *options, "--spp", "4")
        self.assertNotIn("note", facts)
        self.assertEqual(facts["samples_per_pixel"], 4)

    def test_clean_features(self):
        self.bad(2, "--clean-features has no effect with --no-features", "denoise", "a.exr", "-o", "b.exr",
                 "--clean-features", "--no-features")
        if self.run_covary("denoise", "--check").returncode != 0:
            return
        self.good("render", ROOM, *SMALL, "-o", "r.exr", "--estimator", "none", "--spp", "512", "--seed", "9")
        self.good("render", ROOM, *SMALL, "-o", "a.exr", "--estimator", "none", "--spp", "8", "--aovs")
        self.good("denoise", "a.exr", "-o", "plain.exr", "--quiet")
        self.good("denoise", "a.exr", "-o", "clean.exr", "--clean-features", "--quiet")
        self.assertNotEqual((self.path / "plain.exr").read_bytes(), (self.path / "clean.exr").read_bytes())
        self.assertLess(self.relmse("clean.exr", "r.exr"), self.relmse("a.exr", "r.exr"))

    def test_check(self):
        self.bad(2, "Open Image Denoise was not found (/nowhere/lib.so", "denoise", "--check", "--oidn",
                 "/nowhere/lib.so")
        self.bad(2, "expected IN.exr and -o OUT.exr, or --check", "denoise")
        result = self.run_covary("denoise", "--check", env={**os.environ, "COVARY_OIDN": ""})
        if result.returncode == 0:
            self.assertRegex(result.stdout, r"\AOpen Image Denoise 2\.\d+\.\d+\n.*libOpenImageDenoise\.so\.2\n\Z")
        else:
            self.assertIn("pip install pyoidn", result.stderr)


if __name__ == "__main__":
    unittest.main()
