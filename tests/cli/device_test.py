# SPDX-License-Identifier: Apache-2.0
"""`covary denoise --device`: OpenCL on the processor, as scripts/setup installs it, stands for any device."""
import json
import unittest

from exr_reader import header
from sequence_test import SequenceTest

OPENCL = ("--device", "opencl:0")


class DenoiseOnDevice(SequenceTest):
    def setUp(self):
        super().setUp()
        for name in ("a", "b"):
            self.good_render("-o", f"{name}_#.exr", "--spp", "4", "--seed", str(ord(name)), "--layers", "direct",
                             frames="1-3")

    def denoise(self, *arguments):
        return self.good("denoise", *arguments, "--oidn", "off", "--mode", "auto")

    def device(self, name):
        return header((self.path / name).read_bytes())[0].get("covary:device", b"").decode()

    def assert_close(self, expected, found):
        """99 % of the values; a few pixels of a small picture may choose otherwise."""
        expected, found = self.channels(expected), self.channels(found)
        self.assertEqual(set(found), set(expected))
        for channel, values in expected.items():
            close = [abs(a - b) <= 1e-4 * (abs(a) + 0.01) for a, b in zip(values, found[channel])]
            self.assertGreaterEqual(sum(close), 0.99 * len(close), channel)

    def test_layers(self):
        inputs = ("a_1.exr", "b_1.exr", "--layers", "Direct", "Indirect", "-o")
        self.denoise(*inputs, "cpu.exr")
        facts = json.loads(self.denoise(*inputs, "device.exr", *OPENCL, "--json", "-").stdout)
        self.assertNotIn("note", facts, "nothing was left to the processor")
        self.assertEqual(facts["device"], self.device("device.exr"))
        self.assertTrue(facts["device"].startswith("opencl:0 ("))
        self.assertEqual(self.device("cpu.exr"), "")
        self.assert_close("cpu.exr", "device.exr")

    def test_frames_with_a_history(self):
        """A frame's files are read while the one before is denoised, but not with --watch: the same bits."""
        inputs = ("a_#.exr", "b_#.exr", "-o")
        self.denoise(*inputs, "cpu_#.exr")
        self.denoise(*inputs, "device_#.exr", *OPENCL)
        self.denoise(*inputs, "watched_#.exr", *OPENCL, "--watch", "--frames", "1-3")
        for frame in (1, 2, 3):
            self.assert_close(f"cpu_{frame}.exr", f"device_{frame}.exr")
            self.assertEqual(self.channels(f"watched_{frame}.exr"), self.channels(f"device_{frame}.exr"))
            self.assertTrue(self.device(f"device_{frame}.exr").startswith("opencl:0 ("))
        self.denoise("a_2.exr", "b_2.exr", "-o", "alone.exr", *OPENCL)
        self.assertNotEqual(self.picture("alone.exr"), self.picture("device_2.exr"), "without the frame before")

    def test_what_cannot_be(self):
        self.bad(2, "--device 'gpu': expected cpu, auto, cuda, opencl", "denoise", "a_1.exr", "b_1.exr", "-o", "c.exr",
                 "--device", "gpu")
        self.bad(2, "--device runs mixtures of denoised images, not Open Image Denoise alone", "denoise", "a_1.exr",
                 "-o", "c.exr", "--mode", "oidn", *OPENCL)
        self.bad(2, "--device runs mixtures, which need a second render of another seed", "denoise", "a_1.exr", "-o",
                 "c.exr", *OPENCL)


if __name__ == "__main__":
    unittest.main()
