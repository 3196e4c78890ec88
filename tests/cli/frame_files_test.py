# SPDX-License-Identifier: Apache-2.0
"""What is made of numbered images of any renderer: comparisons and videos."""
import base64
import json
import os
import subprocess

from cli_test import COVARY, CliTest


class Compare(CliTest):
    """`covary compare` of frames, with errors that are known: of relMSE the weight is 1 / 1.01."""

    def setUp(self):
        super().setUp()
        size = (64, 32)
        self.image("same.exr", [1, 1, 1], size=size)
        for frame, values in ((1, (1.1, 1)), (2, (1.3, 1)), (3, (1.3, 1))):
            for name, value in zip(("out", "ref"), values):
                self.image(f"{name}_{frame}.exr", [value] * 3, size=size)
            self.image(f"alone_{frame}.exr", [1.2 if frame % 2 else 0.8] * 3, size=size)

    def test_errors_of_frames_and_changes(self):
        line = self.good("compare", "out_#.exr", "--reference", "ref_#.exr", "--json", "--baseline", "alone_#.exr",
                         "--metric", "relmse,mse").stdout
        result = json.loads(line)
        for name, values in (("relmse", [0.01, 0.09, 0.09]), ("temporal", [None, 0.04, 0]),
                             ("still_relmse", [None, 0.09, 0.09])):
            of_frames = [frame[name] for frame in result["frames"]]
            for value, expected in zip(of_frames, values):
                if expected is None:
                    self.assertIsNone(value)
                else:
                    self.assertAlmostEqual(value, expected / 1.01, 6)
            known = [v / 1.01 for v in values if v is not None]
            self.assertAlmostEqual(result[name], sum(known) / len(known), 6)
        self.assertAlmostEqual(result["mse"], 0.19 / 3, 6)
        self.assertGreater(result["frames"][1]["temporal_flip"], 0.05)
        self.assertEqual(result["frames"][2]["temporal_flip"], 0)
        worst = result["worst_region"]
        self.assertAlmostEqual(worst["relmse_of_frame"]["ratio"], 0.09 / 0.04, 5)
        self.assertEqual(worst["relmse_of_frame"]["frame"], 2)
        self.assertAlmostEqual(worst["temporal"]["ratio"], 0.04 / (2 * 0.16), 5)
        # A reference of all frames.
        other = json.loads(self.good("compare", "out_#.exr", "--reference", "same.exr", "--json").stdout)
        self.assertEqual(other["temporal"], result["temporal"])

    def test_table(self):
        lines = self.good("compare", "out_#.exr", "alone_#.exr", "-r", "ref_#.exr", "--baseline", "alone_#.exr",
                          "--frames", "2-3").stdout.splitlines()
        rows = {line.split()[0]: line.split()[1:] for line in lines[4:] if line}
        self.assertEqual(rows["out_2.exr"], ["0.0891089", "-", "-", "-"])
        self.assertEqual(lines[-1].split(), ["alone_#.exr"] + ["1"] * 8)
        self.assertNotIn("out_1.exr", rows)

    def test_wrong_input(self):
        for arguments, message in ((("out_#.exr", "out_1.exr"), "either all images are names with '#', or none"),
                                   (("out_1.exr", "--frames", "1"), "--frames and --baseline need frames"),
                                   (("out_#.exr", "--error-map", "e.png"), "--error-map is an option of single images"),
                                   (("out_#.exr", "--baseline", "out_1.exr"), "--baseline 'out_1.exr' has no '#'"),
                                   (("out_#.exr", "--frames", "3-4"), "out_4.exr"),
                                   (("none_#.exr",), "there are no frames 'none_#.exr'")):
            result = self.run_covary("compare", *arguments, "-r", "same.exr")
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(message, result.stderr)


# In the place of ffmpeg: its last argument gets the arguments and what came by standard input.
STAND_IN = """#!/bin/sh
for last; do :; done
echo "$@" > "$last"
cat >> "$last"
test ! -e fail
"""


# One red frame of 120 x 80 pixels, MPEG-4 with H.264.
MOVIE = base64.b64decode(
    "AAAAIGZ0eXBpc29tAAACAGlzb21pc28yYXZjMW1wNDEAAAAIZnJlZQAAAD5tZGF0AAAAMmWIhDoRigACGPHAAED2OAAIeUnJycnJycnXXXXXXX"
    "XXXXXXXXXXXXXXXXXXXXXXXXXgAAAC621vb3YAAABsbXZoZAAAAAAAAAAAAAAAAAAAA+gAAAPoAAEAAAEAAAAAAAAAAAAAAAABAAAAAAAAAAAA"
    "AAAAAAAAAQAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAIAAAI6dHJhawAAAFx0a2hkAAAAAwAAAAAAAAAAAA"
    "AAAQAAAAAAAAPoAAAAAAAAAAAAAAAAAAAAAAABAAAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAAAAQAAAAAB4AAAAUAAAAAAAJGVkdHMAAAAc"
    "ZWxzdAAAAAAAAAABAAAD6AAAAAAAAQAAAAABsm1kaWEAAAAgbWRoZAAAAAAAAAAAAAAAAAAAQAAAAEAAVcQAAAAAAC1oZGxyAAAAAAAAAAB2aW"
    "RlAAAAAAAAAAAAAAAAVmlkZW9IYW5kbGVyAAAAAV1taW5mAAAAFHZtaGQAAAABAAAAAAAAAAAAAAAkZGluZgAAABxkcmVmAAAAAAAAAAEAAAAM"
    "dXJsIAAAAAEAAAEdc3RibAAAALlzdHNkAAAAAAAAAAEAAACpYXZjMQAAAAAAAAABAAAAAAAAAAAAAAAAAAAAAAB4AFAASAAAAEgAAAAAAAAAAQ"
    "xMYXZjIGxpYngyNjQAAAAAAAAAAAAAAAAAAAAAAAAAABj//wAAAC9hdmNDAULACv/hABhnQsAK2ggvl8BEAAADAAQAAAMACDxImoABAARozg/I"
    "AAAAEHBhc3AAAAABAAAAAQAAABRidHJ0AAAAAAAAAbAAAAAAAAAAGHN0dHMAAAAAAAAAAQAAAAEAAEAAAAAAHHN0c2MAAAAAAAAAAQAAAAEAAA"
    "ABAAAAAQAAABRzdHN6AAAAAAAAADYAAAABAAAAFHN0Y28AAAAAAAAAAQAAADAAAAA9dWR0YQAAADVtZXRhAAAAAAAAACFoZGxyAAAAAAAAAABt"
    "ZGlyYXBwbAAAAAAAAAAAAAAAAAhpbHN0")


class Video(CliTest):
    def setUp(self):
        super().setUp()
        (self.path / "bin").mkdir()
        self.write("bin/ffmpeg", STAND_IN.encode())
        (self.path / "bin/ffmpeg").chmod(0o755)
        for frame, value in ((1, 0), (2, 1), (10, 9)):
            self.image(f"f_{frame:02}.exr", [value] * 3)
        self.environment = {**os.environ, "PATH": f"{self.path}/bin:{os.environ['PATH']}"}

    def convert(self, *arguments):
        return subprocess.run([COVARY, "convert", *arguments], cwd=self.path, env=self.environment, capture_output=True,
                              text=True)

    def test_frames_have_no_rate(self):
        self.assertIn("--fps is an option of videos", self.convert("f_##.exr", "p_##.png", "--fps", "12").stderr)

    def test_videos_are_no_images(self):
        """OpenImageIO's reader of them writes past the memory of frames of this width."""
        self.write("movie.mp4", MOVIE)
        for command in (("convert", "movie.mp4", "a.png"), ("info", "movie.mp4"),
                        ("view", "movie.mp4", "-o", "a.html")):
            self.bad(1, "movie.mp4: not an image that can be read", *command)
        self.bad(1, "movie.mp4: not an image that can be read", "compare", "f_01.exr", "-r", "movie.mp4")

    def test_frames_go_to_ffmpeg_in_their_order(self):
        result = self.convert("f_##.exr", "v.mp4", "--fps", "12")
        self.assertEqual(result.returncode, 0, result.stderr)
        arguments, frames = (self.path / "v.mp4").read_bytes().split(b"\n", 1)
        self.assertIn(b"-video_size 4x3 -framerate 12", arguments)
        self.assertEqual(frames, bytes(36) + b"\xff" * 72)
        result = self.convert("f_##.exr", "f_##.exr", "v.mp4")  # its own is replaced
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(b"-video_size 8x3 -framerate 24", (self.path / "v.mp4").read_bytes())

    def test_frames_go_to_frames(self):
        """Each as alone; a file without a number stands beside all."""
        self.image("logo.exr", [5] * 3)
        for arguments, alone in ((("f_##.exr", "p_####.png"), ("f_10.exr", "alone.png")),
                                 (("f_##.exr", "logo.exr", "q_####.png"), ("f_10.exr", "logo.exr", "alone.png"))):
            width = 4 * (len(alone) - 1)
            for words, told in ((arguments, f"{arguments[-1]}: 3 frames\n"),
                                (alone, f"alone.png: {width} x 3 pixels\n")):
                result = self.convert(*words, "--exposure", "-5", "--overwrite")
                self.assertEqual((result.returncode, result.stderr), (0, told))
            pattern = arguments[-1]
            self.assertEqual(sorted(p.name for p in self.path.glob(pattern.replace("####", "*"))),
                             [pattern.replace("####", f"{n:04}") for n in (1, 2, 10)])
            self.assertEqual((self.path / pattern.replace("####", "0010")).read_bytes(),
                             (self.path / "alone.png").read_bytes())
        for arguments, code, message in (
                (("f_##.exr", "one.png"), 2, "'f_##.exr' are frames: expected an output with a '#', too, or a video"),
                (("logo.exr", "p_##.png"), 2, "the output 'p_##.png' has a '#' for the number of a frame, but no "),
                (("g_##.exr", "p_##.png"), 1, "there are no frames 'g_##.exr'")):
            result = self.convert(*arguments)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(message, result.stderr)

    def test_failures_leave_no_file(self):
        (self.path / "fail").touch()
        self.assertIn("ffmpeg could not write 'v.mp4'", self.convert("f_##.exr", "v.mp4").stderr)
        (self.path / "fail").unlink()
        self.image("f_03.exr", [1, 1, 1], size=(2, 2))
        self.assertIn("a frame of 2 x 2 pixels; those before have 4 x 3", self.convert("f_##.exr", "v.mp4").stderr)
        for path in (self.path / "f_03.exr", self.path / "bin/ffmpeg"):
            path.unlink()
        self.environment["PATH"] = f"{self.path}/bin:/nowhere"
        errors = self.convert("f_##.exr", "v.mp4").stderr
        self.assertEqual(errors, "covary: videos need the program ffmpeg, which is not installed (Debian: apt install "
                                 "ffmpeg)\n")
        self.assertEqual([p.name for p in self.path.glob("*v.mp4")], [])

    def test_wrong_input(self):
        self.write("v.mp4", b"precious")
        for arguments, message in ((("f_01.exr", "w.mp4"), "'f_01.exr': of a video, expected names with '#'"),
                                   (("g_##.exr", "w.mp4"), "there are no frames 'g_##.exr'"),
                                   (("f_##.exr", "v.mp4"), "--overwrite to replace it"),
                                   (("f_01.exr", "a.png", "--fps", "3"), "--fps is an option of videos")):
            result = self.convert(*arguments)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(message, result.stderr)
        self.assertEqual((self.path / "v.mp4").read_bytes(), b"precious")


if __name__ == "__main__":
    import unittest
    unittest.main()
