# SPDX-License-Identifier: Apache-2.0
"""What commands take over from files of other programs: channels, attributes, windows, alpha, colour spaces."""
import array
import json
import random
import struct
import zlib

from cli_test import CliTest
from exr_reader import header, read_exr
from exr_writer import UINT, chromaticities, exr

SIZE = (16, 12)
N = SIZE[0] * SIZE[1]
ACES_CG = chromaticities(0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)
# ACEScg to Rec. 709 with Bradford's adaptation, as published in OpenColorIO's ACES configurations.
TO_REC709 = ((1.70505, -0.62179, -0.08326), (-0.13026, 1.14080, -0.01055), (-0.02400, -0.12897, 1.15297))
MANIFEST = '{"ball":"0a1b2c3d"}'


def floats(values):
    """As 32 bits hold them."""
    return list(array.array("f", values))


def srgb(value):
    value = min(max(value, 0), 1)
    return round(255 * (12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055))


def in_rec709(colour):
    return [sum(m * c for m, c in zip(row, colour)) for row in TO_REC709]


def read_png(data):
    """Width, height, and a tuple of bytes for each pixel; 8 bits, not interlaced (ISO/IEC 15948)."""
    width, height, depth, kind = struct.unpack(">IIBB", data[16:26])
    assert depth == 8
    n, at, packed = {2: 3, 6: 4}[kind], 8, b""
    while at < len(data):
        size, = struct.unpack_from(">I", data, at)
        if data[at + 4:at + 8] == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += size + 12
    raw, above, pixels = zlib.decompress(packed), bytearray(n * width), []
    for y in range(height):
        start = y * (n * width + 1)
        filtered, row = raw[start], bytearray(raw[start + 1:start + 1 + n * width])
        for i in range(len(row)):
            left, up, corner = row[i - n] if i >= n else 0, above[i], above[i - n] if i >= n else 0
            nearest = min((left, up, corner), key=lambda v: abs(left + up - corner - v))
            row[i] = (row[i] + (0, left, up, (left + up) // 2, nearest)[filtered]) & 255
        pixels += [tuple(row[i:i + n]) for i in range(0, len(row), n)]
        above = row
    return width, height, pixels


class KeptTest(CliTest):
    def render(self, name, seed, **more):
        """A picture with noise, and everything that a renderer may write beside it."""
        chance = random.Random(seed)
        channels = {c: floats(chance.expovariate(1) * (1 + i % 5) for i in range(N)) for c in "RGB"}
        channels["A"] = floats(chance.random() for _ in range(N))
        for part in "rgba":
            channels["CryptoObject00." + part] = floats(chance.uniform(-1e9, 1e-9) for _ in range(N))
        channels["Depth"] = floats(chance.random() for _ in range(N))
        channels["object"] = [chance.getrandbits(32) for _ in range(N)]
        self.write(name, exr(channels, SIZE, types={"object": UINT}, attributes={
            "owner": "somebody", "cryptomatte/0a1b2c3/name": "CryptoObject", "cryptomatte/0a1b2c3/manifest": MANIFEST,
            "covary:seed": str(seed), "covary:predicted_relmse": "123", "covary:settings": "path"}, **more))
        return channels

    def read(self, name):
        data = (self.path / name).read_bytes()
        return read_exr(data), header(data)[0]

    def expect_kept(self, name, channels, but=()):
        """All channels but `but` of the first render, and its attributes."""
        found, attributes = self.read(name)
        for channel, values in channels.items():
            if channel not in but:
                self.assertEqual(found[channel], values, channel)
        self.assertEqual(attributes["owner"], b"somebody")
        self.assertEqual(attributes["cryptomatte/0a1b2c3/manifest"], MANIFEST.encode())
        self.good("info", name)  # checks the checksums
        return found, attributes


class Results(KeptTest):
    def test_of_two_renders(self):
        a, b = self.render("a.exr", 1, more=ACES_CG), self.render("b.exr", 2, more=ACES_CG)
        for command in (("denoise", "a.exr", "b.exr"), ("combine", "--independent", "a.exr", "b.exr", "--denoise",
                                                        "auto")):
            self.good(*command, "--oidn", "off", "-o", "o.exr", "--overwrite")
            found, attributes = self.expect_kept("o.exr", a, but="RGBA")
            mean = [(x + y) / 2 for x, y in zip(a["A"], b["A"])]  # of values between 0 and 1 with the mean 1/2
            self.assertTrue(all(0 <= value <= 1 for value in found["A"]))
            self.assertLess(sum((v - 0.5) ** 2 for v in found["A"]), 0.8 * sum((v - 0.5) ** 2 for v in mean))
            self.assertNotEqual(found["R"], a["R"])
            self.assertEqual(attributes["covary:seed"], b"1,2")
            self.assertNotEqual(attributes.get("covary:predicted_relmse"), b"123", "it describes the old image")
            self.assertIn(ACES_CG.split(b"\0", 2)[2][4:], attributes["chromaticities"])

    def test_one_of_two_views(self):
        views = []
        for seed, name in ((1, "a.exr"), (2, "b.exr")):
            chance = random.Random(seed)
            views.append({f"{view}.{c}": floats(chance.expovariate(1) for _ in range(N)) for view in ("left", "right")
                          for c in "RGB"})
            self.write(name, exr(views[-1], SIZE, attributes={"owner": "somebody"}))
        self.good("denoise", "a.exr", "b.exr", "--layer", "right", "--oidn", "off", "-o", "o.exr")
        found, attributes = self.read("o.exr")
        self.assertEqual([c for c in views[0] if found[c] == views[0][c]], ["left.R", "left.G", "left.B"])
        self.assertLess(max(found["right.G"]), max(views[0]["right.G"]))
        self.assertEqual(attributes["owner"], b"somebody")

    def test_statistics_of_the_samples_go(self):
        self.render("a.exr", 1), self.render("b.exr", 2)
        self.good("denoise", "a.exr", "b.exr", "--oidn", "off", "-o", "ab.exr")
        self.assertIn("StdError.R", self.read("ab.exr")[0])
        self.good("convert", "ab.exr", "brighter.exr", "-e", "1")
        found, attributes = self.read("brighter.exr")
        self.assertNotIn("StdError.R", found)
        self.assertNotIn("covary:predicted_relmse", attributes)

    def test_renders_in_different_colours_are_refused(self):
        self.render("a.exr", 1), self.render("b.exr", 2, more=ACES_CG)
        message = "b.exr: its colours are ACEScg, those of a.exr Rec. 709"
        self.bad(1, message, "denoise", "a.exr", "b.exr", "--oidn", "off", "-o", "o.exr")
        self.bad(1, "those of b.exr ACEScg; expected one colour space", "combine", "--crn", "a.exr", "--independent",
                 "b.exr", "-o", "o.exr")


    def test_features_in_other_colours_are_converted(self):
        """Albedos in files of their own, in Rec. 709, guide as those of the picture's space do."""
        here = [((0.8, 0.3, 0.2), (0.2, 0.4, 0.7))[x // 3 % 2] for _ in range(SIZE[1]) for x in range(SIZE[0])]
        there = [in_rec709(colour) for colour in here]

        def layer(name, colours):
            return {name + c: floats(channel) for c, channel in zip("RGB", zip(*colours))}

        for seed in (1, 2):
            chance = random.Random(seed)
            noisy = [[v * chance.expovariate(1) for v in colour] for colour in here]
            self.write(f"{seed}.exr", exr(layer("", noisy) | layer("Albedo.", here), SIZE, more=ACES_CG))
        self.write("rec709.exr", exr(layer("", there) | layer("Albedo.", there), SIZE))
        self.write("untold.exr", exr(layer("", there) | layer("Albedo.", there), SIZE, more=ACES_CG))

        def result(*command):
            self.good(*command, "--oidn", "off", "-o", "o.exr", "--overwrite")
            found = self.read("o.exr")[0]
            return [v for c in "RGB" for v in found[c]]

        for command, option in ((("denoise", "1.exr", "2.exr"), "--albedo"),
                                (("combine", "--independent", "1.exr", "2.exr", "--denoise", "auto"), "--features")):
            own = result(*command, *(() if option == "--albedo" else (option, "1.exr")))
            converted, as_stored = (result(*command, option, name) for name in ("rec709.exr", "untold.exr"))
            self.assertLess(max(abs(x - y) for x, y in zip(own, converted)), 1e-3 * max(own), option)
            self.assertGreater(max(abs(x - y) for x, y in zip(own, as_stored)), 1e-2 * max(own), "colours are seen")


class Convert(KeptTest):
    def test_exr_stays_what_it_is(self):
        a = self.render("a.exr", 1, more=ACES_CG, window=(3, 2) + SIZE)
        self.good("convert", "a.exr", "o.exr")
        _, attributes = self.expect_kept("o.exr", a)
        self.assertEqual(struct.unpack("<4i", attributes["dataWindow"]), (3, 2, 18, 13))
        self.assertEqual(attributes["covary:predicted_relmse"], b"123", "it is the same image")
        self.assertEqual(len(attributes["chromaticities"]), 32)
        self.good("convert", "a.exr", "o.exr", "-e", "1")
        found, attributes = self.expect_kept("o.exr", a, but="RGB")
        self.assertEqual(found["G"], [2 * v for v in a["G"]])
        self.assertNotIn("covary:predicted_relmse", attributes)

    def test_a_layer_becomes_the_picture(self):
        a = self.render("a.exr", 1)
        self.good("convert", "a.exr", "o.exr", "--layer", "Depth")
        found, attributes = self.read("o.exr")
        self.assertEqual(found, {c: a["Depth"] for c in "RGB"})
        self.assertEqual(attributes["owner"], b"somebody")
        self.good("convert", "a.exr", "o.exr", "--layer", "CryptoObject00")
        self.assertEqual(self.read("o.exr")[0], {c.upper(): a["CryptoObject00." + c] for c in "rgba"})

    def test_png_has_straight_alpha(self):
        alpha = [0, 0.25, 0.5, 1]
        self.write("a.exr", exr({**{c: [0.2 * v * a + 0.001 for a in alpha] for c, v in zip("RGB", (1, 2, 3))},
                                 "A": alpha}, (4, 1)))
        self.good("convert", "a.exr", "o.png")
        width, height, pixels = read_png((self.path / "o.png").read_bytes())
        self.assertEqual((width, height), (4, 1))
        for pixel, a in zip(pixels, alpha):
            straight = [0.2 * v + 0.001 / a if a else 0.001 for v in (1, 2, 3)]
            self.assertEqual(pixel, (*(srgb(v) for v in straight), round(255 * a)))

    def test_tiff_has_premultiplied_alpha(self):
        self.write("a.exr", exr({**{c: [0.25] for c in "RGB"}, "A": [0.5]}, (1, 1)))
        self.good("convert", "a.exr", "o.tif")
        self.good("convert", "o.tif", "o.exr")
        self.assertEqual(self.read("o.exr")[0], {"R": [0.25], "G": [0.25], "B": [0.25], "A": [0.5]})

    def test_straight_alpha_is_multiplied(self):
        self.write("a.exr", exr({**{c: [0.25] for c in "RGB"}, "A": [0.5]}, (1, 1)))
        self.good("convert", "a.exr", "o.png")  # straight 0.5, as the byte 188
        self.good("convert", "o.png", "o.exr")
        found = self.read("o.exr")[0]
        self.assertAlmostEqual(found["A"][0], 128 / 255, 6)
        self.assertAlmostEqual(found["R"][0], ((188 / 255 + 0.055) / 1.055) ** 2.4 * 128 / 255, 6)

    def test_pictures_show_the_frame(self):
        values = [i / 30 for i in range(30)]  # 6 x 5 pixels, one more on each side of 4 x 3
        self.write("over.exr", exr({c: values for c in "RGB"}, (4, 3), window=(-1, -1, 6, 5)))
        self.good("convert", "over.exr", "o.png")
        width, height, pixels = read_png((self.path / "o.png").read_bytes())
        self.assertEqual((width, height), (4, 3))
        self.assertEqual(pixels, [(srgb(values[6 * y + x]),) * 3 for y in (1, 2, 3) for x in (1, 2, 3, 4)])
        self.write("crop.exr", exr({c: [1] for c in "RGBA"}, (3, 2), window=(1, 1, 1, 1)))
        self.good("convert", "crop.exr", "o.png")
        width, height, pixels = read_png((self.path / "o.png").read_bytes())
        self.assertEqual((width, height), (3, 2))
        self.assertEqual(pixels, [(255,) * 4 if i == 4 else (0,) * 4 for i in range(6)])


class Colours(KeptTest):
    COLOUR = (0.2, 0.3, 0.1)

    def setUp(self):
        super().setUp()
        self.image("aces.exr", self.COLOUR, more=ACES_CG)
        self.image("rec709.exr", in_rec709(self.COLOUR))

    def test_pictures_are_in_rec709(self):
        self.good("convert", "aces.exr", "o.png")
        expected = tuple(srgb(v) for v in in_rec709(self.COLOUR))
        for pixel in read_png((self.path / "o.png").read_bytes())[2]:
            for value, other in zip(pixel, expected):
                self.assertAlmostEqual(value, other, delta=1)

    def test_comparisons_convert(self):
        done = self.good("compare", "aces.exr", "-r", "rec709.exr", "-m", "relmse,flip", "--json", "-")
        errors = json.loads(done.stdout)
        self.assertLess(errors["relmse"], 1e-9)
        self.assertLess(errors["flip"], 1e-3)
        self.assertEqual(errors["warnings"], ["aces.exr and rec709.exr have different colour spaces, ACEScg and Rec. "
                                              "709; they are converted to one"])
        # In the reference's colours: 0.1 more of each is 0.01 / (mean of the reference)².
        self.image("more.exr", [v + 0.1 for v in self.COLOUR], more=ACES_CG)
        errors = json.loads(self.good("compare", "more.exr", "-r", "aces.exr", "--json", "-").stdout)
        self.assertAlmostEqual(errors["relmse"], 0.01 / (0.04 + 0.01), 6)

    def test_xyz(self):
        x, y, z = 0.3127 / 0.329, 1, (1 - 0.3127 - 0.329) / 0.329  # the white of Rec. 709
        self.write("xyz.exr", exr({c: [v / 2] * 12 for c, v in zip("XYZ", (x, y, z))}, (4, 3)))
        self.good("convert", "xyz.exr", "o.png")
        self.assertEqual(set(read_png((self.path / "o.png").read_bytes())[2]), {(srgb(0.5),) * 3})
        self.good("convert", "xyz.exr", "o.exr")
        self.assertEqual(set(self.read("o.exr")[0]), set("XYZ"))

    def test_luminance_and_chroma_are_refused(self):
        self.write("yc.exr", exr({c: [0.5] * 12 for c in ("Y", "RY", "BY")}, (4, 3)))
        self.write("yc2.exr", exr({c: [0.25] * 12 for c in ("Y", "RY", "BY")}, (4, 3)))
        for command in (("convert", "yc.exr", "o.png"), ("denoise", "yc.exr", "yc2.exr", "-o", "o.exr")):
            self.bad(1, "yc.exr: luminance and chroma of full resolution (channels Y, RY, BY); save the picture as R, "
                     "G and B", *command)


class Frames(KeptTest):
    def setUp(self):
        super().setUp()
        for frame in range(1, 6):
            self.render(f"a_{frame}.exr", frame)
            self.render(f"b_{frame}.exr", 10 + frame)
    COMMAND = ("denoise", "a_#.exr", "b_#.exr", "--oidn", "off", "-o", "o_#.exr")

    def written(self):
        return sorted(p.name for p in self.path.glob("o_*"))

    def test_a_frame_that_fails_does_not_stop_the_others(self):
        channels = self.read("b_3.exr")[0]
        channels["R"][5] = float("nan")
        self.write("b_3.exr", exr(channels, SIZE, types={"object": UINT}))
        result = self.run_covary(*self.COMMAND)
        self.assertEqual(result.returncode, 1)
        self.assertIn("warning: frame 3 (3 of 5) failed: ", result.stderr)
        self.assertEqual(result.stderr.splitlines()[-1], "covary: 1 of 5 frames failed: 3")
        self.assertEqual(self.written(), ["o_1.exr", "o_2.exr", "o_4.exr", "o_5.exr"])
        self.assertIn("note: the frames have no layer 'Motion'", result.stderr)

    def test_all_files_are_checked_first(self):
        (self.path / "b_4.exr").rename(self.path / "b_6.exr")
        self.image("b_5.exr", (1, 1, 1))
        message = self.bad(1, "b_4.exr", *self.COMMAND).stderr
        self.assertIn("'b_5.exr' has 4 x 3 pixels at (0, 0), frame 1 has 16 x 12 pixels at (0, 0)", message)
        self.assertIn("a_6.exr", message)
        self.assertIn("nothing was written", message)
        self.assertEqual(self.written(), [])
        self.write("b_5.exr", exr({c: [1] * N for c in "RGB"}, SIZE))
        (self.path / "b_6.exr").rename(self.path / "b_4.exr")
        self.bad(1, "'b_5.exr': the channel A is missing, which is in frame 1", *self.COMMAND)


if __name__ == "__main__":
    import unittest
    unittest.main()
