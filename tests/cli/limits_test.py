# SPDX-License-Identifier: Apache-2.0
"""Small files that stand for very much: every command ends within a second of processor time and 200 MB of memory, with
a message that tells the limit."""
import json
import os
import resource
import signal
import struct
import subprocess
import tempfile
import unittest
import zlib
from pathlib import Path

COVARY = os.environ["COVARY"]
SANITIZED = "SANITIZED" in os.environ
CPU_SECONDS = 60 if SANITIZED else 5
MEMORY = 200e6

SENSOR = """<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="16"/>
<integer name="height" value="9"/><rfilter type="box"/></film></sensor>"""


def scene(body):
    return f'<scene version="3.0.0">{SENSOR}\n{body}\n</scene>'


def limit():
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
    if not SANITIZED:  # which reserve terabytes
        resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))


class Limits(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)
        self.max_memory = MEMORY

    def write(self, name, content):
        (self.path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return name

    def run_limited(self, *arguments, environment=None):
        """Exit code and what stands on stderr."""
        errors = self.path / "stderr"
        with open(errors, "wb") as stderr:
            child = subprocess.Popen([COVARY, *arguments, *(["--threads", "1"] if arguments[0] == "render" else [])],
                                     cwd=self.path, stdout=subprocess.DEVNULL, stderr=stderr, preexec_fn=limit,
                                     env=os.environ | (environment or {}))
            _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        text = errors.read_text(errors="replace")
        too_long = (-signal.SIGXCPU, -signal.SIGKILL)
        self.assertNotIn(child.returncode, too_long, f"more than {CPU_SECONDS} s: {arguments}")
        self.assertIn(child.returncode, (0, 1, 2), text)
        self.assertNotIn("internal error", text)
        if not SANITIZED:
            self.assertLess(usage.ru_maxrss * 1024, self.max_memory, arguments)
        return child.returncode, text

    def refused(self, message, *arguments, environment=None):
        code, text = self.run_limited(*arguments, environment=environment)
        self.assertEqual(code, 1, text)
        self.assertIn(message, text)

    def refused_scene(self, message, file, environment=None):
        self.refused(message, "info", file, environment=environment)
        self.refused(message, "render", file, "-o", "out.exr", "--spp", "4", "--quiet", environment=environment)

    def test_blends_of_blends(self):
        body = '<bsdf type="diffuse" id="b0"/>'
        for i in range(1, 31):
            body += (f'<bsdf type="blendbsdf" id="b{i}"><float name="weight" value="0.5"/>'
                     f'<ref id="b{i - 1}"/><ref id="b{i - 1}"/></bsdf>')
        self.write("s.xml", scene(body + '<shape type="sphere"><ref id="b30"/></shape>'))
        self.refused_scene("holds 8191 objects when every reference is followed; at most 4096", "s.xml")

    def test_chains_of_references(self):
        body = '<bsdf type="diffuse" id="b0"/>\n'
        for i in range(1, 20000):
            body += f'<bsdf type="mask" id="b{i}"><float name="opacity" value="1"/><ref id="b{i - 1}"/></bsdf>\n'
        self.write("s.xml", scene(body))
        self.refused_scene("objects inside each other when every reference is followed; at most 64", "s.xml")

    def test_groups_of_groups(self):
        body = '<shape type="shapegroup" id="g0"><shape type="sphere"/></shape>'
        for i in range(1, 9):
            body += f'<shape type="shapegroup" id="g{i}">' + f'<shape type="instance"><ref id="g{i - 1}"/></shape>' * 10
            body += "</shape>"
        self.write("s.xml", scene(body + '<shape type="instance"><ref id="g8"/></shape>'))
        self.refused_scene("a shapegroup cannot hold a shape 'instance'", "s.xml")

    def test_includes_of_includes(self):
        self.write("i0.xml", '<scene version="3.0.0"><shape type="sphere"/></scene>')
        for i in range(1, 9):
            self.write(f"i{i}.xml", f'<scene version="3.0.0">{10 * f"""<include filename="i{i - 1}.xml"/>"""}</scene>')
        self.write("s.xml", scene('<include filename="i8.xml"/>'))
        self.refused_scene("more than 1000 includes", "s.xml")

    def test_substitutions(self):
        body = '<default name="a0" value="0123456789abcdef"/>'
        for i in range(1, 16):
            body += f'<default name="a{chr(96 + i)}" value="{2 * ("$a0" if i == 1 else "$a" + chr(95 + i))}"/>'
        body += "".join(f'<bsdf type="diffuse" id="{i}$ao"/>' for i in range(1000))
        self.write("s.xml", scene(body))
        self.refused_scene("more than 16 MiB have been substituted", "s.xml")

    def test_a_pipe_for_a_mesh(self):
        os.mkfifo(self.path / "pipe")
        self.write("s.xml", scene('<shape type="ply"><string name="filename" value="pipe"/></shape>'))
        self.refused_scene("is a pipe or device; expected a regular file", "s.xml")

    def test_a_pipe_for_an_image(self):
        os.mkfifo(self.path / "pipe.exr")
        self.refused("pipe.exr: not a regular file", "info", "pipe.exr")

    def test_continued_lines(self):
        self.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 \\\n2 3\n")
        self.write("s.xml", scene('<shape type="obj"><string name="filename" value="a.obj"/></shape>'))
        code, text = self.run_limited("info", "s.xml")
        self.assertEqual((code, text.count("\n")), (0, 1), text)
        self.assertIn("has no light", text)

    def exr(self, attributes, body=b""):
        """An EXR file of 4 x 4 pixels with these attributes besides the required ones."""
        def attribute(name, kind, value, size=None):
            return name + b"\0" + kind + b"\0" + struct.pack("<I", len(value) if size is None else size) + value
        names = attributes.pop("channels", ("B", "G", "R"))
        channels = b"".join(c.encode() + b"\0" + struct.pack("<iiii", 0 if c == "samples" else 2, 0, 1, 1)
                            for c in names) + b"\0"
        size = attributes.pop("size", (4, 4))
        window = struct.pack("<iiii", 0, 0, size[0] - 1, size[1] - 1)
        header = b"".join([
            attribute(b"channels", b"chlist", channels), attribute(b"compression", b"compression", b"\3"),
            attribute(b"dataWindow", b"box2i", window), attribute(b"displayWindow", b"box2i", window),
            attribute(b"lineOrder", b"lineOrder", b"\0"),
            attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
            attribute(b"screenWindowCenter", b"v2f", bytes(8)),
            attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)),
            *[attribute(n.encode(), *v) for n, v in attributes.items()]])
        return b"\x76\x2f\x31\x01\2\0\0\0" + header + b"\0" + body

    def black_exr(self, width, height, channels=("B", "G", "R"), **attributes):
        """Whole, and small for its size: blocks of 16 rows, as the format's predictor and zlib pack zeros."""
        texts = {f"covary:{name}": (b"string", value.encode()) for name, value in attributes.items()}
        header = self.exr({"size": (width, height), "channels": channels, **texts})
        blocks = []
        for y in range(0, height, 16):
            n_bytes = min(16, height - y) * width * 4 * len(channels)
            packed = zlib.compress(b"\0" + b"\x80" * (n_bytes - 1), 9) if y % 1600 == 0 or y + 16 > height else packed
            blocks.append(struct.pack("<ii", y, len(packed)) + packed)
        offsets, at = b"", len(header) + 8 * len(blocks)
        for block in blocks:
            offsets += struct.pack("<Q", at)
            at += len(block)
        return header + offsets + b"".join(blocks)

    def black_png(self, width, height):
        def chunk(kind, data):
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        deflate = zlib.compressobj(1)
        rows = b"".join(deflate.compress(bytes(1 + 3 * width)) for _ in range(height)) + deflate.flush()
        return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                chunk(b"IDAT", rows) + chunk(b"IEND", b""))

    def test_small_files_of_many_pixels(self):
        """What their pixels need is known from headers, and refused where it is more than the limit."""
        small = {"COVARY_MEMORY": "0.2"}
        self.write("a.png", self.black_png(12000, 12000))
        self.write("a.exr", self.black_exr(12000, 12000))
        for name, texture, environment in (("a.png", "1.0 GB", "4.3 GB"), ("a.exr", "3.5 GB", "4.3 GB")):
            self.assertLess((self.path / name).stat().st_size, 2e6)
            file = f'<string name="filename" value="{name}"/>'
            for needed, body in (
                    (texture, '<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">'
                              f"{file}</texture></bsdf></shape>"),
                    (environment, f'<emitter type="envmap">{file}</emitter>')):
                self.write("s.xml", scene(body))
                self.refused_scene(f"{name}: a texture of 12000 x 12000 pixels needs {needed} of memory in ",
                                   "s.xml", small)
            for arguments in (("compare", name, "-r", name, "--error-map", "map.png"),
                              ("view", name, "-o", "a.html")):
                self.refused(f"{name}: an image of 12000 x 12000 pixels needs ", *arguments, environment=small)
            self.assertEqual(self.run_limited("info", name, environment=small)[0], 0)
        code, text = self.run_limited("compare", "a.exr", "-r", "a.exr", environment={"COVARY_MEMORY": "a lot"})
        self.assertEqual(code, 2)
        self.assertIn("the environment variable COVARY_MEMORY is 'a lot'; expected a number of GB, at least 0.2",
                      text)

    def test_what_is_made_of_images(self):
        """The images themselves fit, but not what the command makes of them."""
        self.write("a.exr", self.black_exr(2000, 2000))
        limited = {"COVARY_MEMORY": "0.2"}
        # A comparison holds bands of rows; both images whole would take 211 MB.
        self.write("big.exr", self.black_exr(4000, 2200))
        self.write("wide.exr", self.black_exr(64000, 64))
        self.assertEqual(self.run_limited("compare", "big.exr", "-r", "big.exr", environment=limited)[0], 0)
        self.max_memory = 60e6  # not even one copy is read
        self.refused("an image of 4000 x 2200 pixels needs 316.8 MB ", "view", "big.exr", "-o", "a.html",
                     environment=limited)
        self.max_memory = MEMORY
        self.refused("an image of 64000 x 36 pixels needs ", "compare", "wide.exr", "-r", "wide.exr", "--metric",
                     "flip", environment=limited)
        self.refused("an image of 4000 x 2000 pixels needs 384.0 MB ", "convert", "a.exr", "a.exr", "out.exr",
                     environment=limited)
        self.write("b.exr", self.black_exr(2000, 2000, ["B", "G", "R", *(f"{c}.Y" for c in "CDEF")]))
        self.refused("an image of 2000 x 2000 pixels needs 192.0 MB ", "view", "b.exr", "-o", "a.html",
                     environment=limited)
        self.refused("an image of 2000 x 2000 pixels needs 2.8 GB ", "denoise", "a.exr", "-o", "out.exr",
                     environment=limited)
        channels = ["B", "G", "R", *(f"group{g:02}.{c}" for g in range(12) for c in "BGR"), "samples"]
        film = self.black_exr(800, 600, channels, film="1", groups="12", samples="12", sampling="crn", scene_hash="a",
                              settings="path", complete="true", seed="1")
        self.write("f.exr", film)
        self.write("g.exr", film.replace(b"covary:seed\0string\0\1\0\0\0001", b"covary:seed\0string\0\1\0\0\0002"))
        self.refused("an image of 800 x 600 pixels needs 307.2 MB ", "merge", "f.exr", "g.exr", "-o", "out.exr",
                     environment=limited)

    def grid(self, side):
        """A mesh of side x side vertices in binary PLY."""
        vertices = b"".join(struct.pack("<fff", x, y, (x * y) % 7 / 10) for y in range(side) for x in range(side))
        faces = b"".join(struct.pack("<BiiiBiii", 3, a, a + 1, a + side, 3, a + 1, a + side + 1, a + side)
                         for y in range(side - 1) for a in range(y * side, y * side + side - 1))
        header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {side * side}\nproperty float x\n"
                  f"property float y\nproperty float z\nelement face {2 * (side - 1)**2}\n"
                  "property list uchar int vertex_indices\nend_header\n")
        return header.encode() + vertices + faces

    def test_meshes_many_times(self):
        """Instances of a mesh that emits are copies; a file that is named many times is read as often."""
        self.max_memory = 250e6
        limited = {"COVARY_MEMORY": "0.2"}
        self.write("a.ply", self.grid(150))
        mesh = '<shape type="ply"><string name="filename" value="a.ply"/>{}</shape>'
        emitter = '<emitter type="area"/>'
        group = f'<shape type="shapegroup" id="g">{mesh.format(emitter)}</shape>'
        self.write("s.xml", scene(group + '<shape type="instance"><ref id="g"/></shape>' * 1000))
        self.refused_scene("1000 instances of a shapegroup, of whose shapes those that emit light are copied, ",
                           "s.xml", limited)
        self.write("s.xml", scene(mesh.format("") * 40))
        self.refused_scene("s.xml: tracing rays through 1776080 triangles and other shapes needs 159.8 MB of memory",
                           "s.xml", limited)
        self.write("s.xml", scene(mesh.format("") * 300))
        self.refused_scene("a.ply: its mesh needs 2.5 MB of memory in addition to the ", "s.xml", limited)

    def test_files_of_many_layers(self):
        channels = sorted(f"layer{i:05}.{c}" for i in range(20000) for c in "RGB")
        self.write("a.exr", self.black_exr(1, 1, ["B", "G", "R"] + channels))
        code, text = self.run_limited("view", "a.exr", "-o", "a.html")
        self.assertEqual(code, 0, text)
        self.assertIn("20000 layers beside the image; the page has the first 100 (--layer shows another one)", text)
        self.write("b.exr", self.black_exr(1, 1, channels))
        self.refused("choose a layer by --layer (layers: layer00000, layer00001, ", "view", "b.exr", "-o", "b.html")

    def test_attributes_that_claim_too_much(self):
        self.write("a.exr", self.exr({"owner": (b"string", b"me", 1980000000)}, bytes(4000)))
        self.write("b.exr", self.exr({"size": (200000, 200000)}, bytes(4000)))
        for command in (["info"], ["convert"], ["compare", "-r", "a.exr"]):
            more = ["out.png"] if command[0] == "convert" else []
            self.refused("the attribute 'owner' claims 1980000000 bytes", *command, "a.exr", *more)
        self.refused("b.exr: ", "info", "b.exr")
        for name in ("a.exr", "b.exr"):
            self.write("s.xml", scene(f'<emitter type="envmap"><string name="filename" value="{name}"/></emitter>'))
            self.refused_scene(f"{name}", "s.xml")

    def test_images_that_claim_too_much(self):
        self.write("a.pfm", "PF\n30000 30000\n-1\n1234")
        self.refused("claims 30000 x 30000 pixels of 3 channels in 22 bytes", "info", "a.pfm")

    def test_suites(self):
        suite = {"name": "x", "scenes": [{"name": "c", "file": "c.xml"}], "methods": [{"name": "pt"}],
                 "budgets": [{"spp": 24}], "reference": {"spp": 64}, "seeds": 4000000000}
        self.write("seeds.json", json.dumps(suite))
        self.refused("seeds: expected 1 to 100000 seeds, found 4000000000", "experiment", "seeds.json", "-o", "out")
        self.write("deep.json", '{"name": ' + "[" * 200000)
        self.refused("deep.json:1: arrays and objects nest deeper than 64", "experiment", "deep.json", "-o", "out")


if __name__ == "__main__":
    unittest.main()
