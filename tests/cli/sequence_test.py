# SPDX-License-Identifier: Apache-2.0
"""`covary render --frames`: numbered images along a camera path, each as it would be alone."""
import base64
import json
import os
import re
import signal
import struct
import subprocess
import time
from pathlib import Path

from cli_test import COVARY, SLOWDOWN, CliTest
from exr_reader import read_exr
from exr_writer import film

ROOM = (Path(os.environ["SCENES"]) / "room.xml").read_text()
QUIET = ("--quiet", "--no-preview")
SMALL = {"--resolution": "32x24", "--spp": "8", "--denoise": "none"}
TO_WORLD = re.compile(r'(<sensor type="perspective">.*?)<lookat[^>]*/>', re.DOTALL)
SMALL_WORDS = [word for option in SMALL.items() for word in option]
# The camera walks to the left and turns; rows of matrices.
START = [[-1, 0, 0, 0.5], [0, 1, 0, 1.3], [0, 0, -1, 3.5], [0, 0, 0, 1]]
END = [[-0.8, 0, -0.6, 0.1], [0, 1, 0, 1.3], [0.6, 0, -0.8, 3.5], [0, 0, 0, 1]]


class SequenceTest(CliTest):
    def setUp(self):
        super().setUp()
        self.write_text("room.xml", ROOM)
        self.write_path((1, START), (4, END))

    def write_text(self, name, text):
        self.write(name, text.encode())

    def render(self, *arguments, frames="1-4"):
        return self.render_small("room.xml", "--camera-path", "path.json", "--frames", frames, *arguments)

    def render_small(self, scene, *arguments):
        small = [word for option in SMALL.items() if option[0] not in arguments for word in option]
        return self.run_covary("render", scene, *QUIET, *small, *arguments)

    def write_path(self, *keys):
        frames = [{"time": time, "to_world": matrix} for time, matrix in keys]
        self.write_text("path.json", json.dumps({"keyframes": frames}))

    def good_render(self, *arguments, **frames):
        result = self.render(*arguments, **frames)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def channels(self, name):
        return read_exr((self.path / name).read_bytes())

    def picture(self, name):
        channels = self.channels(name)
        return [channels[c] for c in "RGB"]


class Frames(SequenceTest):
    def test_each_is_the_image_of_that_camera_and_seed(self):
        small = ("--resolution", "32x24", "--spp", "8", "--denoise", "auto")
        self.good_render("-o", "f_##.exr", "--seed", "3", *small)
        self.assertEqual(sorted(p.name for p in self.path.glob("f_*")), [f"f_0{n}.exr" for n in range(1, 5)])
        for frame, matrix in ((1, START), (4, END)):
            numbers = " ".join(str(value) for row in matrix for value in row)
            self.write_text("alone.xml", TO_WORLD.sub(rf'\1<matrix value="{numbers}"/>', ROOM))
            self.good("render", "alone.xml", *QUIET, *small, "-o", "alone.exr", "--seed", str(3 + 1000000 * frame))
            self.assertEqual(self.picture(f"f_0{frame}.exr"), self.picture("alone.exr"))

    def test_a_part_of_a_sequence_has_the_same_frames(self):
        self.good_render("-o", "a_#.exr")
        self.good_render("-o", "b_#.exr", frames="3-4")
        for frame in (3, 4):
            self.assertEqual(self.channels(f"a_{frame}.exr"), self.channels(f"b_{frame}.exr"))

    def test_motion_leads_to_the_same_point_of_the_frame_before(self):
        self.good_render("-o", "f_#.exr", "--aovs", "--resolution", "64x48", frames="2-3")
        before, after = self.channels("f_2.exr"), self.channels("f_3.exr")
        right = tested = 0
        for y in range(48):
            for x in range(64):
                at = y * 64 + x
                old_x, old_y = x + 0.5 + after["Motion.X"][at], y + 0.5 + after["Motion.Y"][at]
                if not (1 < old_x < 63 and 1 < old_y < 47):
                    continue
                old_depth = after["Depth"][at] + after["Motion.Z"][at]
                depth = before["Depth"][int(old_y) * 64 + int(old_x)]
                tested += 1
                right += abs(depth / old_depth - 1) < 0.03
        self.assertGreater(tested, 2000)
        self.assertGreater(right, 0.9 * tested, "but for edges, the surface there is as far away as the motion says")
        self.assertGreater(max(abs(m) for m in after["Motion.X"]), 2)

    def test_a_scene_for_each_frame(self):
        for frame, shift in ((1, 0), (2, 0.3)):
            matrix = " ".join(str(v) for row in START for v in row).replace("0.5", str(0.5 + shift), 1)
            self.write_text(f"room_{frame}.xml", TO_WORLD.sub(rf'\1<matrix value="{matrix}"/>', ROOM))
        self.good("render", "room_#.xml", *QUIET, *SMALL_WORDS, "--frames", "1-2", "-o", "f_#.exr")
        for frame in (1, 2):
            self.good("render", f"room_{frame}.xml", *QUIET, *SMALL_WORDS, "-o", "alone.exr", "--seed",
                      str(1000000 * frame))
            self.assertEqual(self.picture(f"f_{frame}.exr"), self.picture("alone.exr"))
        self.assertLess(max(abs(m) for m in self.channels("f_1.exr")["Motion.X"]), 1e-3)
        self.assertGreater(max(abs(m) for m in self.channels("f_2.exr")["Motion.X"]), 1)
        result = self.run_covary("render", "room_#.xml", *QUIET, *SMALL_WORDS, "--frames", "2-3", "-o", "g_#.exr")
        self.assertIn("room_3.xml", result.stderr)
        self.assertEqual(result.returncode, 1)
        self.assertFalse((self.path / "g_2.exr").exists(), "found before the first frame is rendered")

    def test_seeds_of_frames(self):
        self.write_path((0, START))
        self.good_render("-o", "own_#.exr", frames="1-2")
        self.assertNotEqual(self.picture("own_1.exr"), self.picture("own_2.exr"))
        self.good_render("-o", "same_#.exr", "--seed", "1000000", frames="1")
        self.assertEqual(self.picture("same_1.exr"), self.picture("own_2.exr"))
        self.assertLess(max(abs(m) for m in self.channels("own_2.exr")["Motion.X"]), 1e-3)

    def test_resume_renders_damaged_frames_again(self):
        self.good_render("-o", "f_#.exr", frames="1-3")
        whole = [(self.path / f"f_{frame}.exr").read_bytes() for frame in (1, 2, 3)]
        middle = len(whole[1]) // 2
        self.write("f_2.exr", whole[1][:middle] + bytes(100) + whole[1][middle + 100:])
        self.write("f_3.exr", b"")
        result = self.render("-o", "f_#.exr", "--resume", frames="1-3")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, "warning: f_2.exr: .*; the frame is rendered again")
        for frame in (1, 2, 3):
            self.assertEqual(read_exr((self.path / f"f_{frame}.exr").read_bytes()), read_exr(whole[frame - 1]), frame)

    def test_resume_renders_what_is_missing(self):
        self.good_render("-o", "f_#.exr")
        whole = {n: (self.path / f"f_{n}.exr").read_bytes() for n in range(1, 5)}
        (self.path / "f_2.exr").unlink()
        times = {n: (self.path / f"f_{n}.exr").stat().st_mtime_ns for n in (1, 3, 4)}
        self.good_render("-o", "f_#.exr", "--resume")
        for n in (1, 3, 4):
            self.assertEqual((self.path / f"f_{n}.exr").stat().st_mtime_ns, times[n])
        self.assertEqual(self.picture("f_2.exr"), [read_exr(whole[2])[c] for c in "RGB"])
        errors = self.render("-o", "f_#.exr", "--resume", "--seed", "9").stderr
        self.assertIn("'f_1.exr' is not a frame of this command (seed 0, now 9); --overwrite instead", errors)

    def difference(self, one, other):
        a, b = self.picture(one), self.picture(other)
        return sum((p - q)**2 / (q**2 + 0.01) for x, y in zip(a, b) for p, q in zip(x, y)) / len(a[0]) / 3

    def test_history_takes_noise_away(self):
        """The camera rests: frames alone differ by their noise, which history takes away."""
        self.write_path((0, START))
        quick = ("--denoise", "auto", "--oidn", "off", "--resolution", "64x48")
        self.good_render("-o", "reference_#.exr", "--resolution", "64x48", "--spp", "1024", frames="9")
        self.good_render("-o", "alone_#.exr", *quick, frames="1-6")
        self.good_render("-o", "on_#.exr", *quick, "--history", "on", frames="1-6")
        self.assertEqual(self.picture("on_1.exr"), self.picture("alone_1.exr"))
        alone = sum(self.difference(f"alone_{n}.exr", "reference_9.exr") for n in (4, 5, 6))
        with_history = sum(self.difference(f"on_{n}.exr", "reference_9.exr") for n in (4, 5, 6))
        self.assertLess(with_history, 0.8 * alone)
        flicker = [sum(self.difference(f"{name}_{n}.exr", f"{name}_{n + 1}.exr") for n in (3, 4, 5))
                   for name in ("alone", "on")]
        self.assertLess(flicker[1], 0.75 * flicker[0])

    def test_history_is_the_same_after_an_interruption(self):
        small = ("--denoise", "auto", "--oidn", "off", "--history", "on")
        self.good_render("-o", "whole_#.exr", *small)
        self.good_render("-o", "parts_#.exr", *small, frames="1-2")
        self.good_render("-o", "parts_#.exr", *small, "--resume")
        for n in range(1, 5):
            self.assertEqual(self.picture(f"whole_{n}.exr"), self.picture(f"parts_{n}.exr"))
        self.good_render("-o", "alone_#.exr", "--denoise", "auto", "--oidn", "off")
        self.assertNotEqual(self.picture("whole_3.exr"), self.picture("alone_3.exr"))
        self.assertIn("'parts_1.exr' is not a frame of this command",
                      self.render("-o", "parts_#.exr", "--resume", "--denoise", "auto", "--oidn", "off").stderr)

    def test_parts_with_histories_of_their_own_are_no_whole(self):
        quick = ("--denoise", "auto", "--oidn", "off", "--history", "on")
        for frames in ("1-2", "3"):
            self.good_render("-o", "f_#.exr", *quick, frames=frames)
        errors = self.render("-o", "f_#.exr", *quick, "--resume", frames="1-3").stderr
        self.assertIn("'f_3.exr' is not a frame of this command (another previous frame: it was rendered with another "
                      "range of --frames)", errors)

    def test_interrupted(self):
        command = [COVARY, "render", "room.xml", *QUIET, "--resolution", "160x120", "--spp", "64", "--camera-path",
                   "path.json", "--frames", "1-400", "-o", "f_###.exr", "--denoise", "none"]
        process = subprocess.Popen(command, cwd=self.path, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        end = time.monotonic() + 300 * SLOWDOWN
        while not (self.path / "f_002.exr").exists():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        errors = process.communicate(timeout=60 * SLOWDOWN)[1]
        self.assertEqual(process.returncode, 130, errors)
        self.assertRegex(errors, r"interrupted in frame \d+: \d+ of 400 frames are complete; the same command")
        for n in (1, 2):
            attributes = json.loads(self.good("info", f"f_00{n}.exr", "--json").stdout)["attributes"]
            self.assertEqual(attributes["covary:complete"], "true")

    def test_what_an_interruption_left_is_found_before_the_first_frame(self):
        command = ("-o", "f_#.exr", "--spp", "1", "--denoise", "auto", "--oidn", "off")
        self.good_render(*command, frames="1-2")
        (self.path / "f_2.passes").mkdir()
        (self.path / "f_1.exr").rename(self.path / "f_2.passes" / "independent.exr")
        result = self.render(*command, frames="1-2")
        self.assertEqual(result.returncode, 1)
        self.assertIn("'f_2.passes/independent.exr' already exists, in the folder for the films", result.stderr)
        self.assertFalse((self.path / "f_1.exr").exists())

    def test_a_sample_of_a_frame_is_repeated(self):
        self.good_render("-o", "f_#.exr", "--spp", "1", frames="3")
        channels = self.channels("f_3.exr")
        printed = self.good_render("--spp", "1", "--replay", "5,7,0", frames="3").stdout
        values = [float(v) for v in re.search(r"radiance \((.*)\)", printed)[1].split(", ")]
        for value, channel in zip(values, "RGB"):
            self.assertAlmostEqual(value, channels[channel][7 * 32 + 5], 6)
        self.assertIn("--replay needs a single frame", self.render("--replay", "5,7,0").stderr)

    def test_wrong_input(self):
        for arguments, message in (
                (("-o", "f.exr"), "-o 'f.exr': with --frames, expected a name with '#'"),
                (("-o", "f_#.exr", "--json", "f.json"), "--json 'f.json': with --frames, expected a name with '#'"),
                (("-o", "f_#.exr", "--save-training", "t"), "--save-training is an option of single images")):
            result = self.render(*arguments)
            self.assertEqual(result.returncode, 2)
            self.assertIn(message, result.stderr)
        self.assertIn("--history is for frames with --denoise",
                      self.render("-o", "f_#.exr", "--history", "on", "--denoise", "none").stderr)
        self.assertIn("--frames '4-1': expected FIRST-LAST", self.render("-o", "f_#.exr", frames="4-1").stderr)
        alone = self.run_covary("render", "room.xml", "-o", "f.exr", "--camera-path", "path.json")
        self.assertIn("--camera-path has no effect without --frames", alone.stderr)
        self.write_text("path.json", '{"keyframes": [{"time": 0, "to_world": [2]}]}')
        self.assertIn("camera path 'path.json': keyframe 0: 'to_world' is not a", self.render("-o", "f_#.exr").stderr)
        scaled = [[2 * v for v in row[:3]] + row[3:] for row in START]
        scaled[3] = [0, 0, 0, 1]
        self.write_path((0, scaled))
        self.assertIn("the to_world transformation of a sensor must not scale", self.render("-o", "f_#.exr").stderr)
        self.assertEqual(list(self.path.glob("f_*")), [])


ANIMATED = """<shape type="cube"><animation name="to_world">
<transform time="0.5"><scale value="0.3"/><translate x="-0.5" y="0.3" z="0.8"/></transform>
<transform time="2"><scale value="0.3"/><rotate y="1" angle="50"/><translate x="0.4" y="0.3" z="0.8"/></transform>
</animation></shape>"""
RESTING = re.sub(r'<animation name="to_world">.*time="2">(.*)</animation>',
                 r'<transform name="to_world">\1', ANIMATED, flags=re.DOTALL)


class Told(SequenceTest):
    def test_cameras_that_mirror(self):
        mirrored = [[-row[0], *row[1:]] for row in START]
        for start, told in ((START, False), (mirrored, True)):
            self.write_path((1, start), (4, start))
            said = self.good_render("-o", "m_#.exr", "--overwrite", frames="1").stderr
            self.assertEqual("warning: path.json: its cameras mirror the picture; x points to the left" in said, told)

    def test_a_path_beside_the_frames_is_told(self):
        """The rate of a video, say, where the path's times count frames."""
        self.write_path((1, START), (3, END))
        told = "warning: path.json: the camera stands still: the frames are at times 0.125 to 0.375"
        self.assertIn(told, self.render("-o", "f_#.exr", "--fps", "8", frames="1-3").stderr)
        self.assertNotIn("stands still", self.render("-o", "g_#.exr", frames="1-3").stderr)

    def test_one_frame_has_no_history(self):
        words = ("render", "room.xml", "--camera-path", "path.json", "--no-preview", "--resolution", "32x24", "--spp",
                 "4", "--oidn", "off", "--history", "on", "-o", "h_#.exr", "--frames")
        note = "note: the first frame of a command has no history, and --frames 2 has no other\n"
        self.assertIn(note, self.good(*words, "2").stderr)
        self.assertNotIn("has no history", self.good(*words, "1-2", "--overwrite").stderr)


class Animation(SequenceTest):
    """Shapes and a camera that move by the scene's <animation>."""

    def setUp(self):
        super().setUp()
        self.write_text("moving.xml", ROOM.replace("</scene>", ANIMATED + "</scene>"))

    def frames(self, *arguments, good=True):
        result = self.render_small("moving.xml", *arguments)
        self.assertEqual(result.returncode == 0, good, result.stderr)
        return result

    def test_frames_are_images_of_scenes_at_rest(self):
        self.write_text("resting.xml", ROOM.replace("</scene>", RESTING + "</scene>"))
        self.frames("--frames", "1-4", "--fps", "2", "-o", "f_#.exr")
        self.good("render", "resting.xml", *QUIET, *SMALL_WORDS, "--seed", "4000000", "-o", "alone.exr")
        self.assertEqual(self.picture("f_4.exr"), self.picture("alone.exr"), "frame 4 is at the time 2")
        self.assertNotEqual(self.picture("f_3.exr"), self.picture("f_4.exr"))
        self.frames("--frames", "4", "--fps", "2", "-o", "g_#.exr")
        self.assertEqual(self.channels("f_4.exr"), self.channels("g_4.exr"))
        printed = self.frames("--frames", "4", "--fps", "2", "--spp", "1", "--replay", "15,15,0").stdout
        self.frames("--frames", "4", "--fps", "2", "--spp", "1", "-o", "one_#.exr")
        values = [float(v) for v in re.search(r"radiance \((.*)\)", printed)[1].split(", ")]
        for value, channel in zip(values, "RGB"):
            self.assertAlmostEqual(value, self.channels("one_4.exr")[channel][15 * 32 + 15], 6)
        for fps in (("--fps", "3"), ()):
            self.assertIn("'f_4.exr' is not a frame of this command",
                          self.frames("--frames", "4", *fps, "-o", "f_#.exr", "--resume", good=False).stderr)
        self.frames("--frames", "1-4", "--fps", "2", "-o", "f_#.exr", "--resume")

    def test_motion_leads_to_the_same_point_of_a_shape(self):
        """Warping: where Motion leads to in the frame before, the box was as far away as Motion says."""
        size = ("--resolution", "128x96", "--spp", "1")
        self.frames("--frames", "1-2", "--fps", "2", *size, "--aovs", "-o", "f_#.exr")
        before, after = self.channels("f_1.exr"), self.channels("f_2.exr")
        moved = right = 0
        for y in range(96):
            for x in range(128):
                at = y * 128 + x
                motion = [after[f"Motion.{c}"][at] for c in "XYZ"]
                old_x, old_y = int(x + 0.5 + motion[0]), int(y + 0.5 + motion[1])
                if abs(motion[0]) < 0.5 or not (0 <= old_x < 128 and 0 <= old_y < 96):
                    continue
                moved += 1
                depth = before["Depth"][old_y * 128 + old_x]
                right += abs(depth / (after["Depth"][at] + motion[2]) - 1) < 0.03
        self.assertGreater(moved, 300, "the box")
        self.assertLess(moved, 0.3 * 128 * 96, "not what rests")
        self.assertGreater(right, 0.9 * moved)

    def test_the_camera_of_the_scene_moves(self):
        keys = "".join(f'<transform time="{time}"><matrix value="{" ".join(str(v) for row in matrix for v in row)}"/>'
                       "</transform>" for time, matrix in ((1, START), (4, END)))
        sensor = re.compile(r'<transform name="to_world">\s*<lookat[^>]*/>\s*</transform>')
        self.write_text("moving.xml", sensor.sub(f'<animation name="to_world">{keys}</animation>', ROOM, count=1))
        self.frames("--frames", "2-3", "-o", "f_#.exr")
        self.good_render("-o", "path_#.exr", frames="2-3")
        self.assertEqual(self.channels("f_3.exr"), self.channels("path_3.exr"))

    def test_an_open_shutter_is_an_error(self):
        text = (self.path / "moving.xml").read_text()
        self.write_text("moving.xml", text.replace('<sensor type="perspective">', '<sensor type="perspective">'
                                                   '<float name="shutter_close" value="1"/>'))
        self.assertIn("motion is not blurred", self.frames("--frames", "1-2", "-o", "f_#.exr", good=False).stderr)


class GltfAnimation(SequenceTest):
    """A file whose square moves by itself, to the right by a tenth of its side a second; times are in seconds."""

    def setUp(self):
        super().setUp()
        numbers = [-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0, 0, 2, 0, 0, 0, 0.4, 0, 0]
        data = struct.pack("<20f6H", *numbers, 1, 2, 0, 1, 3, 2)
        parts = ((0, 48, 5126, "VEC3", 4), (48, 8, 5126, "SCALAR", 2), (56, 24, 5126, "VEC3", 2),
                 (80, 12, 5123, "SCALAR", 6))
        self.write_text("moving.gltf", json.dumps({
            "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 3}]}],
            "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                            "samplers": [{"input": 1, "output": 2}]}],
            "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64,"
                         + base64.b64encode(data).decode()}],
            "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": n} for at, n, *_ in parts],
            "accessors": [{"bufferView": i, "componentType": component, "type": kind, "count": count}
                          for i, (_, _, component, kind, count) in enumerate(parts)]}))

    def place(self, name):
        """Mean column of the square, in pixels, and its width."""
        depth = self.channels(name)["Depth"]
        columns = [i % 32 for i, value in enumerate(depth) if 0 < value < 1e6]
        return sum(columns) / len(columns), max(columns) - min(columns) + 1

    def test_frames_are_times_of_the_file(self):
        view = ("--environment", "white")
        result = self.run_covary("render", "moving.gltf", "--no-preview", *SMALL_WORDS, *view, "--frames", "0-48:24",
                                 "-o", "f_##.exr")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr.count("has no camera"), 1, "the camera stays where it was for the first frame")
        (first, width), (second, _), (third, _) = (self.place(f"f_{n}.exr") for n in ("00", "24", "48"))
        self.assertAlmostEqual(second - first, 0.1 * width, delta=0.7)
        self.assertAlmostEqual(third - first, 0.2 * width, delta=0.7)
        self.good("render", "moving.gltf", *QUIET, *SMALL_WORDS, *view, "--frames", "2", "--fps", "2", "-o", "g_#.exr")
        self.assertNotEqual(self.picture("g_2.exr"), self.picture("f_00.exr"))

    def test_frames_of_other_commands_are_seen_from_the_same_place(self):
        """Of a file without a camera: where a farm's commands begin does not matter."""
        words = ("render", "moving.gltf", *QUIET, *SMALL_WORDS, "--environment", "white")
        self.good(*words, "--frames", "0-48:24", "-o", "a_##.exr")
        self.good(*words, "--frames", "24-48:24", "-o", "b_##.exr")
        self.assertEqual(self.place("a_48.exr"), self.place("b_48.exr"))
        self.good(*words, "--camera", "auto", "--frames", "48", "-o", "a_##.exr", "--resume")

    def test_the_usual_camera_by_name_is_the_same(self):
        words = ("render", "moving.gltf", *QUIET, *SMALL_WORDS, "-o", "a.exr")
        self.good(*words)
        self.good(*words, "--camera", "auto", "--environment", "studio")
        result = self.run_covary(*words, "--environment", "sky")
        self.assertIn("other settings (camera auto, now default; environment studio, now sky)", result.stderr)


class Denoise(SequenceTest):
    """`covary denoise` of frames of any renderer, whose motion is a layer of them."""

    def setUp(self):
        super().setUp()
        for name in ("a", "b"):
            self.good_render("-o", f"{name}_#.exr", "--spp", "4", "--seed", str(ord(name)), frames="1-3")

    def denoise(self, *arguments):
        return self.run_covary("denoise", *arguments, "--oidn", "off", "--mode", "auto")

    def test_frames_of_two_seeds(self):
        result = self.denoise("a_#.exr", "b_#.exr", "-o", "d_#.exr")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.denoise("a_#.exr", "b_#.exr", "-o", "alone_#.exr", "--no-history").returncode, 0)
        self.assertEqual(self.denoise("a_2.exr", "b_2.exr", "-o", "single.exr").returncode, 0)
        self.assertEqual(self.picture("d_1.exr"), self.picture("alone_1.exr"))
        self.assertNotEqual(self.picture("d_2.exr"), self.picture("alone_2.exr"))
        self.assertEqual(self.picture("alone_2.exr"), self.picture("single.exr"))
        self.assertEqual(len(list(self.path.glob("d_*.exr"))), 3)
        self.assertEqual(self.denoise("a_#.exr", "b_#.exr", "-o", "e_#.exr", "--frames", "2-3").returncode, 0)
        self.assertEqual(self.picture("e_2.exr"), self.picture("alone_2.exr"))

    def assert_same_frames(self, one, other):
        for n in (1, 2, 3):
            self.assertEqual(self.picture(f"{one}_{n}.exr"), self.picture(f"{other}_{n}.exr"), n)

    def test_resume_makes_frames_again_that_had_no_history(self):
        inputs = ("a_#.exr", "b_#.exr", "-o")
        self.assertEqual(self.denoise(*inputs, "whole_#.exr").returncode, 0)
        for frame in ("1", "3"):
            self.assertEqual(self.denoise(*inputs, "part_#.exr", "--frames", frame).returncode, 0)
        said = self.denoise(*inputs, "part_#.exr", "--resume").stderr
        self.assertIn("'part_3.exr' was made without the frame before, which was missing; it is made again", said)
        self.assert_same_frames("part", "whole")
        self.assertIn("0 frames in", self.denoise(*inputs, "part_#.exr", "--resume").stderr)

    def test_frames_that_a_farm_ends_out_of_order_have_their_history(self):
        inputs = ("a_#.exr", "b_#.exr", "-o")
        self.assertEqual(self.denoise(*inputs, "all_#.exr").returncode, 0)
        hidden = self.path / "hidden.exr"
        (self.path / "a_1.exr").rename(hidden)
        command = [COVARY, "denoise", *inputs, "watched_#.exr", "--oidn", "off", "--watch", "--frames", "1-3"]
        process = subprocess.Popen(command, cwd=self.path, stderr=subprocess.DEVNULL)
        try:
            time.sleep(4)  # 2 and 3 would be taken by now
            hidden.rename(self.path / "a_1.exr")
            self.assertEqual(process.wait(120), 0)
        finally:
            process.kill()
        self.assert_same_frames("watched", "all")

    def test_resume_makes_damaged_frames_again(self):
        inputs = ("a_#.exr", "b_#.exr", "-o")
        self.assertEqual(self.denoise(*inputs, "whole_#.exr").returncode, 0)
        self.assertEqual(self.denoise(*inputs, "part_#.exr").returncode, 0)
        (self.path / "part_1.exr").write_bytes(b"")
        whole = (self.path / "part_3.exr").read_bytes()
        (self.path / "part_3.exr").write_bytes(whole[:len(whole) // 2])
        said = self.denoise(*inputs, "part_#.exr", "--resume")
        self.assertEqual(said.returncode, 0, said.stderr)
        for name in ("part_1.exr", "part_3.exr"):
            self.assertRegex(said.stderr, rf"(?m)^warning: {name}: .*; it is made again$")
        self.assert_same_frames("part", "whole")
        (self.path / "part_2.exr").write_text("of somebody else")
        said = self.denoise(*inputs, "part_#.exr", "--resume")
        self.assertEqual((said.returncode, (self.path / "part_2.exr").read_text()), (1, "of somebody else"))

    def test_resume_refuses_frames_of_other_settings(self):
        inputs = ("denoise", "a_#.exr", "b_#.exr", "-o", "d_#.exr", "--oidn", "off", "--frames", "1-2")
        self.good(*inputs)
        before = self.picture("d_1.exr")
        self.bad(1, "--resume: 'd_1.exr' was made by 'mixture --denoise auto --oidn off', and not by 'mixture "
                 "--denoise bias --oidn off'; --overwrite instead of --resume replaces it", *inputs, "--mode", "bias",
                 "--resume")
        self.good(*inputs, "--mode", "bias", "--overwrite")
        self.assertNotEqual(self.picture("d_1.exr"), before)

    def test_own_motion_is_trusted(self):
        """A fast pan and few samples: noise decides which motion fits."""
        self.write_path((1, START), (3, END))
        for name in "mn":
            self.good_render("-o", f"{name}_#.exr", "--spp", "1", "--resolution", "64x48", "--seed", str(ord(name)),
                             frames="1-3")
        done = self.denoise("m_#.exr", "n_#.exr", "-o", "p_#.exr")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("covary:history", (self.path / "p_3.exr").read_bytes().decode("latin-1"))

    def test_resume_leaves_out_frames_of_interrupted_renders(self):
        for n in (1, 2, 3):
            for seed, name in enumerate("ab"):
                complete = "false" if (name, n) == ("a", 2) else "true"
                (self.path / f"{name}_{n}.exr").write_bytes(
                    film(10 * n + seed, 1, (12, 9), value=seed + 1, sampling="independent", complete=complete))
        said = self.denoise("a_#.exr", "b_#.exr", "-o", "d_#.exr", "--resume", "--force")
        self.assertEqual(said.returncode, 1)
        self.assertIn("1 of 3 frames incomplete: 2", said.stderr)
        self.assertEqual({p.name for p in self.path.glob("d_*.exr")}, {"d_1.exr", "d_3.exr"})

    def test_wrong_motion_and_seeds_are_found(self):
        wrong = self.denoise("a_#.exr", "b_#.exr", "-o", "d_#.exr", "--motion-scale=-1,-1")
        self.assertEqual(wrong.returncode, 1)
        self.assertIn("'a_2.exr': its motion does not match 'a_1.exr'", wrong.stderr)
        for frame, seed in (("1", 1000000), ("2", 0)):
            self.good_render("-o", "c_#.exr", "--seed", str(seed), frames=frame)
            self.good_render("-o", "d_#.exr", "--seed", str(seed + 5), "--overwrite", frames=frame)
        self.assertIn("'c_1.exr' and 'c_2.exr' have the same seed, 2000000",
                      self.denoise("c_#.exr", "d_#.exr", "-o", "o_#.exr").stderr)

    def test_wrong_input(self):
        for arguments, message in (
                (("a_#.exr", "b_1.exr", "-o", "d_#.exr"), "'b_1.exr' has no '#'"),
                (("a_#.exr", "b_#.exr", "-o", "d.exr"), "-o 'd.exr': for frames, expected a name such as"),
                (("a_#.exr", "b_#.exr", "-o", "d_#.exr", "--frames", "3-1"), "--frames '3-1': expected FIRST-LAST"),
                (("a_#.exr", "b_#.exr", "-o", "d_#.exr", "--motion-scale", "1"), "--motion-scale '1': expected X,Y"),
                (("a_1.exr", "b_1.exr", "-o", "d.exr", "--frames", "1"), "--frames: the input has no '#'"),
                (("none_#.exr", "b_#.exr", "-o", "d_#.exr"), "there are no frames 'none_#.exr'"),
                (("a_#.exr", "b_#.exr", "-o", "d_#.exr", "--motion", "Vector"), "no layer 'Vector' of motion")):
            result = self.denoise(*arguments)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(message, result.stderr)


class Combine(SequenceTest):
    """`covary combine` of frames, here of the passes that renders keep in a folder for each frame."""

    def setUp(self):
        super().setUp()
        self.good_render("-o", "o_#.exr", "--passes", "p_#", "--spp", "16", "--estimator", "iicv", "--aovs",
                         frames="1-3")

    def combine(self, *arguments):
        return self.run_covary("combine", "--crn", "p_#/crn.exr", "--independent", "p_#/independent.exr", "--quiet",
                               *arguments)

    def good_combine(self, *arguments):
        result = self.combine(*arguments)
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_frames(self):
        self.good_combine("-o", "c_#.exr", "--json", "c_#.json")
        for frame in range(1, 4):
            self.good("combine", "--crn", f"p_{frame}/crn.exr", "--independent", f"p_{frame}/independent.exr", "-o",
                      "alone.exr", "--quiet")
            self.assertEqual(self.picture(f"c_{frame}.exr"), self.picture("alone.exr"))
            self.assertEqual(json.loads((self.path / f"c_{frame}.json").read_text())["output"], f"c_{frame}.exr")

    def test_history(self):
        denoised = ("--denoise", "auto", "--oidn", "off", "--features", "o_#.exr")
        self.good_combine("-o", "on_#.exr", *denoised)
        self.good_combine("-o", "alone_#.exr", *denoised, "--no-history")
        self.good_combine("-o", "part_#.exr", *denoised, "--frames", "2-3")
        self.assertEqual(self.picture("on_1.exr"), self.picture("alone_1.exr"))
        self.assertEqual(self.picture("part_2.exr"), self.picture("alone_2.exr"))
        for frame in (2, 3):
            self.assertNotEqual(self.picture(f"on_{frame}.exr"), self.picture(f"alone_{frame}.exr"))
        wrong = self.combine("-o", "d_#.exr", *denoised, "--motion-scale=-1,-1").stderr
        self.assertIn("its motion does not match", wrong)
        self.assertIn("multiplied by -1,-1 (--motion-scale) it fits better", wrong)

    def test_wrong_input(self):
        (self.path / "a#").mkdir()
        (self.path / "a#" / "crn.exr").write_bytes((self.path / "p_1/crn.exr").read_bytes())
        for arguments, message in ((("-o", "c.exr"), "-o 'c.exr': for frames, expected a name such as"),
                                   (("-o", "c_#.exr", "--json", "c.json"), "--json 'c.json': of frames, expected"),
                                   (("-o", "c_#.exr", "--save-stages", "s"), "--save-stages is an option of single"),
                                   (("-o", "c_#.exr", "--crn", "a#/crn.exr"), "'a#/crn.exr' has no '#' for"),
                                   (("-o", "c_#.exr", "--denoise", "auto", "--motion", "Flow"),
                                    "no layer 'Flow' of motion")):
            result = self.combine(*arguments)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(message, result.stderr)


if __name__ == "__main__":
    import unittest
    unittest.main()
