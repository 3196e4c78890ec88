# SPDX-License-Identifier: Apache-2.0
"""The program where the world is odd: streams closed or full, files that are not what they were taken for, names and
folders that nothing can be written to, environments that lack what others have."""
import os
import resource
import subprocess
import unittest

from cli_test import COVARY, SLOWDOWN, CliTest
from exr_writer import film
from numeric_options_test import SCENE

RENDER = ("render", "scene.xml", "--spp", "8", "--estimator", "none", "--no-preview")


class OddTest(CliTest):
    def setUp(self):
        super().setUp()
        self.write("scene.xml", SCENE)
        self.write("a.exr", film(1, groups=3, size=(5, 4), samples=6))

    def shell(self, command, **more):
        return subprocess.run(["bash", "-c", command, COVARY], cwd=self.path, capture_output=True, text=True,
                              timeout=60 * SLOWDOWN, **more)


class Streams(OddTest):
    def test_closed_ones_get_into_no_file(self):
        """A file that is opened while a standard stream is closed would get its number, and messages with it."""
        self.good(*RENDER, "-o", "expected.exr", "--quiet")
        for closed in ("2>&-", "<&-", "<&- 2>&-", "<&- >/dev/null 2>&-"):
            with self.subTest(closed):
                result = self.shell(f'"$0" {" ".join(RENDER)} --json film.json -o film.exr --overwrite {closed}')
                self.assertEqual(result.returncode, 0, result.stderr)
                self.good("compare", "film.exr", "--reference", "expected.exr")
                self.assertTrue((self.path / "film.json").read_text().startswith("{"))

    def test_output_that_cannot_be_written(self):
        for command in ("info a.exr", "compare a.exr --reference a.exr", "--help", "render --help", "--version", ""):
            for output in (">/dev/full", ">&-"):
                with self.subTest(command + output):
                    result = self.shell(f'"$0" {command} {output}')
                    self.assertEqual(result.returncode, 1, result.stderr)
                    self.assertIn("covary: cannot write to standard output", result.stderr)


class Outputs(OddTest):
    def fails_before_rendering(self, message, name, **more):
        result = self.run_covary(*RENDER, "-o", name, "--checkpoint", "0", **more)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn(message, result.stderr)
        self.assertNotIn("samples/s", result.stderr + result.stdout)
        self.assertNotIn("could not be kept", result.stderr)

    def test_names_that_are_too_long(self):
        self.fails_before_rendering("File name too long", 252 * "a" + ".exr")
        self.good(*RENDER, "-o", 251 * "a" + ".exr")

    def test_folders_that_take_no_file(self):
        if os.path.isdir("/proc"):
            self.fails_before_rendering("cannot write /proc/film.exr: ", "/proc/film.exr")

    def test_a_folder_that_is_gone(self):
        result = self.shell(f'mkdir gone && cd gone && rmdir ../gone && "$0" {" ".join(RENDER)} -o x.exr'
                            .replace("scene.xml", str(self.path / "scene.xml")))
        self.assertEqual(result.returncode, 1)
        self.assertIn("cannot write x.exr: No such file or directory", result.stderr)
        self.assertNotIn("could not be kept", result.stderr)

    def test_files_taken_for_scenes(self):
        self.bad(1, "a.exr:1:1: the file is an EXR image; expected a scene in XML", "render", "a.exr", "-o", "o.exr")
        self.write("mesh.ply", b"ply\nformat ascii 1.0\n")
        self.bad(1, "mesh.ply:1:1: the file is a mesh; expected", "render", "mesh.ply", "-o", "o.exr")
        self.write("suite.json", b' {"name": "x"}')
        self.bad(1, "suite.json:1:1: the file is JSON; expected", "render", "suite.json", "-o", "o.exr")

    def test_names_of_nothing(self):
        self.bad(1, "cannot read '': No such file", "info", "")
        self.bad(1, "cannot read '': No such file", "compare", "", "--reference", "a.exr")
        self.bad(2, "unknown option '-x'; see 'covary render --help'", *RENDER, "-x", "1")


class Environment(OddTest):
    def test_no_folder_for_temporary_files(self):
        environment = {**os.environ, "TMPDIR": "/no/such/folder"}
        self.bad(1, "cannot make a page in /no/such/folder (No such file or directory)", "view", "a.exr",
                 env=environment)

    def test_an_empty_one(self):
        self.good(*RENDER, "-o", "o.exr", "--quiet", env={})

    def test_textures_without_openimageio(self):
        """PNG, JPEG, HDR; the loader tells which libraries are opened."""
        self.good(*RENDER[:-1], "-o", "o.exr", "--quiet")
        for name in ("t.png", "t.jpg", "t.hdr", "t.tif"):
            self.good("convert", "o.exr", name)
            self.write("scene.xml", SCENE.replace(b'<rgb name="radiance" value="1"/>', b"""
                <texture type="bitmap" name="radiance"><string name="filename" value="%s"/></texture>"""
                                                  % name.encode()))
            result = self.good(*RENDER, "-o", "t.exr", "--overwrite", env={**os.environ, "LD_DEBUG": "files"})
            self.assertIn("file=libembree", result.stderr)
            self.assertEqual("file=libOpenImageIO" in result.stderr, name == "t.tif", name)

    def test_too_little_memory_for_the_ray_tracer(self):
        if SLOWDOWN > 1:
            return  # sanitizers reserve more than any limit
        kept = resource.RLIMIT_AS
        for megabytes in (120, 160, 220, 300, 420):
            with self.subTest(megabytes):
                result = self.run_covary(*RENDER, "-o", "o.exr", "--overwrite", "--quiet", "--threads", "2",
                                         preexec_fn=lambda: resource.setrlimit(kept, (megabytes << 20,) * 2))
                self.assertIn(result.returncode, (0, 1), result.stderr)


if __name__ == "__main__":
    unittest.main()
