# SPDX-License-Identifier: Apache-2.0
"""Work as it is in production: long sequences that are interrupted, with frames that are damaged or missing; frames
that a farm writes slowly; headers that are damaged."""
import os
import random
import re
import shlex
import shutil
import signal
import subprocess
import threading
import time
import unittest
from pathlib import Path

from cli_test import COVARY, CliTest
from destruction_test import mutilated
from exr_reader import read_exr
from exr_writer import exr, film, multipart

SIZE = (16, 12)
DENOISE = ("denoise", "a.####.exr", "b.####.exr", "--oidn", "off", "-o", "o.####.exr")


def noisy(seed, size=SIZE):
    chance = random.Random(seed)
    return exr({c: [0.5 * chance.expovariate(1) for _ in range(size[0] * size[1])] for c in "RGB"}, size)


class LongSequence(CliTest):
    FRAMES, MISSING, BAD = 240, 77, (40, 160)

    def interrupted(self, done):
        """Runs until so many frames are done, and interrupts."""
        process = subprocess.Popen([COVARY, *DENOISE, "--resume"], cwd=self.path, stderr=subprocess.DEVNULL)
        while process.poll() is None and len(list(self.path.glob("o.*.exr"))) < done:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 130)

    def test_interrupted_twice_with_bad_and_missing_frames(self):
        frames = [n for n in range(1, self.FRAMES + 1) if n != self.MISSING]
        for n in frames:
            for render in "ab":
                data = noisy(f"{render}{n}")
                row = len(data) - 8 * (8 + 4 * 3 * SIZE[0])  # from here on, rows are not what the header says
                self.write(f"{render}.{n:04d}.exr", data[:row] + b"\xff" * (len(data) - row) if n in self.BAD else data)
        self.interrupted(60)
        self.interrupted(150)
        left = sorted(p.name for p in self.path.iterdir() if p.name[0] not in "abo")
        self.assertEqual(left, [], "nothing is left of the frames that were begun")
        before = {p.name: p.stat().st_mtime_ns for p in self.path.glob("o.*.exr")}
        result = self.run_covary(*DENOISE, "--resume")
        self.assertEqual(result.returncode, 1)
        self.assertIn("note: 'a.####.exr' has no frame 77\n", result.stderr)
        self.assertRegex(result.stderr, r"\n\d+ frames in [\d.]+ s; \d+ existed already: ")
        self.assertRegex(result.stderr, r"2 of 239 frames incomplete: 40, 160; [ab].0040.exr is .*, [ab].0160.exr is ")
        good = [n for n in frames if n not in self.BAD]
        self.assertEqual(sorted(p.name for p in self.path.glob("o.*.exr")), [f"o.{n:04d}.exr" for n in good])
        for name, time_of in before.items():
            self.assertEqual((self.path / name).stat().st_mtime_ns, time_of, "done once")
        for n in (1, 61, 151, 240):
            self.good("denoise", f"a.{n:04d}.exr", f"b.{n:04d}.exr", "--oidn", "off", "-o", "alone.exr", "--overwrite")
            alone, together = (read_exr((self.path / name).read_bytes()) for name in ("alone.exr", f"o.{n:04d}.exr"))
            self.assertEqual(together["R"], alone["R"])


class SlowFarm(CliTest):
    def test_frames_are_taken_when_they_are_whole(self):
        """One program writes its frames bit by bit, the other under another name."""
        frames = {(render, n): noisy(f"{render}{n}") for render in "ab" for n in (1, 2, 3)}

        def write_all():
            for n in (1, 2, 3):
                with open(self.path / f"a.{n:04d}.exr", "wb") as file:
                    data = frames["a", n]
                    for first in range(0, len(data), len(data) // 4):
                        file.write(data[first:first + len(data) // 4])
                        file.flush()
                        time.sleep(0.3)
                self.write(f"b.{n:04d}.exr.part", frames["b", n])
                os.rename(self.path / f"b.{n:04d}.exr.part", self.path / f"b.{n:04d}.exr")
            self.write("a.0004.exr", frames["a", 1][:700])  # is never finished

        farm = threading.Thread(target=write_all)
        farm.start()
        result = self.run_covary(*DENOISE, "--watch", "--idle", "6")
        farm.join()
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("waiting for frames 'a.####.exr'; Ctrl-C, or 6 s without a new frame, ends, and --resume "
                      "continues\n", result.stderr)
        self.assertIn("covary: 1 of 4 frames incomplete: 4; a.0004.exr is unfinished, b.0004.exr is missing\n",
                      result.stderr)
        self.assertRegex(result.stderr, r"\n3 frames in [\d.]+ s\n")
        for n in (1, 2, 3):
            self.write("x.exr", frames["a", n])
            self.write("y.exr", frames["b", n])
            self.good("denoise", "x.exr", "y.exr", "--oidn", "off", "-o", "alone.exr", "--overwrite")
            alone, together = (read_exr((self.path / name).read_bytes()) for name in ("alone.exr", f"o.{n:04d}.exr"))
            self.assertEqual(together["R"], alone["R"])
        self.bad(2, "--idle is an option of --watch", *DENOISE, "--idle", "3")


class UnfinishedFarm(CliTest):
    def test_resume_takes_what_is_complete(self):
        for n in (1, 2, 3):
            self.write(f"a.{n:04d}.exr", noisy(f"a{n}"))
        self.write("b.0001.exr", noisy("b1"))
        self.write("b.0003.exr", noisy("b3")[:700])
        message = self.bad(1, "b.0002.exr", *DENOISE).stderr
        self.assertIn("b.0003.exr: is damaged or cut off", message)
        self.assertIn("nothing was written. --resume leaves out such frames, and those whose files are missing or "
                      "unfinished", message)
        self.assertEqual(list(self.path.glob("o.*")), [])
        for more in ("1 frame in", "0 frames in"):
            result = self.run_covary(*DENOISE, "--resume")
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertIn(more, result.stderr)
            self.assertIn("covary: 2 of 3 frames incomplete: 2-3; b.0002.exr is missing, b.0003.exr is unfinished\n",
                          result.stderr)
            self.assertEqual([p.name for p in self.path.glob("o.*")], ["o.0001.exr"])
        for n in (2, 3):
            self.write(f"b.{n:04d}.exr", noisy(f"b{n}"))
        self.assertIn("2 frames in", self.good(*DENOISE, "--resume").stderr)

    def test_resume_leaves_out_frames_of_another_size(self):
        for n in (1, 2, 3, 4):
            for name in "ab":
                self.write(f"{name}.{n:04d}.exr", noisy(f"{name}{n}", (20, 12) if n == 3 else SIZE))
        self.bad(1, "'a.0003.exr' has 20 x ", *DENOISE)
        result = self.run_covary(*DENOISE, "--resume")
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("warning: frame 3 is left out: 'a.0003.exr' has 20 x ", result.stderr)
        self.assertIn("covary: 1 of 4 frames failed: 3\n", result.stderr)
        self.assertEqual(sorted(p.name for p in self.path.glob("o.*")), [f"o.000{n}.exr" for n in (1, 2, 4)])

    def test_the_first_frame_may_be_the_one_of_another_size(self):
        for n in (1, 2, 3):
            for name in "ab":
                self.write(f"{name}.{n:04d}.exr", noisy(f"{name}{n}", (8, 6) if n == 1 else SIZE))
        self.assertIn("warning: frame 1 is left out: 'a.0001.exr' has 8 x 6 pixels at (0, 0), frame 2 has 16 x 12 ",
                      self.run_covary(*DENOISE, "--resume").stderr)
        self.good("denoise", "a.0001.exr", "b.0001.exr", "--oidn", "off", "-o", "o.0001.exr")
        for name in "ab":
            self.write(f"{name}.0001.exr", noisy(f"{name}1"))
        said = self.good(*DENOISE, "--resume").stderr
        self.assertIn("note: 'o.0001.exr' has another size than its renders; it is made again", said)
        self.assertIn("1 frame in", said)

    def test_unfinished_frames_with_a_result_are_counted(self):
        for n in (1, 2):
            for name in "ab":
                self.write(f"{name}.{n:04d}.exr", noisy(f"{name}{n}"))
        self.good(*DENOISE)
        self.write("b.0002.exr", noisy("b2")[:700])
        self.assertIn("0 frames in", said := self.good(*DENOISE, "--resume").stderr)
        self.assertIn("2 existed already: 1-2", said)

    def test_a_file_of_another_format_is_named(self):
        """It is not waited for."""
        for name in "ab":
            self.write(f"{name}.0001.exr", noisy(name))
        self.write("b.0001.exr", b"PF\n1 1\n-1.0\n" + bytes(12))
        result = self.run_covary(*DENOISE, "--resume")
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("warning: frame 1 (1 of 1) failed: b.0001.exr: not an EXR file", result.stderr)
        self.assertIn("covary: 1 of 1 frame failed: 1\n", result.stderr)


class WatchedFolder(CliTest):
    WATCH = ("--oidn", "off", "--watch", "--idle", "5")

    def setUp(self):
        super().setUp()
        for folder in "ab":
            (self.path / folder).mkdir()

    def watch(self, *more):
        return self.run_covary("denoise", "a", "b", "-o", "out", *self.WATCH, *more)

    def written(self, folder="out"):
        return sorted(p.name for p in (self.path / folder).iterdir())

    def test_images_are_taken_when_they_are_whole(self):
        """One program is writing a file, another renames; other files lie around."""
        images = {(folder, name): noisy(f"{folder}/{name}") for folder in "ab"
                  for name in ("shot 1.exr", "lamp.EXR", "slow.exr", "late.exr", "half.exr")}
        for (folder, name), data in images.items():
            if name not in ("slow.exr", "late.exr") and (folder, name) != ("b", "half.exr"):
                self.write(f"{folder}/{name}", data)
        self.write("b/half.exr", images["b", "half.exr"][:900])  # is never finished
        self.write("a/.hidden.exr", images["a", "shot 1.exr"])
        self.write("a/notes.txt", b"exr")
        self.write("b/bad.exr", images["b", "lamp.EXR"])
        self.write("a/bad.exr", exr({"Z": [1.0] * SIZE[0] * SIZE[1], "N": [1.0] * SIZE[0] * SIZE[1]}, SIZE))
        self.good("denoise", "a/shot 1.exr", "b/shot 1.exr", "--oidn", "off", "-o", "a/mine.exr")
        self.write("b/mine.exr", images["b", "lamp.EXR"])

        def farm():
            time.sleep(1)
            for folder in "ab":
                with open(self.path / folder / "slow.exr", "wb") as file:
                    data = images[folder, "slow.exr"]
                    for first in range(0, len(data), len(data) // 4):
                        file.write(data[first:first + len(data) // 4])
                        file.flush()
                        time.sleep(0.3)
                self.write(f"{folder}/late.part", images[folder, "late.exr"])
                os.rename(self.path / folder / "late.part", self.path / folder / "late.exr")

        thread = threading.Thread(target=farm)
        thread.start()
        result = self.watch()
        thread.join()
        self.assertEqual(result.returncode, 1)
        self.assertIn("waiting for images in 'a', 'b'; Ctrl-C, or 5 s without a new one, ends, and --resume "
                      "continues\n", result.stderr)
        self.assertIn("note: a/mine.exr is left out: 'covary denoise' made it\n", result.stderr)
        self.assertRegex(result.stderr, r"warning: bad.exr failed: a/bad.exr: .*\(channels: N Z\)")
        self.assertRegex(result.stderr, r"\nshot 1.exr: out/shot 1.exr, predicted relMSE [\d.]+.* \(unreliable: .*\)\n")
        self.assertRegex(result.stderr, r"\n4 images in [\d.]+ s\n")
        self.assertIn("covary: 1 of 6 images failed: bad.exr; --resume tries again; 1 of 6 images incomplete: half.exr;"
                      " unfinished, or missing in one of 'a', 'b'\n", result.stderr)
        done = ["lamp.EXR", "late.exr", "shot 1.exr", "slow.exr"]
        self.assertEqual(self.written(), done)
        for name in done:
            self.good("denoise", f"a/{name}", f"b/{name}", "--oidn", "off", "-o", "alone.exr", "--overwrite")
            alone, together = (read_exr((self.path / n).read_bytes()) for n in ("alone.exr", f"out/{name}"))
            self.assertEqual(together["R"], alone["R"])

    def test_resume(self):
        for folder in "ab":
            for name in ("1.exr", "2.exr"):
                self.write(f"{folder}/{name}", noisy(folder + name))
        (self.path / "out").mkdir()
        self.write("out/1.exr", b"there")
        result = self.watch("--resume", "--quiet")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual((self.path / "out/1.exr").read_bytes(), b"there")
        self.assertEqual(self.written(), ["1.exr", "2.exr"])

    def test_wrong_usage(self):
        self.write("x.exr", noisy("x"))
        for arguments, message in (
                (("a", "b", "-o", "out"), "'a' is a folder; --watch denoises the images that are in it"),
                (("a", "x.exr", "-o", "out", "--watch"), "'x.exr' is not a folder, but other inputs are"),
                (("a", "b", "-o", "b/../a", "--watch"), "-o 'b/../a': expected another folder than the input"),
                (("a", "b", "-o", "x.exr", "--watch"), "-o 'x.exr': for images of a folder, expected another folder"),
                (("a", "-o", "out", "--watch", "--frames", "1-2"), "--frames: the input is a folder"),
                (("a", "-o", "out", "--watch", "--json", "j"), "--json 'j': for images of a folder, expected -"),
                (("x.exr", "-o", "y.exr", "--watch"), "--watch: the input is no folder, and has no '#'")):
            self.bad(2, message, "denoise", *arguments)


PAGE = Path(os.environ["SCENES"]).parent / "docs/other-renderers.md"


class Recipes(CliTest):
    @unittest.skipUnless(shutil.which("oiiotool"), "OpenImageIO's oiiotool is not installed")
    def test_lines_of_the_page(self):
        section = PAGE.read_text().split("### With oiiotool\n")[1].split("\n##")[0]
        lines = "\n".join(line.strip() for line in section.splitlines() if line.startswith("    ")) + "\n"
        self.assertEqual(lines.count("oiiotool "), 5)
        chance = random.Random(1)
        n = SIZE[0] * SIZE[1]
        for render in "ab":
            self.write(f"{render}.exr", noisy(render))
            self.write(f"{render}.albedo.exr", exr({c: [0.5] * n for c in "RGB"}, SIZE))
            self.write(f"{render}.normal.exr", exr({c: [chance.random()] * n for c in "RGB"}, SIZE))
        lines = lines.replace("covary denoise", f"{shlex.quote(COVARY)} denoise --oidn off")
        result = subprocess.run(["sh", "-e", "-c", lines], cwd=self.path, capture_output=True, text=True, timeout=60)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("guided by albedo and normal", result.stderr)
        out, both, picture, grain = (read_exr((self.path / f"{name}.exr").read_bytes())
                                     for name in ("out", "both", "picture", "grain"))
        self.assertEqual(sorted(both), sorted([*"RGB", *(f"{layer}.{c}" for layer in ("albedo", "denoised")
                                                         for c in "RGB"), "N.X", "N.Y", "N.Z"]))
        for c in "RGB":
            self.assertEqual(both[f"denoised.{c}"], out[c])
            self.assertEqual(both[c], read_exr((self.path / "a.exr").read_bytes())[c])
            self.assertEqual(picture[c], out[c])
        self.good("info", "picture.exr")
        expected = [float(e / (g + 0.01) > 0.1) for e, g in zip(out["StdError.G"], out["G"])]
        self.assertGreater(sum(m == e for m, e in zip(grain["Y"], expected)), 0.98 * n)
        self.assertGreater(len(set(expected)), 0)


    @unittest.skipUnless(shutil.which("oiiotool"), "OpenImageIO's oiiotool is not installed")
    def test_data_windows_that_differ_are_filled_as_the_message_says(self):
        for render, window in (("a", "12x10+1+1"), ("b", "11x10+2+1")):
            self.write(f"{render}.exr", noisy(render))
            subprocess.run(["oiiotool", f"{render}.exr", "--crop", window, "-o", f"{render}.part.exr"], cwd=self.path,
                           check=True)
        parts = ("denoise", "a.part.exr", "b.part.exr", "-o", "o.exr", "--oidn", "off")
        said = self.bad(1, "or fill each to its frame: `oiiotool IN.exr --croptofull -o OUT.exr`", *parts).stderr
        advice = re.search("`(oiiotool .*)`", said)[1]
        for render in "ab":
            words = advice.replace("IN.exr", f"{render}.part.exr").replace("OUT.exr", f"{render}.full.exr").split()
            subprocess.run(words, cwd=self.path, check=True)
        self.good("denoise", "a.full.exr", "b.full.exr", "-o", "o.exr", "--oidn", "off")
        self.assertEqual(len(read_exr((self.path / "o.exr").read_bytes())["R"]), SIZE[0] * SIZE[1])


class Headers(CliTest):
    FILES = 1000

    def test_damaged_headers(self):
        """A command reads such a file or refuses it, naming it; none crashes."""
        planes = {f"{layer}{c}": [0.5] * 12 for layer in ("", "Albedo.", "ViewLayer.Combined.") for c in "RGB"}
        parts = [{"name": name, "channels": {c: [1.0] * 12 for c in "RGB"}} for name in ("left", "right")]
        files = ((exr(planes, (4, 3), attributes={"a": "text" * 9}), 3 * (8 + 16 * 9)), (film(1), 3 * (8 + 16 * 10)),
                 (multipart(parts, (4, 3)), 6 * (12 + 16 * 3)))  # with the bytes of their pixels
        commands = (("info", "bad.exr"), ("convert", "bad.exr", "o.png", "--overwrite"),
                    ("denoise", "bad.exr", "bad2.exr", "--oidn", "off", "--force", "-o", "o.exr", "--overwrite"))
        chance, codes = random.Random(1000), []
        for i in range(self.FILES):
            whole, pixels = files[i // len(commands) % len(files)]
            bad = mutilated(whole[:-pixels], chance) + whole[-pixels:]
            self.write("bad.exr", bad)
            self.write("bad2.exr", bad)
            result = self.run_covary(*commands[i % len(commands)], errors="replace")
            self.assertIn(result.returncode, (0, 1, 2), result.stderr)
            if result.returncode:
                self.assertIn("bad", result.stderr)
            codes.append(result.returncode)
        self.assertGreater(sum(code != 0 for code in codes), self.FILES / 3)


if __name__ == "__main__":
    unittest.main()
