# SPDX-License-Identifier: Apache-2.0
"""covary combine, as a user runs it, on small images with the layouts of several renderers."""
import json
import os
import random
import unittest
from pathlib import Path

from cli_test import CliTest
from exr_reader import read_exr
from exr_writer import FLOAT, HALF, UINT, exr

ROOM = str(Path(os.environ["SCENES"]) / "room.xml")
SIZE = WIDTH, HEIGHT = 24, 20
GROUPS = 12


def noisy(seed, common, groups=GROUPS, size=SIZE):
    """Groups of pixel values (r, g, b): relative noise that all pixels share up to a fifth, or none of it."""
    rng = random.Random(seed)
    shared = [[rng.random() - 0.5 for _ in range(3)] for _ in range(groups)]
    images = []
    for g in range(groups):
        image = {c: [] for c in "RGB"}
        for y in range(size[1]):
            for x in range(size[0]):
                for i, c in enumerate("RGB"):
                    own = rng.random() - 0.5
                    noise = 0.8 * shared[g][i] + 0.2 * own if common else own
                    image[c].append((1 + 0.02 * x + 0.1 * i) * (1 + noise))
        images.append(image)
    return images


def mean(values):
    return sum(values) / len(values)


IICV = ["--estimator", "iicv"]

class Combine(CliTest):
    def layers(self, name, images, size=SIZE, stem="group", types=None, **attributes):
        channels = {f"{stem}{g:02d}.{c}": image[c] for g, image in enumerate(images) for c in "RGB"}
        return self.write(name, exr(channels, size, None, {f"covary:{k}": v for k, v in attributes.items()},
                                    types and {c: types for c in channels}))

    def setUp(self):
        super().setUp()
        self.crn_images, self.independent_images = noisy(1, True), noisy(2, False)
        self.layers("crn.exr", self.crn_images, sampling="crn", samples="96", scene_hash="a", settings="box")
        self.layers("independent.exr", self.independent_images, sampling="independent", samples="96", scene_hash="a",
                    settings="box")

    def read(self, name):
        return read_exr((self.path / name).read_bytes())

    def squared_error(self, channels):
        return mean([(channels[c][y * WIDTH + x] - (1 + 0.02 * x + 0.1 * i)) ** 2
                     for i, c in enumerate("RGB") for y in range(HEIGHT) for x in range(WIDTH)])

    def test_result_has_less_noise(self):
        self.good("combine", "--crn", "crn.exr", "--independent", "independent.exr", "-o", "out.exr", "--error",
                  "--quiet")
        out = self.read("out.exr")
        self.assertEqual(set(out), {f"{layer}{c}" for layer in ("", "StdError.", "Bias.") for c in "RGB"})
        independent = {c: [mean([image[c][p] for image in self.independent_images]) for p in range(WIDTH * HEIGHT)]
                       for c in "RGB"}
        # The independent image with both halves' samples has half of this error.
        self.assertLess(self.squared_error(out), 0.2 * self.squared_error(independent))
        predicted = mean([v * v for c in "RGB" for v in out["StdError." + c]])
        self.assertLess(predicted, 10 * self.squared_error(out))
        self.assertGreater(predicted, 0.1 * self.squared_error(out))

    def test_statistics(self):
        result = self.good("combine", "--crn", "crn.exr", "--independent", "independent.exr", "-o", "out.exr", "--json",
                           "-", "--quiet", "--estimator", "iicv")
        statistics = json.loads(result.stdout)
        self.assertEqual(statistics["estimator"], "iicv")
        self.assertEqual(statistics["crn_groups"], GROUPS)
        self.assertGreater(statistics["rank_correlation"]["crn_horizontal"]["value"], 0.5)
        self.assertLess(abs(statistics["rank_correlation"]["independent_horizontal"]["value"]), 0.1)
        self.assertEqual(result.stderr, "")
        # Half of the samples by themselves, and all of them.
        self.assertLess(4 * statistics["predicted_relmse"], statistics["independent_predicted_relmse"])
        info = self.good("info", "out.exr").stdout
        self.assertIn("covary:estimator: iicv", info)
        self.assertIn("covary:samples: 192", info)

    def test_device(self):
        """OpenCL on the processor, as scripts/setup installs it, stands for any device."""
        inputs = ["combine", "--crn", "crn.exr", "--independent", "independent.exr", "--quiet", "--error"]
        devices = json.loads(self.good("info", "--devices", "--json").stdout)["devices"]
        opencl = next(d for d in devices if d["id"] == "opencl:0")
        self.assertIn("opencl:0: " + opencl["name"], self.good("info", "--devices").stdout)
        name = f"opencl:0 ({opencl['name']})"
        for words in (IICV, ["--paper"], ["--estimator", "cv-baseline", "--set", "ridge=0.1"],
                      ["--estimator", "iduw", "--samples", "96"]):
            error = [] if "iduw" in words else ["--error"]
            self.good(*inputs[:-1], *error, *words, "-o", "cpu.exr")
            result = self.good(*inputs[:-1], *error, *words, "-o", "device.exr", "--device", "opencl:0", "--json",
                               "-")
            self.assertEqual(json.loads(result.stdout)["device"], name)
            self.assertIn("covary:device: " + name, self.good("info", "device.exr").stdout)
            self.assertNotIn("covary:device", self.good("info", "cpu.exr").stdout)
            expected, found = self.read("cpu.exr"), self.read("device.exr")
            by_halves = {f"Bias.{c}" for c in "RGB"} if words == IICV else set()  # on devices only
            self.assertEqual(set(found), set(expected) | by_halves)
            factor = 1  # standard errors have the same shape, but are scaled to two estimates of the same error
            if words == IICV:
                factor = mean(found["StdError.G"]) / mean(expected["StdError.G"])
                self.assertTrue(0.6 < factor < 1.6, factor)
            for channel, values in expected.items():
                if channel.startswith("StdError"):
                    values = [factor * value for value in values]
                close = [abs(a - b) <= 1e-4 * (abs(a) + 0.01) for a, b in zip(values, found[channel])]
                self.assertGreaterEqual(mean(close), 0.998, (words, channel))
        output = ["-o", "out.exr", "--device"]
        self.bad(2, "--device 'gpu': expected cpu, auto, cuda, opencl, or one of these devices, e.g. opencl:1",
                 *inputs, *output, "gpu")
        self.bad(2, "--device opencl:99: there is no device 'opencl:99'; found: ", *inputs, *output, "opencl:99")
        self.bad(2, "--device opencl:0: devices know the estimators iicv, cv-baseline, iduw, dependent-tests; "
                 "polynomials runs on the processor", "render", ROOM, "--spp", "64", "--estimator", "polynomials",
                 *output, "opencl:0")
        self.bad(2, "--devices tells of this machine; it takes no file", "info", "cpu.exr", "--devices")

    def test_explain(self):
        inputs = ["combine", "--crn", "crn.exr", "--independent", "independent.exr", "-o", "out.exr", "--quiet",
                  "--paper"]
        pixel = json.loads(self.good(*inputs, "--explain", "7,19", "--json", "-").stdout)["pixel"]
        self.assertEqual(len(pixel["control_variates"]), 25)
        out = self.read("out.exr")
        for i, c in enumerate("RGB"):
            expected = pixel["crn"][i] - sum(v["beta"][i] * (v["crn"][i] - v["independent"][i])
                                             for v in pixel["control_variates"])
            self.assertAlmostEqual(out[c][19 * WIDTH + 7], expected, 5)
        table = self.good(*inputs, "--explain", "7,19").stdout
        self.assertEqual(len(table.splitlines()), 2 + 25)
        in_bands = self.good(*inputs, "--explain", "7,19", "--memory", "0.01").stdout
        self.assertEqual(in_bands, table)
        self.bad(2, "--explain 24,3 is outside the image: 24 x 20 pixels at (0, 0)", *inputs, "--explain", "24,3")
        self.bad(2, "iduw has no control variates with coefficients", "combine", "--crn", "crn.exr", "--independent",
                 "independent.exr", "-o", "out.exr", "--estimator", "iduw", "--explain", "1,1")

    def test_layouts_give_the_same_bits(self):
        self.good("combine", "--crn", "crn.exr", "--independent", "independent.exr", "-o", "a.exr", "--quiet")
        # One file per group: R G B beside another image (pbrt, Mitsuba), and Blender's passes.
        crn = [self.write(f"crn{g}.exr", exr({**image, **{"nn." + c: [0] * WIDTH * HEIGHT for c in "RGB"}}, SIZE))
               for g, image in enumerate(self.crn_images)]
        black = {"ViewLayer.Emit." + c: [0] * WIDTH * HEIGHT for c in "RGB"}
        independent = [self.write(f"independent{g}.exr",
                                  exr({**{"ViewLayer.Combined." + c: image[c] for c in "RGB"}, **black}, SIZE))
                       for g, image in enumerate(self.independent_images)]
        self.good("combine", "--crn", *crn, "--independent", *independent, "-o", "b.exr", "--quiet")
        expected = {f"ViewLayer.Combined.{c}": values for c, values in self.read("a.exr").items()}
        self.assertEqual(self.read("b.exr"), {**expected, **black}, "in the channels of the first independent image")
        self.layers("named.exr", self.crn_images, stem="pass.")
        self.good("combine", "--crn", "named.exr", "--crn-layer", "pass.", "--independent", "independent.exr", "-o",
                  "c.exr", "--quiet")
        self.assertEqual(self.read("a.exr"), self.read("c.exr"))

    def test_bands_count_each_pixel_once(self):
        size = (16, 200)
        crn, independent = noisy(1, True, 4, size), noisy(2, False, 4, size)
        for y in range(5, 200, 10):
            crn[1]["R"][y * 16 + 3] = float("inf")
        self.layers("tall_crn.exr", crn, size)
        self.layers("tall_independent.exr", independent, size)
        for memory in ("0.4", "100"):
            result = self.good("combine", "--crn", "tall_crn.exr", "--independent", "tall_independent.exr", "--force",
                               "--quiet", "-o", "out.exr", "--json", "-", "--memory", memory)
            self.assertEqual(json.loads(result.stdout)["nonfinite_pixels"], 20)

    def films(self, *resolutions):
        """Of a small scene: inputs of combine for each resolution."""
        inputs = []
        for size in resolutions:
            for sampling in ("crn", "independent"):
                self.good("render", ROOM, "--resolution", size, "--max-depth", "1", "--spp", "12", "--groups", "12",
                          "--estimator", "none", "--sampling", sampling, "--seed", str(len(sampling)), "--no-preview",
                          "--quiet", "-o", f"{sampling}-{size}.exr")
            inputs.append(["combine", "--crn", f"crn-{size}.exr", "--independent", f"independent-{size}.exr",
                           "--quiet", "-o", "out.exr", "--json", "-", "--force"])  # groups may be alike
        return inputs

    @unittest.skipIf("SANITIZED" in os.environ, "sanitizers take memory of their own")
    def test_memory(self):
        """What is planned beforehand is about what is taken; as much as is permitted."""
        small, middle, large = self.films("80x60", "400x300", "800x600")
        for options in (IICV, [*IICV, "--error"], ["--estimator", "cv-baseline", "--error"], ["--estimator", "iduw"],
                        [*IICV, "--denoise", "balanced", "--oidn", "off"],
                        ["--error", "--oidn", "off"]):
            with self.subTest(options):
                facts = [json.loads(self.good(*inputs, *options).stdout) for inputs in (small, middle)]
                planned, taken = (facts[1][key] - facts[0][key]
                                  for key in ("planned_memory_bytes", "peak_memory_bytes"))
                self.assertGreater(planned, 0.8 * taken)
                self.assertLess(planned, 1.3 * taken)
        bands = json.loads(self.good(*large, *IICV, "--error", "--memory", "250").stdout)
        self.assertLess(bands["planned_memory_bytes"], 250 << 20)
        self.assertLess(bands["peak_memory_bytes"], 300e6)
        self.bad(2, "800 x 600 pixels of 12 + 12 groups need 217.4 MB of memory for iduw, which works on whole "
                 "images; 157.3 MB are allowed (--memory)", *large, "--estimator", "iduw", "--memory", "150")
        balanced = (*large, *IICV, "--denoise", "balanced", "--oidn", "off", "--memory")
        self.bad(2, "of memory for iicv --denoise balanced --oidn off; 209.7 MB are allowed", *balanced, "200")
        self.assertLess(json.loads(self.good(*balanced, "440").stdout)["peak_memory_bytes"], 440 << 20)
        self.bad(2, "the limit is 200.0 MB: use less, or raise it by the environment variable COVARY_MEMORY",
                 *large, "--estimator", "iduw", env=os.environ | {"COVARY_MEMORY": "0.2"})

    def test_checks_refuse_and_can_be_forced(self):
        inputs = ["--crn", "independent.exr", "--independent", "crn.exr", "-o", "out.exr"]
        result = self.bad(1, "are CRN and independent image swapped?", "combine", *inputs)
        self.assertIn("the files say that the CRN image was rendered with sampling 'independent' and the independent "
                      "image with 'crn'", result.stderr)
        self.assertIn("(--force combines them anyway)", result.stderr)
        forced = self.good("combine", *inputs, "--force")
        self.assertIn("warning: independent image: errors of neighbouring pixels", forced.stderr)
        self.assertTrue((self.path / "out.exr").exists())

    def test_wide_filter(self):
        wide = []
        for image in self.independent_images:
            wide.append({c: [0.1 * v[max(p - 1, 0)] + 0.8 * v[p] + 0.1 * v[min(p + 1, len(v) - 1)]
                             for p in range(len(v))]
                         for c, v in image.items()})
        self.layers("wide.exr", wide)
        self.bad(1, 'in Mitsuba <rfilter type="box"/>', "combine", "--crn", "crn.exr", "--independent", "wide.exr",
                 "-o", "out.exr")

    def test_attributes_that_contradict(self):
        self.layers("other.exr", self.independent_images, sampling="independent", samples="96", scene_hash="b",
                    settings="tent")
        result = self.bad(1, "different scenes", "combine", "--crn", "crn.exr", "--independent", "other.exr", "-o",
                          "out.exr")
        self.assertIn("the CRN image with 'box', the independent image with 'tent'", result.stderr)

    def test_half_floats_are_accepted_with_a_warning(self):
        self.layers("half.exr", self.independent_images, types=HALF)
        result = self.good("combine", "--crn", "crn.exr", "--independent", "half.exr", "-o", "out.exr")
        self.assertIn("warning: independent image: values have 16 bits", result.stderr)

    def test_not_finite(self):
        self.independent_images[3]["G"][5] = float("nan")
        self.layers("nan.exr", self.independent_images)
        inputs = ["--crn", "crn.exr", "--independent", "nan.exr", "-o", "out.exr"]
        result = self.good("combine", *inputs, "--quiet", "--json", "-")
        self.assertIn("warning: independent image: 1 of 480 pixels hold NaN, infinite or overflowing values, the first "
                      "at (5, 0) in render 4; these values are left out", result.stderr)
        self.assertEqual(json.loads(result.stdout)["nonfinite_pixels"], 1)
        self.assertTrue(all(v == v for c in self.read("out.exr").values() for v in c))

    def test_wrong_usage(self):
        inputs = ["combine", "--crn", "crn.exr", "--independent", "independent.exr", "-o", "out.exr"]
        self.bad(2, "k is 500, expected 1 to 121", *inputs, "--set", "k=500")
        self.bad(2, "--set window: '10': expected an odd whole number from 3 to 63", *inputs, "--set", "window=10")
        self.bad(2, "--set penalty is an option of --estimator iicv, not of iduw", *inputs, "--estimator", "iduw",
                 "--set", "penalty=pilot")
        self.bad(2, "--samples is an option of --counts and --estimator iduw, not of iicv", *inputs, "--samples", "3")
        self.bad(2, "--set penalty: 'none'", *inputs, "--set", "penalty=none")
        self.bad(2, "--independent is required", "combine", "--crn", "crn.exr", "-o", "out.exr")
        self.layers("two.exr", self.crn_images[:2])
        self.bad(2, "the CRN image has 2 groups, at least 3 are needed", "combine", "--crn", "two.exr", "--independent",
                 "independent.exr", "-o", "out.exr", "--force")
        self.layers("anonymous.exr", self.crn_images)
        self.bad(2, "needs --samples N", "combine", "--crn", "anonymous.exr", "--independent", "independent.exr", "-o",
                 "out.exr", "--estimator", "iduw")

    def counted(self, name, counts, size=SIZE, kind=UINT, channel="Y"):
        return self.write(name, exr({channel: counts}, size, None, None, {channel: kind}))

    def test_counts_of_pixels(self):
        self.layers("plain.exr", self.independent_images)
        inputs = ["combine", "--crn", "crn.exr", "--independent", "plain.exr", "--quiet"]
        counts = [12 * (1 + p % 5) for p in range(WIDTH * HEIGHT)]
        self.counted("counts.exr", counts)
        self.good(*inputs, "-o", "uniform.exr")
        self.good(*inputs, "-o", "counted.exr", "--counts", "counts.exr")
        self.assertNotEqual(self.read("counted.exr"), self.read("uniform.exr"))
        self.assertIn("covary:samples: 132\n", self.good("info", "counted.exr").stdout)  # 96 + 36
        # Equal counts are none; kinds of pixels and names of channels do not matter.
        self.counted("equal.exr", [36] * len(counts))
        self.good(*inputs, "-o", "equal.out.exr", "--counts", "equal.exr")
        self.assertEqual(self.read("equal.out.exr"), self.read("uniform.exr"))
        self.write("floats.exr", exr({"samples": [float(n) for n in counts], "Z": [0] * len(counts)}, SIZE))
        for memory in ("100", "0.02"):
            self.good(*inputs, "-o", "floats.out.exr", "--counts", "floats.exr", "--memory", memory)
            self.assertEqual(self.read("floats.out.exr"), self.read("counted.exr"))

    def test_pixels_without_samples(self):
        self.layers("plain.exr", self.independent_images)
        self.counted("counts.exr", [0 if p == 7 else 24 for p in range(WIDTH * HEIGHT)])
        inputs = ["combine", "--crn", "crn.exr", "--independent", "plain.exr", "--counts", "counts.exr", "--quiet"]
        self.good(*inputs, "-o", "out.exr", "--estimator", "dependent-tests", "--paper", "--samples", "96")
        crn = [mean([image[c][7] for image in self.crn_images]) for c in "RGB"]
        for c, expected in zip("RGB", crn):
            self.assertAlmostEqual(self.read("out.exr")[c][7], expected, 5)
        self.bad(2, "pixel (7, 0) of the independent image has 0 samples, fewer than the 12 groups", *inputs, "-o",
                 "out.exr", "--force")

    def test_wrong_counts(self):
        self.layers("plain.exr", self.independent_images)
        inputs = ["combine", "--crn", "plain.exr", "--independent", "independent.exr", "-o", "out.exr", "--force"]
        self.counted("counts.exr", [24] * (WIDTH * HEIGHT))
        self.bad(2, "--counts needs --samples N, the samples per pixel of the CRN image", *inputs, "--counts",
                 "counts.exr")
        inputs += ["--samples", "24", "--counts"]
        self.counted("small.exr", [24] * 48, (8, 6))
        self.bad(1, "small.exr: 8 x 6 pixels at (0, 0); independent.exr has 24 x 20 at (0, 0)", *inputs, "small.exr")
        self.counted("odd.exr", [24] * 30 + [1.5] + [24] * (WIDTH * HEIGHT - 31), kind=FLOAT)
        self.bad(1, "odd.exr: 1.5 at (6, 1); expected whole numbers of samples", *inputs, "odd.exr")
        self.bad(1, "plain.exr: expected one channel, or one that is named 'samples'; channels in it: group00.B",
                 *inputs[:2], "crn.exr", *inputs[3:], "plain.exr")
        self.bad(2, "are the same file", *inputs, "independent.exr")

    def test_sizes_must_agree(self):
        self.layers("small.exr", noisy(2, False, 4, (8, 6)), (8, 6))
        self.bad(1, "small.exr has 8 x 6 pixels at (0, 0) of 8 x 6; both images must show the same pixels", "combine",
                 "--crn", "crn.exr", "--independent", "small.exr", "-o", "out.exr")


if __name__ == "__main__":
    unittest.main()
