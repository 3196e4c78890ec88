# SPDX-License-Identifier: Apache-2.0
"""Files that covary wrote and that are not as it wrote them any more: every command that reads one says so."""
import random
import struct
import unittest
import zlib

from cli_test import CliTest
from exr_reader import channel_types, header, read_exr
from exr_writer import exr, film

FLIPS = 300


def crc_of(values, kind):
    return f"{zlib.crc32(struct.pack(f'<{len(values)}{kind}', *values)):08x}"


class Checksums(CliTest):
    def setUp(self):
        super().setUp()
        for seed, name in ((1, "a.exr"), (2, "b.exr"), (3, "c.exr")):
            self.write(name, film(seed, groups=3, size=(5, 4), samples=6, value=0.5 * seed))
        self.good("merge", "a.exr", "b.exr", "-o", "film.exr")
        self.good("convert", "film.exr", "image.exr", "-e", "1")  # no film any more

    def changed(self, name, channel="R", by=1):
        """The file with one value of a channel changed, as another program writes it: it keeps all attributes."""
        data = (self.path / name).read_bytes()
        attributes, _ = header(data)
        types = {n: {"I": 0, "f": 2}[k] for n, k in channel_types(attributes["channels"])}
        pixels = read_exr(data)
        pixels[channel][3] += by
        texts = {n: v.decode() for n, v in attributes.items() if n.startswith("covary:")}
        return self.write("changed.exr", exr(pixels, (5, 4), attributes=texts, types=types))

    def test_written_by_any_program_with_the_same_values(self):
        self.good("info", self.changed("film.exr", by=0))  # not compressed, other attributes

    def test_are_those_of_the_channels(self):
        data = (self.path / "film.exr").read_bytes()
        attributes, _ = header(data)
        words = attributes["covary:checksums"].decode().split()
        self.assertEqual(words[0], "crc32")
        pixels = read_exr(data)
        expected = [crc_of(pixels[n], k) for n, k in channel_types(attributes["channels"])]
        self.assertEqual(words[2:], expected)

    def test_every_command_refuses_a_changed_image(self):
        name = self.changed("image.exr")
        message = ("changed.exr: the channel R is one with the checksum ", "the file is damaged, or another program "
                   "changed it ('covary convert --accept-changed' makes an image of a changed one)")
        self.image("r.exr", (1, 1, 1), size=(5, 4))
        for command in (("convert", name, "o.png"), ("compare", name, "-r", "r.exr"), ("view", name, "-o", "o.html"),
                        ("compare", "r.exr", "-r", name), ("denoise", name, "-o", "o.exr"),
                        ("combine", "--crn", "film.exr", "--independent", name, "-o", "o.exr")):
            with self.subTest(command[0]):
                for part in message:
                    self.bad(1, part, *command)
        result = self.run_covary("info", name)  # which tells what there is first
        self.assertEqual(result.returncode, 1)
        self.assertIn("5 x 4 pixels", result.stdout)
        self.assertIn(message[0], result.stderr)

    def test_films(self):
        name = self.changed("film.exr", "group01.G")
        message = "changed.exr: the channel group01.G is one with the checksum "
        self.bad(1, message, "merge", name, "c.exr", "-o", "o.exr")
        self.bad(1, message, "combine", "--crn", name, "--independent", "c.exr", "-o", "o.exr")
        self.bad(1, message, "convert", name, "o.exr", "--layer", "group01")
        self.good("convert", name, "o.png")  # R G B are as they were
        self.bad(1, message, "convert", name, "o.exr")  # which copies all channels
        name = self.changed("film.exr", "samples")
        self.bad(1, "changed.exr: the channel samples is one with", "merge", name, "c.exr", "-o", "o.exr")
        self.bad(1, "changed.exr: the channel samples is one with", "combine", "--crn", name, "--independent", "c.exr",
                 "-o", "o.exr")
        self.bad(1, "changed.exr: the channel samples is one with", "convert", name, "o.png", "--layer", "samples")

    def test_textures(self):
        scene = """<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
            <integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
            <emitter type="envmap"><string name="filename" value="{}"/></emitter></scene>"""
        self.write("good.xml", scene.format("image.exr").encode())
        self.good("info", "good.xml")
        self.write("bad.xml", scene.format(self.changed("image.exr", "B")).encode())
        self.bad(1, "changed.exr: the channel B is one with the checksum ", "info", "bad.xml")

    def test_a_changed_image_is_accepted_where_asked(self):
        name = self.changed("image.exr")
        self.good("convert", "--accept-changed", name, "new.exr")
        self.good("compare", "new.exr", "-r", "image.exr")
        pixels = read_exr((self.path / "new.exr").read_bytes())
        self.assertEqual(pixels, read_exr((self.path / name).read_bytes()))
        attributes, _ = header((self.path / "new.exr").read_bytes())
        self.assertNotIn("covary:seed", attributes)  # which is true of what it was made from

    def test_headers(self):
        data = (self.path / "image.exr").read_bytes()
        seed = data.index(b"covary:seed\0")
        at = data.index(b"1,2", seed)
        self.write("seed.exr", data[:at] + b"1,3" + data[at + 3:])
        self.bad(1, "seed.exr: the header is one with the checksum ", "convert", "seed.exr", "o.png")
        self.write("name.exr", data.replace(b"covary:checksums", b"covary:checksumz"))
        self.bad(1, "name.exr: damaged: the attribute 'covary:checksumz' holds checksums, which the attribute "
                 "covary:checksums should", "convert", "name.exr", "o.png")
        self.write("type.exr", data.replace(b"covary:checksums\0string", b"covary:checksums\0strinc"))
        self.bad(1, "type.exr: damaged: the attribute covary:checksums is of the type 'strinc', not 'string'",
                 "convert", "type.exr", "o.png")
        self.write("value.exr", data.replace(b"crc32 ", b"crc33 "))
        self.bad(1, "value.exr: damaged: the attribute covary:checksums is 'crc33 ", "convert", "value.exr", "o.png")

    def test_no_flipped_bit_goes_unnoticed(self):
        random.seed(27)
        for name in ("film.exr", "image.exr"):
            data = (self.path / name).read_bytes()
            told = self.good("info", name, "--json").stdout
            for bit in random.sample(range(8 * len(data)), FLIPS // 2):
                flipped = bytearray(data)
                flipped[bit // 8] ^= 1 << bit % 8
                self.write("flipped.exr", bytes(flipped))
                result = self.run_covary("info", "flipped.exr", "--json", errors="replace")
                if result.returncode == 0:  # nothing that covary reads, such as the shape of pixels on a screen
                    self.assertEqual(result.stdout.replace("flipped.exr", name), told, bit)
                    self.good("convert", "flipped.exr", "o.exr", "--layer", "")
                    self.assertEqual(read_exr((self.path / "o.exr").read_bytes())["G"], read_exr(data)["G"])


if __name__ == "__main__":
    unittest.main()
