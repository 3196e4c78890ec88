# SPDX-License-Identifier: Apache-2.0
"""The commands as a user runs them: results, messages, exit codes (0 done, 1 failed, 2 wrong usage), files left."""
import json
import math
import os
import re
import resource
import subprocess
import tempfile
import unittest
import zlib
from pathlib import Path

from exr_reader import read_exr
from exr_writer import HALF, UINT, exr, film

COVARY = os.environ["COVARY"]
# About how many times slower the program is under a sanitizer (scripts/sanitized).
SLOWDOWN = {"tsan": 10, "asan": 4}.get(os.environ.get("SANITIZED"), 1)


class CliTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def write(self, name, data):
        (self.path / name).write_bytes(data)
        return name

    def image(self, name, rgb, size=(4, 3), **more):
        """An image of one colour."""
        n = size[0] * size[1] if "window" not in more else more["window"][2] * more["window"][3]
        return self.write(name, exr({c: [v] * n for c, v in zip("RGB", rgb)}, size, **more))

    def run_covary(self, *arguments, **more):
        result = subprocess.run([COVARY, *arguments], cwd=self.path, capture_output=True, text=True,
                                timeout=60 * SLOWDOWN, **more)
        self.assertNotIn("internal error", result.stderr)
        return result

    def replacing(self, arguments):
        """The words, with --overwrite if they render into a file that there is, as tests do with other settings."""
        if arguments[:1] != ("render",) or "-o" not in arguments or {"--resume", "--overwrite"} & set(arguments):
            return arguments
        output = arguments[arguments.index("-o") + 1]
        exists = (self.path / output).exists() or ("#" in output and any(self.path.glob(re.sub("#+", "*", output))))
        return (*arguments, "--overwrite") if exists else arguments

    def good(self, *arguments, **more):
        result = self.run_covary(*self.replacing(arguments), **more)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def bad(self, code, message, *arguments, **more):
        """The command fails with this exit code and one line on stderr that contains `message`."""
        before = {p.name: p.read_bytes() for p in self.path.iterdir() if p.is_file()}
        result = self.run_covary(*arguments, **more)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertIn(message, result.stderr)
        self.assertTrue(result.stderr.startswith("covary: "), result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertEqual(result.stdout, "")
        after = {p.name: p.read_bytes() for p in self.path.iterdir() if p.is_file()}
        self.assertEqual(before, after, "a failed command must change no file")
        return result


class Help(CliTest):
    def test_without_arguments_shows_help(self):
        result = self.good()
        for command in ("compare", "merge", "info", "convert"):
            self.assertIn(command, result.stdout)
        self.assertEqual(self.good("--help").stdout, result.stdout)

    def test_help_of_each_command(self):
        for command in ("compare", "merge", "info", "convert"):
            self.assertIn(f"covary {command}", self.good(command, "--help").stdout)

    def test_version(self):
        self.assertRegex(self.good("--version").stdout, r"^covary \d+\.\d+\.\d+( \([0-9a-f]+(-dirty)?\))?\n$")

    def test_wrong_usage(self):
        self.bad(2, "unknown command 'compar'; did you mean 'compare'", "compar")
        self.bad(2, "unknown command 'zzzzzzzz'; 'covary --help'", "zzzzzzzz")
        self.bad(2, "unknown option '--verzion'; did you mean '--version'", "--verzion")
        self.bad(2, "unknown option '--refrence'; did you mean '--reference'", "compare", "a.exr", "--refrence",
                 "b.exr")
        self.bad(2, "unknown option '--sp'; did you mean '--spp'? See 'covary render --help'", "render", "a.xml",
                 "--sp", "8")
        self.bad(2, "unknown option '--resol'; did you mean '--resolution'?", "render", "a.xml", "--resol", "8x8")
        self.bad(2, "--reference is required; see 'covary compare --help'", "compare", "a.exr")
        self.bad(2, "too many arguments, beginning with 'b.exr'", "info", "a.exr", "b.exr")
        self.bad(2, "unknown command 'my room.xml'; write: covary render 'my room.xml' -o 'my room.exr'; ",
                 "my room.xml")
        self.bad(2, "--spp is given 2 times; give it once; see", "render", "a.xml", "--spp", "8", "--spp", "16")

    def test_options_of_other_programs(self):
        for given, here in (("--samples=8", "--spp INT"), ("--width", "--resolution WIDTHxHEIGHT"),
                            ("--sensor", "--camera NAME|NUMBER|auto"), ("--depth", "--max-depth INT")):
            self.bad(2, f"unknown option '{given.split('=')[0]}': write {here}; see", "render", "a.xml", given)
        self.bad(2, "unknown option '--samples'; see", "view", "a.exr", "--samples", "8")  # which has no --spp

    def test_full_standard_output(self):
        name = self.image("a.exr", (1, 2, 3))
        with open("/dev/full", "w") as full:
            result = subprocess.run([COVARY, "info", name], cwd=self.path, stdout=full, stderr=subprocess.PIPE,
                                    text=True)
        self.assertEqual((result.returncode, result.stderr), (1, "covary: cannot write to standard output\n"))


class Compare(CliTest):
    def setUp(self):
        super().setUp()
        self.image("ref.exr", (1, 2, 3))
        self.image("a.exr", (1.5, 2, 3))

    def errors(self, *arguments):
        return [json.loads(line) for line in self.good("compare", *arguments, "--json", "-").stdout.splitlines()]

    def test_values(self):
        errors = self.errors("a.exr", "ref.exr", "--reference", "ref.exr", "--metric", "relmse,mse,mae,mape,flip")
        self.assertEqual([e["image"] for e in errors], ["a.exr", "ref.exr"])
        self.assertAlmostEqual(errors[0]["relmse"], 0.25 / (3 * 4.01), places=7)
        self.assertAlmostEqual(errors[0]["mse"], 0.25 / 3, places=7)
        self.assertAlmostEqual(errors[0]["mae"], 0.5 / 3, places=7)
        self.assertAlmostEqual(errors[0]["mape"], 0.5 / 1.01 / 3, places=7)
        self.assertTrue(0 < errors[0]["flip"] < 1)
        self.assertEqual([errors[1][m] for m in ("relmse", "mse", "mae", "mape", "flip")], [0] * 5)
        self.assertEqual((errors[0]["pixels"], errors[0]["non_finite_pixels"]), (12, 0))
        self.assertAlmostEqual(errors[0]["mean"] / errors[0]["reference_mean"], 6.5 / 6)

    def test_text_says_the_formula(self):
        output = self.good("compare", "a.exr", "--reference", "ref.exr").stdout
        self.assertIn("relmse = 1/(3N) sum ||F - R||^2 / (R'^2 + 0.01)", output)
        self.assertIn("0.0207814", output)
        self.image("r2.exr", (2, 2, 3))
        output = self.good("compare", "a.exr", "--reference", "ref.exr", "--reference2", "r2.exr").stdout
        self.assertIn("sum (F - R1).(F - R2)", output)
        weights = [1 / ((grey / 3) ** 2 + 0.01) for grey in (6, 7)]  # of each reference, here without noise
        self.assertIn("%.6g" % (-0.25 / 3 * sum(weights) / 2), output)
        self.assertIn("D' = mean of RGB of the denoised references", output)

    def test_two_references_and_a_denominator(self):
        for name, value in (("f.exr", 2.5), ("r1.exr", 1), ("r2.exr", 3), ("d.exr", 2)):
            self.image(name, (value,) * 3)
        two = ("compare", "f.exr", "--reference", "r1.exr", "--reference2", "r2.exr")
        result = self.good(*two, "--denominator", "d.exr", "--json", "--metric", "relmse,mse,mae")
        errors = json.loads(result.stdout)
        self.assertAlmostEqual(errors["relmse"], -0.75 / 4.01, places=7)  # (2.5 - 1) (2.5 - 3)
        # (F - R) (R1 - R2) = 0.5 * -2 in each of 12 pixels.
        self.assertAlmostEqual(errors["relmse_reference_error"], 1 / 4.01 / math.sqrt(12), places=7)
        self.assertAlmostEqual(errors["mse_reference_error"], 1 / math.sqrt(12), places=7)
        self.assertNotIn("mae_reference_error", errors)
        self.assertIn("warning: f.exr: the noise of the references makes the relmse of -0.187 uncertain by ±0.072",
                      result.stderr)
        self.assertIn("D' = mean of RGB of d.exr", self.good(*two, "--denominator", "d.exr").stdout)
        self.bad(2, "--denominator is an option of relmse", *two, "--metric", "mse", "--denominator", "d.exr")
        self.bad(2, "--denominator is an option of relmse", *two[:4], "--denominator", "d.exr")
        self.image("part.exr", (2, 2, 2), window=(1, 1, 2, 2))
        self.bad(1, "--denominator 'part.exr' does not cover 4 x 3 at (0, 0)", *two, "--denominator", "part.exr")

    def test_json_file(self):
        self.assertIn("relmse = ", self.good("compare", "a.exr", "--reference", "ref.exr", "--json", "o.json").stdout)
        self.assertEqual(json.loads((self.path / "o.json").read_text())["image"], "a.exr")
        self.assertEqual(self.good("compare", "a.exr", "--reference", "ref.exr", "--json").stdout,
                         (self.path / "o.json").read_text())
        self.bad(2, "--json 'a.exr' names an image", "compare", "--json", "a.exr", "ref.exr", "--reference", "ref.exr")

    def test_crop_windows_are_aligned(self):
        values = [float(i) for i in range(12)]
        self.write("full.exr", exr({c: values for c in "RGB"}, (4, 3)))
        self.write("crop.exr", exr({c: [5, 6, 9, 11] for c in "RGB"}, (4, 3), window=(1, 1, 2, 2)))
        for image, reference in (("crop.exr", "full.exr"), ("full.exr", "crop.exr")):
            result = self.run_covary("compare", image, "--reference", reference, "--metric", "mse", "--json")
            errors = json.loads(result.stdout)
            self.assertIn(f"{image}: compared over the pixels in common, 2 x 2 at (1, 1)", result.stderr)
            self.assertEqual(errors["window"], [1, 1, 2, 2])
            self.assertAlmostEqual(errors["mse"], 0.25)  # 5 6 9 10 against 5 6 9 11
        self.image("far.exr", (1, 1, 1), window=(3, 0, 1, 1))
        self.bad(1, "crop.exr (2 x 2 at (1, 1)) and far.exr (1 x 1 at (3, 0)) have no pixels in common",
                 "compare", "crop.exr", "--reference", "far.exr")

    def test_size_mismatch(self):
        self.image("big.exr", (1, 1, 1), size=(5, 3))
        self.bad(1, "a.exr has a frame of 4 x 3 pixels, big.exr one of 5 x 3", "compare", "a.exr", "-r", "big.exr")

    def test_non_finite_pixels(self):
        self.write("nan.exr", exr({"R": [1] * 11 + [float("nan")], "G": [2] * 12, "B": [3] * 12}, (4, 3)))
        result = self.good("compare", "nan.exr", "--reference", "ref.exr", "--json")
        self.assertIn("nan.exr: 1 of 12 pixels are not finite", result.stderr)
        errors = json.loads(result.stdout)
        self.assertEqual((errors["pixels"], errors["non_finite_pixels"], errors["relmse"]), (11, 1, 0))
        self.image("all.exr", (float("inf"), 1, 1))
        self.bad(1, "all.exr: none of the 12 pixels is finite", "compare", "all.exr", "--reference", "ref.exr")

    def test_other_types_and_layers(self):
        self.image("half.exr", (1.5, 2, 3), types={c: HALF for c in "RGB"})
        self.write("layer.exr", exr({f"view.{c}": [v] * 12 for c, v in zip("RGB", (1.5, 2, 3))}, (4, 3)))
        for name in ("half.exr", "layer.exr"):
            self.assertEqual(self.errors(name, "--reference", "a.exr")[0]["relmse"], 0)
        self.write("f.exr", film(1))
        self.bad(1, "f.exr: no layer 'grup00'; did you mean 'group00'", "compare", "f.exr", "-r", "f.exr", "--layer",
                 "grup00")
        self.assertEqual(self.errors("f.exr", "-r", "f.exr", "--layer", "group01")[0]["mean"], 2)

    def test_error_map(self):
        result = self.good("compare", "a.exr", "--reference", "ref.exr", "--error-map", "e.png")
        self.assertIn("e.png: relmse of a.exr, 0.01 black", result.stderr)
        self.assertEqual((self.path / "e.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        (self.path / "sub").mkdir()
        (self.path / "sub" / "a.exr").write_bytes((self.path / "a.exr").read_bytes())
        self.good("compare", "a.exr", "ref.exr", "sub/a.exr", "-r", "ref.exr", "--error-map", "m.png", "--error-range",
                  "0.1,1")
        for name in ("m-a.png", "m-ref.png", "m-a-2.png"):
            self.assertTrue((self.path / name).exists(), name)
        self.bad(2, "must end in .png", "compare", "a.exr", "-r", "ref.exr", "--error-map", "e.jpg")
        self.bad(2, "--error-range 1,0.1: expected two rising", "compare", "a.exr", "-r", "ref.exr", "--error-map",
                 "e.png", "--error-range", "1,0.1")
        self.bad(2, "--error-range needs --error-map", "compare", "a.exr", "-r", "ref.exr", "--error-range", "1,2")

    def test_wrong_metric(self):
        self.bad(2, "unknown metric 'relmes'; did you mean 'relmse'", "compare", "a.exr", "-r", "ref.exr", "-m",
                 "relmes")
        self.bad(2, "--metric names 'mse' more than once", "compare", "a.exr", "-r", "ref.exr", "-m", "mse,mse")

    def test_missing_files(self):
        self.bad(1, "cannot read no.exr: No such file", "compare", "no.exr", "--reference", "ref.exr")
        self.bad(1, "cannot read no.exr: No such file", "compare", "a.exr", "--reference", "no.exr")


class Merge(CliTest):
    def test_merge(self):
        self.write("a.exr", film(1, samples=2, value=1))
        self.write("b.exr", film(2, samples=6, value=3))
        said = self.good("merge", "b.exr", "a.exr", "-o", "ab.exr").stderr
        self.assertEqual(said, "ab.exr: 4 x 3 pixels, 16 samples per pixel\n")
        info = json.loads(self.good("info", "ab.exr", "--json").stdout)
        self.assertEqual(info["attributes"]["covary:seed"], "1,2")
        self.assertEqual(info["attributes"]["covary:samples"], "16")
        self.assertEqual(info["attributes"]["covary:command"], "covary merge b.exr a.exr -o ab.exr")
        # Group means 2.5 and 5: (2 * 1 + 6 * 3) / 8, and twice that.
        self.write("expected.exr", film(9, samples=8, value=2.5))
        for layer in ("", "group00", "group01", "samples"):
            result = self.good("compare", "ab.exr", "-r", "expected.exr", "-m", "mse", "--json",
                               *(["--layer", layer] if layer else []))
            self.assertEqual(json.loads(result.stdout)["mse"], 0, layer)
        self.good("merge", "a.exr", "b.exr", "-o", "ba.exr")
        for layer in ("group00", "group01"):
            result = self.good("compare", "ab.exr", "-r", "ba.exr", "-m", "mse", "--json", "--layer", layer)
            self.assertEqual(json.loads(result.stdout)["mse"], 0)

    def test_films_that_do_not_belong_together(self):
        self.write("a.exr", film(1))
        self.bad(2, "At least 2 required", "merge", "a.exr", "-o", "o.exr")
        self.bad(2, "--output is required", "merge", "a.exr", "a.exr")
        self.bad(1, "have the same seed 1 and so the same samples", "merge", "a.exr", "a.exr", "-o", "o.exr")
        others = {"sampling differs": film(2, sampling="independent"), "scene_hash differs": film(2, scene_hash="x"),
                  "settings differs": film(2, settings="bdpt"), "the number of groups differs": film(2, groups=3),
                  "the size differs": film(2, size=(3, 3))}
        for message, data in others.items():
            self.write("b.exr", data)
            self.bad(1, message, "merge", "a.exr", "b.exr", "-o", "o.exr")
        self.image("plain.exr", (1, 2, 3))
        self.bad(1, "plain.exr: not a film of covary", "merge", "a.exr", "plain.exr", "-o", "o.exr")

    def test_output_that_cannot_be_written(self):
        self.write("a.exr", film(1))
        self.write("b.exr", film(2))
        self.bad(1, "cannot write no/no/o.exr: no such folder no/no", "merge", "a.exr", "b.exr", "-o",
                 "no/no/o.exr")
        self.bad(1, "cannot write .: it is a folder", "merge", "a.exr", "b.exr", "-o", ".")

    def test_full_disk_keeps_the_old_file(self):
        self.write("a.exr", film(1))
        self.write("b.exr", film(2))
        self.write("o.exr", b"old")
        for limit in (0, 100, 500):
            # The thread sanitizer writes a file of its own before the program can ignore the signal: it inherits that
            # then.
            self.bad(1, "cannot write o.exr: File too large", "merge", "a.exr", "b.exr", "-o", "o.exr",
                     "--overwrite", restore_signals=os.environ.get("SANITIZED") != "tsan",
                     preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        self.assertEqual(sorted(p.name for p in self.path.iterdir()), ["a.exr", "b.exr", "o.exr"])


class Info(CliTest):
    def test_film(self):
        self.write("f.exr", film(7, frame=(10, 20), window=(2, 3, 4, 3)))
        output = self.good("info", "f.exr").stdout
        for text in ("4 x 3 pixels at (2, 3) of a frame of 10 x 20", "group01: B G R (float)", "covary:seed: 7",
                     "samples"):
            self.assertIn(text, output)
        info = json.loads(self.good("info", "f.exr", "--json").stdout)
        self.assertEqual((info["frame"], info["window"]), ([10, 20], [2, 3, 4, 3]))
        self.assertEqual((info["channels"]["samples"], info["channels"]["group00.R"]), ("uint", "float"))
        self.assertEqual(info["attributes"]["covary:groups"], "2")

    def test_errors(self):
        self.bad(2, "FILE is required", "info")
        self.bad(1, "cannot read no.exr: No such file", "info", "no.exr")
        self.bad(1, "cannot read .: it is a folder", "info", ".")
        self.bad(1, "empty.exr: the file is empty", "info", self.write("empty.exr", b""))


class Convert(CliTest):
    def pixels(self, name):
        """The rows of an 8-bit RGB PNG whose lines are filtered by none, sub or up."""
        data = (self.path / name).read_bytes()
        width, height = int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
        self.assertEqual(data[24:26], b"\x08\x02")
        packed, at = b"", 8
        while at < len(data):
            length = int.from_bytes(data[at:at + 4], "big")
            if data[at + 4:at + 8] == b"IDAT":
                packed += data[at + 8:at + 8 + length]
            at += 12 + length
        raw, rows, above = zlib.decompress(packed), [], [0] * (3 * width)
        for y in range(height):
            line = raw[y * (3 * width + 1):(y + 1) * (3 * width + 1)]
            row = list(line[1:])
            self.assertIn(line[0], (0, 1, 2))
            for i in range(len(row)):
                row[i] = (row[i] + (0, row[i - 3] if i >= 3 else 0, above[i])[line[0]]) % 256
            rows.append(row)
            above = row
        return rows

    def test_srgb_and_exposure(self):
        self.image("a.exr", (0.5, 0.25, 7))
        self.assertEqual(self.good("convert", "a.exr", "a.png").stderr, "a.png: 4 x 3 pixels\n")
        self.assertEqual(self.pixels("a.png"), [[188, 137, 255] * 4] * 3)
        self.good("convert", "a.exr", "b.png", "--exposure", "-1")
        self.assertEqual(self.pixels("b.png"), [[137, 99, 255] * 4] * 3)

    def test_layers(self):
        self.write("f.exr", film(1, value=0.25))
        self.good("convert", "f.exr", "g.png", "--layer", "group01")
        self.assertEqual(self.pixels("g.png"), [[188] * 12] * 3)
        self.good("convert", "f.exr", "s.png", "--layer", "samples", "--exposure=-3")
        self.assertEqual(self.pixels("s.png"), [[188] * 12] * 3)  # 4 samples / 8
        self.bad(1, "no layer 'N' (layers: R G B, group00, group01; channels: B G R", "convert", "f.exr", "n.png",
                 "--layer", "N")

    def test_errors(self):
        self.image("a.exr", (1, 1, 1))
        self.bad(2, "--exposure: '101': expected a number from -100 to 100", "convert", "a.exr",
                 "a.png", "--exposure", "101")
        self.bad(2, "--exposure", "convert", "a.exr", "a.png", "--exposure", "bright")
        self.bad(1, "cannot write no/no/a.png: no such folder no/no", "convert", "a.exr", "no/no/a.png")


class Damage(CliTest):
    def test_truncated_files(self):
        whole = film(1)
        self.write("good.exr", film(2))
        for size in (0, 3, 8, 100, 600, len(whole) // 2, len(whole) - 1):
            self.write("cut.exr", whole[:size])
            self.bad(1, "cut.exr: ", "merge", "good.exr", "cut.exr", "-o", "o.exr")
            self.bad(1, "cut.exr: ", "compare", "cut.exr", "--reference", "good.exr")
            self.bad(1, "cut.exr: ", "convert", "cut.exr", "o.png")

    def test_absurd_sizes_take_no_memory(self):
        for size in (100_000, 250_000, 2_000_000_000):
            data = bytearray(film(1))
            for name in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
                at = data.index(name) + len(name) + 4 + 8
                data[at:at + 8] = size.to_bytes(4, "little") * 2
            self.write("huge.exr", bytes(data))
            limits = lambda: resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
            for command in (["info", "huge.exr"], ["convert", "huge.exr", "o.png"]):
                self.bad(1, "huge.exr: ", *command, preexec_fn=None if "SANITIZED" in os.environ else limits)

    def test_groups_of_unequal_sizes(self):
        # Groups of 2 and 1 samples with the means 1 and 4, and two samples 5 and 7: the third film sample is the
        # second's first.
        for name, seed, n, means in (("a.exr", 1, 3, (1, 4)), ("b.exr", 2, 2, (5, 7))):
            channels = {c: [0] for c in "RGB"} | {f"group{g:02d}.{c}": [means[g]] for g in range(2) for c in "RGB"}
            facts = {"film": "1", "groups": "2", "seed": str(seed), "sampling": "crn", "scene_hash": "abc",
                     "settings": "path"}
            attributes = {f"covary:{k}": v for k, v in facts.items()}
            self.write(name, exr(channels | {"samples": [n]}, (1, 1), attributes=attributes, types={"samples": UINT}))
        self.good("merge", "b.exr", "a.exr", "-o", "o.exr")
        merged = read_exr((self.path / "o.exr").read_bytes())
        self.assertEqual(merged["samples"], [5])
        self.assertEqual((merged["group00.R"], merged["group01.R"]), ([(2 * 1 + 7) / 3], [(4 + 5) / 2]))
        self.assertAlmostEqual(merged["R"][0], 18 / 5, 6)

    def test_other_formats(self):
        for name in ("a.png", "a.hdr", "a.pfm", "a.jpg", "a.tga", "a.xyz"):
            for data in (b"\0" * 100, b"\x89PNG\r\n\x1a\n" + b"\0" * 50, b"PF\n1000000 1000000\n-1\n\0\0\0\0",
                         b"#?RADIANCE\n\n-Y 9 +X 9\n"):
                self.write(name, data)
                result = self.run_covary("convert", name, "o.png")  # libpng adds a line of its own
                self.assertEqual(result.returncode, 1, (name, data[:8], result.stderr))
                self.assertIn(f"covary: {name}: ", result.stderr)
                self.assertFalse((self.path / "o.png").exists())


if __name__ == "__main__":
    unittest.main()
