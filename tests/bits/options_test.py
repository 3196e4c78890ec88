# SPDX-License-Identifier: Apache-2.0
"""Options that leave the image as it is leave its bits: what is computed beside it, threads, memory, and whether the
program or Python asked. One table of methods, one of such options; each suite runs all pairs that are possible."""
import array
import json
import os
import random
import tempfile
import unittest
from pathlib import Path

from cli_test import CliTest
from exr_reader import read_exr
from exr_writer import exr

SCENE = str(Path(os.environ["SCENES"]) / "room.xml")
#: Several tiles and bands of rows; a row is not a whole number of vectors.
SIZE = WIDTH, HEIGHT = 20, 240
GROUPS = 12
NETWORK = ("--oidn", os.environ["STAND_IN_DENOISER"])
FILTERS = ("--oidn", "off")
GUIDES = ("--features", "features.exr")
MODES = ("auto", "bias", "balanced", "error")
#: Of a method's options, only each so many-th is tried, others for the next method.
STEP = int(os.environ.get("OPTIONS_STEP", "1"))

#: Methods that combine a pair: words of the program.
PAIR = [
    *[("--estimator", "iicv", *words.split()) for words in (
        "", "--paper", "--set k=9", "--set window=7", "--set penalty=asymmetric", "--set penalty=sample",
        "--paper --set k=50", "--paper --set penalty=sample", "--paper --set penalty=asymmetric")],
    *[("--estimator", "cv-baseline", *words.split()) for words in (
        "", "--set ridge=0.1", "--set k=50 --set window=11")],
    *[("--estimator", "iduw", "--samples", "96", *words) for words in ((), ("--set", "window=7"))],
    *[("--estimator", "dependent-tests", *words.split()) for words in ("", "--paper", "--paper --set falloff=spline")],
]
#: With denoising.
DENOISED_PAIR = [
    *[("--estimator", "iicv", "--denoise", mode, *FILTERS, *GUIDES) for mode in MODES],
    ("--estimator", "iicv", "--denoise", "auto", *FILTERS),
    ("--estimator", "iicv", "--paper", "--denoise", "error", *NETWORK, *GUIDES),
    ("--estimator", "cv-baseline", "--denoise", "balanced", *FILTERS, *GUIDES),
]
#: Methods of the independent image alone.
MEAN = [
    *[("--denoise", mode, *FILTERS, *GUIDES) for mode in MODES],
    ("--denoise", "auto", *FILTERS),
    ("--denoise", "auto", *NETWORK, *GUIDES),
    ("--denoise", "error", *NETWORK),
]
#: Options of `combine` for all methods, for those of a limited reach, of a pair without and with denoising, and of one
#: image.
OPTIONS = [("--error",), ("--json", "facts.json"), ("--error", "--json", "facts.json"), ("--threads", "1"),
           ("--error", "--threads", "3")]
#: As few rows at a time as possible.
BANDS = [("--memory", "0.1"), ("--memory", "0.1", "--error")]
EXPLAINED = [("--explain", "7,100"), ("--explain", "7,100", "--error")]
STAGES = [("--save-stages", "stages"), ("--save-stages", "stages", "--error")]
LAYERS = [("--layers", "part"), ("--layers", "part", "--error")]

#: Methods of `render`, those that have layers first, and options for all of them.
RENDERED_LAYERS = [("--estimator", "none", "--denoise", *words)
                   for words in (("none",), ("auto", *FILTERS), ("auto", *NETWORK))]
RENDERED = [
    *[("--estimator", "none", "--denoise", "none", "--integrator", name)
      for name in ("bdpt", "guided-path", "controlled-path")],
    ("--estimator", "iicv"), ("--estimator", "iicv", "--denoise", "error", *FILTERS), ("--estimator", "cv-baseline"),
    ("--estimator", "iduw"), ("--estimator", "dependent-tests"), ("--estimator", "polynomials"),
    ("--adaptive", *FILTERS),
]
OF_RENDER = [("--json", "facts.json"), ("--threads", "1"), ("--threads", "3", "--passes", "films", "--overwrite"),
             ("--aovs",)]
LAYERS_OF_RENDER = [("--layers", "direct"), ("--layers", "direct", "--aovs", "--threads", "1")]


def noisy(seed, common):
    """Groups of pixel values, channel -> values: relative noise that all pixels share up to a fifth, or none of it."""
    rng = random.Random(seed)
    images = []
    for _ in range(GROUPS):
        shared = [rng.random() - 0.5 for _ in "RGB"]
        images.append({c: [(1 + 0.02 * x + 0.1 * i + 0.5 * (y % 60 > 30)) *
                           (1 + (0.8 * shared[i] + 0.2 * (rng.random() - 0.5) if common else rng.random() - 0.5))
                           for y in range(HEIGHT) for x in range(WIDTH)] for i, c in enumerate("RGB")})
    return images


def bits(channels, layer=""):
    """The values of a colour, pixel by pixel."""
    return array.array("f", [v for pixel in zip(*(channels[layer + c] for c in "RGB")) for v in pixel]).tobytes()


class OptionsTest(CliTest):
    """The images that `combine` gets are written once."""

    n_checked = 0

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.inputs = Path(folder.name)
        rng = random.Random(3)

        def write(name, channels):
            (cls.inputs / f"{name}.exr").write_bytes(exr(channels, SIZE))

        def groups(images):
            return {f"group{g:02d}.{c}": image[c] for g, image in enumerate(images) for c in "RGB"}

        images, after = noisy(2, False), noisy(4, False)
        write("crn", groups(noisy(1, True)))
        write("independent", groups(images))
        for n, frame in ((1, images), (2, after)):
            write(f"frame{n}", {**groups(frame), **{f"Motion.{c}": [0.0] * WIDTH * HEIGHT for c in "XYZ"}})
        for g, image in enumerate(images):  # with a layer
            write(f"group{g}", {**image, **{f"part.{c}": [v * 0.25 for v in image[c]] for c in "RGB"}})
        write("features", {f"{name}.{c}": [rng.random() * 0.5 + 0.25 for _ in range(WIDTH * HEIGHT)]
                         for name, letters in (("Albedo", "RGB"), ("N", "XYZ")) for c in letters})

    def setUp(self):
        super().setUp()
        for path in self.inputs.iterdir():
            (self.path / path.name).symlink_to(path)

    def read(self, name="out.exr"):
        return read_exr((self.path / name).read_bytes())

    def same(self, a, b, layer):
        n = sum(p != q for p, q in zip(array.array("f", a), array.array("f", b)))
        self.assertTrue(a == b, f"{n} of {len(a) // 4} values of {layer or 'the image'} differ")

    def check(self, command, options):
        """Runs `command` plainly and with each of `options`; images and their errors must agree."""
        self.good(*command)
        images = {"": bits(self.read())}
        self.n_checked += 1
        self.tried = options[self.n_checked % STEP::STEP]
        for more in self.tried:
            with self.subTest(" ".join((*command, *more))):
                self.good(*command, *more)
                channels = self.read()
                if command[0] == "combine":
                    self.assertEqual("StdError.R" in channels, "--error" in more)
                for layer in ("", "StdError.", "Bias."):
                    if layer + "R" in channels:
                        self.same(bits(channels, layer), images.setdefault(layer, bits(channels, layer)), layer)
        return images


class Combine(OptionsTest):
    COMMAND = ("combine", "--crn", "crn.exr", "--independent", "independent.exr", "-o", "out.exr", "--quiet", "--force")

    def test_pair(self):
        different = set()
        for method in PAIR:
            with_variates = "iicv" in method or "cv-baseline" in method  # which have an error, too
            options = OPTIONS + BANDS + EXPLAINED if with_variates else [
                more for more in OPTIONS if "--error" not in more]
            images = self.check((*self.COMMAND, *method), options)
            self.assertEqual("StdError." in images, with_variates and any("--error" in more for more in self.tried))
            different.add(images[""])
        self.assertEqual(len(different), len(PAIR))

    def test_denoised_pair(self):
        for method in DENOISED_PAIR:
            self.check((*self.COMMAND, *method), OPTIONS + STAGES)

    def test_mean(self):
        files = [f"group{g}.exr" for g in range(GROUPS)]
        for method in MEAN:
            self.check(("combine", "--independent", *files, "-o", "out.exr", "--quiet", *method),
                       OPTIONS + STAGES + LAYERS)

    def test_bands(self):
        """The memory that BANDS permits makes bands."""
        planned = []
        for memory in ((), BANDS[0]):
            self.good(*self.COMMAND, "--estimator", "iicv", *memory, "--json", "facts.json")
            planned.append(json.loads((self.path / "facts.json").read_text())["planned_memory_bytes"])
        self.assertLess(planned[1], planned[0])

    def test_frames(self):
        """With the history of the frame before."""
        command = ("combine", "--independent", "frame#.exr", "-o", "out#.exr", "--quiet", "--denoise", "error",
                   *FILTERS)
        self.good(*command, "--no-history")
        alone = bits(self.read("out2.exr"))
        self.good(*command)
        expected = [bits(self.read(f"out{n}.exr")) for n in (1, 2)]
        self.assertNotEqual(expected[1], alone)
        for more in (("--error",), ("--json", "facts#.json"), ("--threads", "1")):
            self.good(*command, *more)
            for n in (1, 2):
                self.same(bits(self.read(f"out{n}.exr")), expected[n - 1], more)


class Render(OptionsTest):
    def test_methods(self):
        for method in RENDERED_LAYERS + RENDERED:
            layers = LAYERS_OF_RENDER if method in RENDERED_LAYERS else []
            self.check(("render", SCENE, "-o", "out.exr", "--quiet", "--no-preview", "--overwrite", "--resolution",
                        "24x40", "--spp", "24", *method), OF_RENDER + layers)


def keywords(words):
    """Arguments of covary.combine() for words of the program."""
    result = {}
    for name, *rest in zip(words, [*words[1:], "--"]):
        if name.startswith("--"):
            value = True if rest[0].startswith("--") else rest[0]
            if name == "--set":
                parameter, value = value.split("=")
                name = "--" + parameter
            numeric = value is not True and value.replace(".", "").isdecimal()
            result[name[2:].replace("-", "_")] = float(value) if numeric and "." in value else (
                int(value) if numeric else value)
    return result


class Python(OptionsTest):
    """The package gives the bits of the program."""

    def compare(self, command, words, *images):
        import covary
        arguments = keywords(words)
        if arguments.pop("features", None):
            arguments |= {"albedo": covary.read_image(self.path / "features.exr", "Albedo"),
                          "normal": covary.read_image(self.path / "features.exr", "N")}
        estimator = arguments.pop("estimator", "mixture")
        result = covary.combine(*images, estimator, force=True, **arguments)
        plain = covary.combine(*images, estimator, force=True, std_error=False, **arguments)
        self.same(plain.image.tobytes(), result.image.tobytes(), "")
        self.assertIsNone(plain.std_error)
        error = [] if result.std_error is None else ["--error"]
        self.good(*command, *words, *error)
        channels = self.read()
        for layer, image in (("", result.image), ("StdError.", result.std_error), ("Bias.", result.bias)):
            self.assertEqual(image is not None, layer + "R" in channels, layer)
            if image is not None:
                self.same(image.tobytes(), bits(channels, layer), layer)

    def test_methods(self):
        import covary
        crn, independent = (covary.read_groups(self.path / name) for name in ("crn.exr", "independent.exr"))
        for words in PAIR + DENOISED_PAIR:
            with self.subTest(" ".join(words)):
                self.compare(Combine.COMMAND, words, crn, independent)
        for words in MEAN:
            with self.subTest(" ".join(words)):
                self.compare(("combine", "--independent", "independent.exr", "-o", "out.exr", "--quiet"), words, None,
                             independent)


if __name__ == "__main__":
    unittest.main()
