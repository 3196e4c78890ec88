# SPDX-License-Identifier: Apache-2.0
"""Files as other renderers name their layers: the picture among views, view layers, mattes and lights; its features;
what the rest of a file must not stop."""
import array
import json
import math
import os
import random
import struct
import subprocess
import time
import zlib

from cli_test import COVARY, CliTest
from exr_reader import read_exr
from exr_writer import attribute, box, exr, multipart

SIZE = (40, 24)
N = SIZE[0] * SIZE[1]
OFF = ("--oidn", "off")


def floats(values):
    """As 32 bits hold them."""
    return list(array.array("f", values))


def truth(i):
    return 0.4 + 0.3 * math.sin(0.3 * (i % SIZE[0])) * math.cos(0.4 * (i // SIZE[0]))


def noisy(seed, scale=1.0):
    """A smooth picture times exponential noise."""
    chance = random.Random(seed)
    return floats(scale * truth(i) * chance.expovariate(1) for i in range(N))


def colours(layer, *planes):
    """Channels of a layer from one plane for all, or three."""
    prefix = layer + "." if layer else ""
    return {prefix + c: planes[k % len(planes)] for k, c in enumerate("RGB")}


class PicturesTest(CliTest):
    def pair(self, make, **more):
        """a.exr and b.exr with the channels of make(seed)."""
        renders = []
        for seed, name in ((1, "a.exr"), (2, "b.exr")):
            renders.append(make(seed))
            self.write(name, exr(renders[-1], SIZE, **more))
        return renders

    def denoise(self, *options):
        return self.good("denoise", "a.exr", "b.exr", *OFF, "-o", "o.exr", "--overwrite", *options).stderr

    def read(self, name="o.exr"):
        return read_exr((self.path / name).read_bytes())

    def error(self, values):
        return sum((v - truth(i)) ** 2 for i, v in enumerate(values)) / N


class Found(PicturesTest):
    def test_single_channels(self):
        """Without a picture, a channel can be chosen."""
        self.write("g.exr", exr({"G": [0.5] * SIZE[0] * SIZE[1], "Z": [1.0] * SIZE[0] * SIZE[1]}, SIZE))
        self.bad(1, "g.exr: no channels R G B; choose a channel by --layer, such as 'G' (channels: G Z)", "convert",
                 "g.exr", "g.png")
        self.good("convert", "g.exr", "g.png", "--layer", "G")

    def test_cryptomatte_is_no_group(self):
        crypto = floats(random.Random(5).uniform(-1e9, 1e9) for _ in range(N))
        a, b = self.pair(lambda seed: {**colours("ViewLayer.Combined", noisy(seed)),
                                       **{f"ViewLayer.CryptoObject0{n}.{c}": crypto for n in range(3) for c in "rgba"}})
        self.assertIn("2 renders", self.denoise())
        found = self.read()
        for name, values in a.items():
            (self.assertNotEqual if "Combined" in name else self.assertEqual)(found[name], values, name)
        mean = [(x + y) / 2 for x, y in zip(a["ViewLayer.Combined.R"], b["ViewLayer.Combined.R"])]
        self.assertLess(self.error(found["ViewLayer.Combined.R"]), 0.3 * self.error(mean))

    def test_numbered_lights_are_layers(self):
        def make(seed):
            lights = [noisy(10 * seed + n, 0.5) for n in (1, 2)]
            return {**colours("", floats(x + y for x, y in zip(*lights))), **colours("light1", lights[0]),
                    **colours("light2", lights[1])}
        self.pair(make)
        self.denoise("--layers", "light1,light2")
        found = self.read()
        self.assertNotIn("Rest.R", found)
        for i in range(N):
            self.assertAlmostEqual(found["light1.G"][i] + found["light2.G"][i], found["G"][i], delta=1e-5)

    def test_groups_are_groups(self):
        self.write("f.exr", exr({k: v for g in range(4) for k, v in colours(f"sample{g}", noisy(g)).items()}, SIZE))
        self.assertIn("4 groups", self.good("denoise", "f.exr", *OFF, "-o", "o.exr").stderr)

    def test_grey(self):
        a, b = self.pair(lambda seed: {"Y": noisy(seed)})
        self.denoise()
        found = self.read()
        self.assertNotIn("R", found)
        mean = [(x + y) / 2 for x, y in zip(a["Y"], b["Y"])]
        self.assertLess(self.error(found["Y"]), 0.3 * self.error(mean))

    def test_the_render_before_cycles_denoised_it(self):
        smooth = floats(truth(i) for i in range(N))
        a, _ = self.pair(lambda seed: {**colours("ViewLayer.Combined", smooth),
                                       **colours("ViewLayer.Noisy Image", noisy(seed))})
        self.assertIn("'ViewLayer.Combined' is denoised already; 'ViewLayer.Noisy Image' beside it", self.denoise())
        found = self.read()
        self.assertEqual(found["ViewLayer.Noisy Image.R"], a["ViewLayer.Noisy Image.R"])
        self.assertNotEqual(found["ViewLayer.Combined.R"], smooth)
        self.bad(1, "is denoised already (by Cycles", "denoise", "a.exr", "b.exr", *OFF, "-o", "p.exr", "--layer",
                 "ViewLayer.Combined")


class Views(PicturesTest):
    """The right eye sees twice the light."""

    def make(self, seed):
        return {**colours("left", noisy(seed)), **colours("right", noisy(10 + seed, 2)),
                **colours("left.albedo", floats([0.5] * N)), "right.Z": floats([3.0] * N)}

    def test_all_are_denoised(self):
        self.pair(self.make)
        said = self.denoise()
        self.assertRegex(said, r"o.exr \(left\): 40 x 24, .* guided by albedo")
        self.assertRegex(said, r"o.exr \(right\): 40 x 24, .* without auxiliary features")
        found = self.read()
        self.assertLess(self.error(found["left.R"]), 0.05)
        self.assertLess(self.error([v / 2 for v in found["right.R"]]), 0.05)
        self.assertEqual(found["right.Z"], [3.0] * N)
        self.assertIn("right.StdError.R", found)

    def test_one_by_its_name(self):
        a, _ = self.pair(self.make)
        for options in (("--view", "right"), ("--layer", "right")):
            self.denoise(*options)
            found = self.read()
            self.assertEqual(found["left.R"], a["left.R"])
            self.assertLess(self.error([v / 2 for v in found["right.R"]]), 0.05)
        self.bad(1, "no picture of the view 'middle'; its views: 'left', 'right'", "denoise", "a.exr", "b.exr", *OFF,
                 "-o", "p.exr", "--view", "middle")
        self.good("combine", "--independent", "a.exr", "b.exr", "--denoise", "auto", *OFF, "--view", "right", "-o",
                  "c.exr")
        self.assertEqual(self.read("c.exr")["right.R"], found["right.R"])

    def test_view_layers_have_their_own_features(self):
        self.pair(lambda seed: {**colours("A.Combined", noisy(seed)), **colours("B.Combined", noisy(10 + seed)),
                                **colours("B.Denoising Albedo", floats([0.5] * N))})
        said = self.denoise()
        self.assertRegex(said, r"\(A.Combined\): .* without auxiliary features")
        self.assertRegex(said, r"\(B.Combined\): .* guided by albedo")
        self.assertNotIn("(A.Combined)", self.denoise("--layer", "B"))

    def test_parts_with_windows_of_their_own(self):
        """Stereo as OpenEXR's test images: a part for each eye, with its window and compression."""
        left, right = (2, 0, 8, 12), (0, 2, 10, 8)
        for name, seed in (("a.exr", 1), ("b.exr", 2)):
            chance = random.Random(seed)
            parts = [{"name": f"rgba_{view}", "view": view, "window": window, "compression": compression,
                      "channels": {c: floats(chance.expovariate(1) for _ in range(window[2] * window[3]))
                                   for c in "RGB"}}
                     for view, window, compression in (("left", left, 0), ("right", right, 0))]
            self.write(name, multipart(parts, (12, 12)))
        facts = json.loads(self.good("info", "a.exr", "--json").stdout)
        self.assertEqual(facts["window"], [0, 0, 10, 12], "that holds both")
        self.assertEqual(facts["pictures"], ["rgba_left", "rgba_right"])
        self.good("convert", "a.exr", "right.exr", "--view", "right")
        found = self.read("right.exr")
        self.assertEqual(found["R"], parts_values(self.path / "a.exr", 1))
        self.denoise()
        self.assertEqual(json.loads(self.good("info", "o.exr", "--json").stdout)["pictures"], facts["pictures"])

    def test_other_commands(self):
        self.write("s.exr", exr({**colours("left", [0.25] * N), **colours("right", [1.0] * N)}, SIZE))
        self.bad(1, "several pictures, 'left', 'right'; choose one by --view or --layer", "convert", "s.exr", "s.png")
        self.good("convert", "s.exr", "both.exr", "--view", "all")
        self.assertEqual(set(self.read("both.exr")), {f"{v}.{c}" for v in ("left", "right") for c in "RGB"})
        self.good("convert", "s.exr", "both.pfm", "--view", "all")
        self.assertTrue((self.path / "both.pfm").read_bytes().startswith(b"PF\n80 24\n"))
        lines = self.good("compare", "s.exr", "-r", "s.exr", "--view", "all", "--json", "-").stdout.splitlines()
        self.assertEqual([(json.loads(line)["view"], json.loads(line)["mean"]) for line in lines],
                         [("left", 0.25), ("right", 1)])
        self.good("view", "s.exr", "--view", "all", "-o", "s.html")
        page = (self.path / "s.html").read_text()
        self.assertIn("s left", page)
        self.assertIn("s right", page)


def parts_values(path, number):
    """The first channel R of a part of a file by multipart()."""
    data = path.read_bytes()
    values, at = [], data.index(struct.pack("<iii", number, 2, 10 * 4 * 3))
    for y in range(8):
        row = data[at + 12 + y * (12 + 120):][:120]
        values += array.array("f", row[80:120])
    return values


class WrongValues(PicturesTest):
    def test_in_features_are_left_out(self):
        for value in (math.nan, math.inf):
            def make(seed):
                normal, position = [0.5] * N, floats([1.0] * N)
                if seed == 2:
                    normal[7] = value
                position[SIZE[0] + 3] = value
                return {**colours("", noisy(seed)), **colours("albedo", floats([0.5] * N)),
                        **{f"{layer}.{c}": v for layer, v in (("sh_normal", normal), ("P", position)) for c in "XYZ"}}
            self.pair(make)
            said = self.denoise()
            self.assertIn(f"warning: b.exr: the layer sh_normal: 1 of {N} pixels of this feature are left out, the "
                          f"first with the value {value} at (7, 0)", said)
            self.assertIn("a.exr: the layer P: 1 of", said)
            self.assertIn("guided by albedo and normal", said)
            self.assertTrue(all(math.isfinite(v) for v in self.read()["R"]))

    def test_albedo_with_alpha_is_used(self):
        self.pair(lambda seed: {**colours("", noisy(seed)), **colours("albedo", floats([0.5] * N)),
                                "albedo.A": floats([1.0] * N)})
        self.assertIn("guided by albedo", self.denoise())

    def test_white_backgrounds_are_not_clipped(self):
        background = [i // SIZE[0] < 8 for i in range(N)]

        def make(limit):
            return lambda seed: colours("", floats(1 if sky else min(v, limit)
                                                   for v, sky in zip(noisy(seed, 2), background)))
        self.pair(make(math.inf))
        self.denoise()
        self.pair(lambda seed: colours("", floats(1 if sky else 0.9 * v / (1 + v)
                                                  for v, sky in zip(noisy(seed, 2), background))))
        self.denoise()
        self.pair(make(1))
        self.bad(1, "are exactly 1 in all renders and channels, and none is brighter: values are clipped", "denoise",
                 "a.exr", "b.exr", *OFF, "-o", "p.exr")


class Layers(PicturesTest):
    def test_lights_and_kinds_of_light_add_up(self):
        """As Blender splits a picture: by lights, and by kinds of light times colours."""
        colour = floats(0.2 + 0.6 * (i % 7) / 7 if i % 11 else 0 for i in range(N))

        def make(seed):
            direct, glossy, sky = (noisy(10 * seed + n) for n in range(3))
            whole = floats(c * d + 0.5 * g + s for c, d, g, s in zip(colour, direct, glossy, sky))
            return {**colours("V.Combined", whole), **colours("V.DiffDir", direct), **colours("V.DiffCol", colour),
                    **colours("V.GlossDir", glossy), **colours("V.GlossCol", floats([0.5] * N)),
                    **colours("V.Combined_key", floats(0.25 * v for v in whole)), **colours("V.AO", sky)}
        a, _ = self.pair(make)
        self.denoise("--layers", "all")
        found = self.read()
        for i in range(0, N, 7):
            whole = found["V.Combined.G"][i]
            parts = colour[i] * found["V.DiffDir.G"][i] + 0.5 * found["V.GlossDir.G"][i] + found["Rest_components.G"][i]
            self.assertAlmostEqual(parts, whole, delta=2e-5 * (1 + whole))
            lights = found["V.Combined_key.G"][i] + found["Rest_lights.G"][i]
            self.assertAlmostEqual(lights, whole, delta=2e-5 * (1 + whole))
        self.assertEqual(found["V.AO.R"], a["V.AO.R"])
        self.assertEqual(found["V.DiffCol.R"], a["V.DiffCol.R"])
        self.assertLess(self.error(found["V.DiffDir.R"]), 0.5 * self.error(a["V.DiffDir.R"]))
        self.pair(lambda seed: colours("", noisy(seed)))
        self.bad(1, "a.exr: no layers of lights", "denoise", "a.exr", "b.exr", *OFF, "-o", "p.exr", "--layers", "all")

    def test_alpha_is_denoised(self):
        def make(seed):
            chance = random.Random(seed)
            alpha = floats((0 if i % SIZE[0] < 10 else 1 if i % SIZE[0] > 30 else chance.choice((0, 0.5, 1)))
                           for i in range(N))
            return {**colours("", noisy(seed)), "A": alpha}
        a, b = self.pair(make)
        self.denoise()
        alpha = self.read()["A"]
        self.assertGreaterEqual(min(alpha), 0)
        self.assertLessEqual(max(alpha), 1)
        inside = [i for i in range(N) if 13 < i % SIZE[0] < 27]
        mean = [(x + y) / 2 for x, y in zip(a["A"], b["A"])]
        spread = [sum((values[i] - 0.5) ** 2 for i in inside) for values in (alpha, mean)]
        self.assertLess(spread[0], 0.5 * spread[1])
        for name in "ab":  # with checksums
            self.good("convert", f"{name}.exr", f"own_{name}.exr")
        self.good("denoise", "own_a.exr", "own_b.exr", *OFF, "-o", "own.exr")
        self.assertEqual(self.read("own.exr")["A"], alpha)
        self.pair(lambda seed: {**colours("", noisy(seed)), "A": floats([1.0] * N)})
        self.denoise()
        self.assertEqual(self.read()["A"], [1.0] * N)
        self.pair(make)
        self.write("b.exr", exr(colours("", noisy(9)), SIZE))
        self.denoise()
        self.assertEqual(self.read()["A"], make(1)["A"], "the first render's, if it alone has one")


class Info(PicturesTest):
    def test_luminance_and_chroma(self):
        """Luminance with chroma of half the size; OpenEXR's layout of sub-sampled channels."""
        listing = b"".join(name + b"\0" + struct.pack("<iB3xii", 2, 0, step, step)
                           for name, step in ((b"BY", 2), (b"RY", 2), (b"Y", 1)))
        head = struct.pack("<ii", 20000630, 2) + b"".join([
            attribute("channels", "chlist", listing + b"\0"), attribute("compression", "compression", b"\0"),
            attribute("dataWindow", "box2i", box(0, 0, 4, 4)), attribute("displayWindow", "box2i", box(0, 0, 4, 4)),
            attribute("lineOrder", "lineOrder", b"\0"), attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
            attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
            attribute("screenWindowWidth", "float", struct.pack("<f", 1))]) + b"\0"
        rows = [struct.pack("<ii", y, 4 * n) + struct.pack(f"<{n}f", *[0.5] * n) for y, n in enumerate((8, 4, 8, 4))]
        table, at = b"", len(head) + 32
        for row in rows:
            table, at = table + struct.pack("<Q", at), at + len(row)
        self.write("yc.exr", head + table + b"".join(rows))
        said = self.good("info", "yc.exr").stdout
        self.assertIn("channels\n  R G B (half)\nchannels that other commands cannot read\n"
                      "  BY RY Y (float, 2 x 2 sub-sampled, float, luminance)\n", said)
        self.good("convert", "yc.exr", "o.exr", "--exposure", "1", "--overwrite")
        self.good("convert", "yc.exr", "same.exr")
        self.assertEqual(self.good("info", "same.exr").stdout[8:40], said[6:38])
        red = 0.5 + 0.5 * 0.5  # Y + Y RY
        green = (0.5 - 0.2126 * red - 0.0722 * red) / 0.7152
        for name, value in (("R", red), ("G", green), ("B", red)):
            for found in self.read()[name]:
                self.assertAlmostEqual(found, 2 * value, delta=2e-3)
        self.assertEqual(set(self.read()), set("RGB"))

    def test_parts_of_different_compression(self):
        """Of which the first could not hold what the second does."""
        parts = [{"name": name, "channels": {c: [0.5] * N for c in channels}, "compression": compression}
                 for name, channels, compression in (("rgba", "RGB", 0), ("depth", "Z", 0))]
        data = multipart(parts, SIZE)
        self.write("p.exr", data)
        self.assertIn("compression none\n", self.good("info", "p.exr").stdout)

    def test_control_characters_are_escaped(self):
        self.image("a.exr", (1, 1, 1), attributes={"owner": "\x1b[31mred\x07"})
        said = self.good("info", "a.exr").stdout
        self.assertIn("owner: \\x1b[31mred\\x07\n", said)
        self.write("b.exr", exr({"\x1b[2J.R": [1.0] * 12}, (4, 3)))
        said = self.run_covary("convert", "b.exr", "b.png").stderr
        self.assertNotIn("\x1b", said + self.good("info", "b.exr").stdout)

    def test_future_compressions_are_named(self):
        data = exr({c: [1.0] * 12 for c in "RGB"}, (4, 3))
        at = data.index(b"compression\0compression\0") + 28
        for number, name in ((11, "HTJ2K32 (of OpenEXR 3.4)"), (13, "ZSTD (of OpenEXR 3.5)"), (99, "number 99")):
            self.write("f.exr", data[:at] + bytes([number]) + data[at + 1:])
            self.bad(1, f"f.exr: compression {name}, which is newer than this program's OpenEXR; save the file with "
                        "another one, e.g. ZIP or PIZ", "info", "f.exr")


class Sequences(PicturesTest):
    def setUp(self):
        super().setUp()
        for frame in (1, 2, 4):
            for letter in "ab":
                self.write(f"{letter}.{frame:04}.exr", exr(colours("", noisy(f"{letter}{frame}")), SIZE))
        self.write("a.998.exr", b"")

    def test_names(self):
        for hashes, percent, frame in (("a.####.exr", "a.%04d.exr", "a.<frame>.exr"),):
            for name in (hashes, percent, frame):
                self.good("denoise", name, name.replace("a.", "b."), *OFF, "-o", name.replace("a.", "o."),
                          "--overwrite")
                written = {p.name: p.read_bytes() for p in self.path.glob("o.*")}
                self.assertEqual(sorted(written), ["o.0001.exr", "o.0002.exr", "o.0004.exr"])
                for path in written:
                    (self.path / path).unlink()

    def test_lines(self):
        said = self.good("denoise", "a.####.exr", "b.####.exr", *OFF, "-o", "o.####.exr").stderr
        self.assertIn("note: 'a.####.exr' has no frame 3\n", said)
        self.assertIn("note: a.998.exr beside 'a.####.exr' are not its frames", said)
        self.assertRegex(said, r"\nframe 2 \(2 of 3\): o.0002.exr, predicted relMSE [\d.e-]+.*\n")
        self.assertRegex(said, r"\n3 frames in [\d.]+ s\n\Z")
        self.assertEqual(said.count("\n"), 7, said)

    def test_resume(self):
        command = ("denoise", "a.####.exr", "b.####.exr", *OFF, "-o", "o.####.exr", "--resume")
        self.good(*command, "--frames", "2")
        first = (self.path / "o.0002.exr").stat().st_mtime_ns
        said = self.good(*command).stderr
        self.assertIn("; 1 existed already: 2\n", said)
        self.assertEqual((self.path / "o.0002.exr").stat().st_mtime_ns, first)
        self.assertEqual(len(list(self.path.glob("o.*"))), 3)
        self.bad(2, "--resume: the input has no '#'", "denoise", "a.0001.exr", "-o", "p.exr", "--resume")


class Size(PicturesTest):
    def test_convert_by_rows(self):
        """25 million pixels, 300 MB as floats."""
        width = height = 5000
        rows = zlib.compress(b"".join(b"\0" + bytes([y % 256]) * width for y in range(height)), 1)

        def chunk(kind, data):
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
        self.write("big.png", b"\x89PNG\r\n\x1a\n" + head
                   + chunk(b"IDAT", rows) + chunk(b"IEND", b""))
        little = {**os.environ, "COVARY_MEMORY": "0.25"}
        self.good("convert", "big.png", "out.png", env=little)
        data = (self.path / "out.png").read_bytes()
        self.assertEqual(struct.unpack(">II", data[16:24]), (width, height))
        self.good("convert", "big.png", "out.exr", env=little)
        self.assertEqual(json.loads(self.good("compare", "out.exr", "--reference", "big.png", "--metric", "mse",
                                              "--json", env=little).stdout)["mse"], 0)
        self.bad(1, "needs", "convert", "big.png", "out.pfm", env=little)


class Watch(PicturesTest):
    def test_frames_are_denoised_as_they_come(self):
        frames = {(letter, n): exr(colours("", noisy(f"{letter}{n}")), SIZE) for letter in "ab" for n in (1, 2)}
        for (letter, n), data in frames.items():
            if (letter, n) != ("b", 2):
                self.write(f"{letter}_{n}.exr", data)
        # Begun, but not finished: its table of offsets is empty.
        table = frames["b", 2].index(struct.pack("<ii", 0, 3 * 4 * SIZE[0])) - 8 * SIZE[1]
        self.write("b_2.exr", frames["b", 2][:table] + bytes(8 * SIZE[1]))
        command = [COVARY, "denoise", "a_#.exr", "b_#.exr", *OFF, "-o", "o_#.exr", "--watch", "--frames", "1-2"]
        with subprocess.Popen(command, cwd=self.path, stderr=subprocess.PIPE, text=True) as running:
            for _ in range(300):
                if (self.path / "o_1.exr").exists():
                    break
                time.sleep(0.1)
            self.assertTrue((self.path / "o_1.exr").exists())
            time.sleep(3)
            self.assertFalse((self.path / "o_2.exr").exists())
            self.write("b_2.exr", frames["b", 2])
            said = running.communicate(timeout=60)[1]
        self.assertEqual(running.returncode, 0, said)
        self.assertTrue(said.startswith("waiting for frames 'a_#.exr'; Ctrl-C ends, and --resume continues\n"), said)
        self.assertRegex(said, r"\nframe 2: o_2.exr, .*\n2 frames in [\d.]+ s\n")
        self.assertTrue((self.path / "o_2.exr").exists())


if __name__ == "__main__":
    import unittest
    unittest.main()
