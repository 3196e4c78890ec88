# SPDX-License-Identifier: Apache-2.0
"""covary render --display-server: what arrives at a viewer, and renders whose viewer is missing or goes away."""
import os
import socket
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from receiver import CREATE_IMAGE, UPDATE_IMAGE_V3, Receiver

sys.path.insert(0, str(Path(__file__).parent.parent / "cli"))
from exr_reader import read_exr  # noqa: E402

SCENE = str(Path(os.environ["SCENES"]) / "room.xml")


class DisplayServer(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def render(self, name, *options):
        command = [os.environ["COVARY"], "render", SCENE, "-o", name, "--resolution", "48x32", "--quiet",
                   "--no-preview", *options]
        return subprocess.run(command, cwd=self.path, capture_output=True, text=True, timeout=60)

    def check_last_image(self, *options):
        receiver = Receiver()
        result = self.render("out.exr", "--display-server", receiver.address, *options)
        receiver.finish()
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual(receiver.problems, [])
        self.assertEqual(receiver.packets[0], CREATE_IMAGE)
        self.assertEqual(set(receiver.packets[1:]), {UPDATE_IMAGE_V3})
        image, = receiver.images.values()
        self.assertEqual(list(receiver.images), ["out.exr"])
        self.assertEqual((image.width, image.height), (48, 32))
        expected = read_exr((self.path / "out.exr").read_bytes())
        for channel in "RGB":
            self.assertEqual(image.channels[channel], expected[channel])
        return receiver

    def test_last_image_is_the_film(self):
        self.check_last_image("--estimator", "none", "--spp", "16")

    def test_last_image_is_the_estimate(self):
        self.check_last_image("--spp", "24")

    def test_images_arrive_while_rendering(self):
        receiver = self.check_last_image("--estimator", "none", "--time", "1.6")
        self.assertGreaterEqual(receiver.packets.count(UPDATE_IMAGE_V3), 3)

    def test_tiles_of_polynomials_arrive_while_rendering(self):
        receiver = self.check_last_image("--estimator", "polynomials", "--spp", "512", "--threads", "1")
        self.assertGreaterEqual(receiver.packets.count(UPDATE_IMAGE_V3), 2)

    def test_lost_viewer_changes_nothing(self):
        receiver = Receiver(stop_after=2)
        options = ("--estimator", "none", "--spp", "512")
        result = self.render("a.exr", "--display-server", receiver.address, *options)
        receiver.finish()
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertLessEqual(result.stderr.count("warning: display server"), 1)
        self.assertEqual(self.render("b.exr", *options).returncode, 0)
        a, b = (read_exr((self.path / name).read_bytes()) for name in ("a.exr", "b.exr"))
        self.assertEqual(a, b)

    def test_missing_viewer_is_one_warning(self):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        result = self.render("a.exr", "--display-server", f"127.0.0.1:{port}", "--spp", "16")
        self.assertEqual(result.returncode, 0)
        self.assertEqual(result.stderr, f"warning: display server 127.0.0.1:{port}: cannot connect: "
                                        "Connection refused; "
                                        "rendering continues without it\n")
        self.assertTrue((self.path / "a.exr").exists())

    def test_wrong_address(self):
        result = self.render("a.exr", "--display-server", "localhost")
        self.assertEqual(result.returncode, 2)
        self.assertIn("'localhost': expected HOST:PORT, e.g. localhost:14158", result.stderr)


if __name__ == "__main__":
    unittest.main()
