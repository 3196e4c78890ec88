# SPDX-License-Identifier: Apache-2.0
"""The add-on of Blender. Pack and Program need no Blender; Blender runs the program of that name without a window (the
package bpy where BLENDER names a Python), Window with one, and COVARY names the program that combines."""
import os
import subprocess
import sys
import tempfile
import types
import unittest
import zipfile
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("COVARY", "covary"))


class AddonTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def wheel(self, **texts):
        """Of a package covary with these texts in place of its files."""
        path = self.path / "covary-0.1.0-cp310-abi3-manylinux_2_35_x86_64.whl"
        with zipfile.ZipFile(path, "w") as archive:
            for name in ("covary/bin/covary", "covary/lib/libcovary.so.0", "covary.libs/libtbb.so", "covary/film.py",
                         "covary/_covary.abi3.so", "covary-0.1.0.dist-info/METADATA"):
                archive.writestr(name, texts.get(Path(name).name, name))
        return path

    def pack(self, *wheel):
        run = subprocess.run([SOURCE / "scripts" / "blender_addon", *wheel, self.path / "covary.zip"], check=False,
                             capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        return self.path / "covary.zip"


class Pack(AddonTest):
    def test_holds_nothing_compiled_for_a_python(self):
        names = zipfile.ZipFile(self.pack()).namelist()
        self.assertIn("covary_addon/_cycles.py", names)
        self.assertEqual({Path(name).suffix for name in names}, {".py", ".toml", ""})
        self.assertEqual({name.split("/")[0] for name in names}, {"covary_addon"})

    def test_program_of_a_wheel(self):
        names = zipfile.ZipFile(self.pack(self.wheel())).namelist()
        self.assertEqual(sorted(name.removeprefix("covary_addon/program/") for name in names if "/program/" in name),
                         ["covary.libs/libtbb.so", "covary/bin/covary", "covary/lib/libcovary.so.0"])

    def test_one_version(self):
        """That of CMakeLists.txt, for old Blenders and new ones."""
        archive = zipfile.ZipFile(self.pack())
        self.assertIn('\nversion = "0.2.0"\n', archive.read("covary_addon/blender_manifest.toml").decode())
        self.assertIn('"version": (0, 2, 0)', archive.read("covary_addon/__init__.py").decode())

    def test_other_files(self):
        for words in ([], ["a.whl", "b.zip"], ["covary-1.tar.gz", "b.zip"]):
            run = subprocess.run([SOURCE / "scripts" / "blender_addon", *words], capture_output=True, text=True,
                                 check=False)
            self.assertEqual(run.returncode, 1)
            self.assertIn("wheel of", run.stderr)


class Program(AddonTest):
    """The modules of the add-on that need no Blender."""

    def setUp(self):
        super().setUp()
        zipfile.ZipFile(self.pack()).extractall(self.path)
        package = types.ModuleType("covary_addon")
        package.__path__ = [str(self.path / "covary_addon")]
        sys.modules["covary_addon"] = package
        from covary_addon import _cycles, errors, program
        self.cycles, self.program, self.UsageError = _cycles, program, errors.UsageError
        self.addCleanup(lambda: [sys.modules.pop(name) for name in [*sys.modules] if name.startswith("covary_addon")])

    def executable(self, name, text):
        path = self.path / name
        path.write_text(text)
        path.chmod(0o755)
        return path

    def message_of(self, function, *arguments):
        with self.assertRaises(self.UsageError) as raised:
            function(*arguments)
        return str(raised.exception)

    def test_found_by_preference_own_copy_or_path(self):
        found, own = self.executable("covary", ""), self.path / "own"
        path, os.environ["PATH"] = os.environ["PATH"], str(self.path)
        try:
            self.assertEqual(self.program.find("", own), found)
            own.write_text("")
            own.chmod(0o644)
            self.assertEqual(self.program.find("", own), own)
            self.assertTrue(os.access(own, os.X_OK))  # unpacking does not make it so
            self.assertEqual(self.program.find(str(found), own), found)
            self.assertIn("'nothing', which the add-on's preferences name",
                          self.message_of(self.program.find, "nothing", own))
            own.unlink(), found.unlink()
            self.assertIn("name it in the add-on's preferences", self.message_of(self.program.find, "", own))
        finally:
            os.environ["PATH"] = path

    def test_one_that_does_not_run(self):
        self.assertEqual(self.program.check(self.executable("a", "#!/bin/sh\necho covary 0.1.0 '(abc)'\n")), "0.1.0")
        for text, expected in (("#!/bin/sh\necho liba.so: cannot >&2\nexit 127", "does not run: liba.so: cannot"),
                               ("no program", "does not run")):
            self.assertIn(expected, self.message_of(self.program.check, self.executable("b", text)))

    def test_seeds_occur_once(self):
        seeds = [group.seed for seed in (0, 1) for group in self.cycles.groups_of(96, 12, seed)]
        self.assertEqual(len(set(seeds)), 48)
        self.assertEqual({group.samples for group in self.cycles.groups_of(96, 12, 0)}, {4})
        alone = [group for seed in (0, 1) for group in self.cycles.groups_of(96, 12, seed, self.cycles.INDEPENDENT)]
        self.assertEqual(len({group.seed for group in alone}), 24)
        self.assertEqual({(group.kind, group.samples, group.features) for group in alone}, {("independent", 8, True)})

    def test_error_and_time_on_the_way(self):
        self.assertEqual(self.program.read_error('{"image": "b.exr", "relmse": 0.06}', 3), 0.01)
        for printed in ("", "{}", '{"relmse": null}'):
            self.assertIsNone(self.program.read_error(printed, 3))
        self.assertEqual([self.program.remaining(seconds) for seconds in (-1, 75, 4000)],
                         ["0:00 left", "1:15 left", "1:06:40 left"])

    def test_says_where_nothing_is_gained(self):
        """Half of the samples have twice the error of all."""
        file = self.path / "statistics.json"
        for theirs, expected in ((0.005, "would have 0.0025."), (0.0025, "little is gained"), (0.001, "nothing is")):
            file.write_text('{"predicted_relmse": 0.001, "independent_predicted_relmse": %g}' % theirs)
            self.assertIn(expected, self.program.verdict(str(file)))
        file.write_text('{"predicted_relmse": 0.001, "risks": {"mean": 0.005}}')
        self.assertIn("would have 0.005.", self.program.verdict(str(file)), "all samples are independent")
        file.write_text("{}")
        self.assertEqual(self.program.verdict(str(file)), "")


class InBlender(AddonTest):
    #: What starts Blender where it is no package of Python.
    start = ("--background",)
    before: tuple = ()

    def run_case(self, case, *wheel, **environment):
        blender = os.environ["BLENDER"]
        script = [str(SOURCE / "tests" / "blender" / "in_blender.py")]
        start = script if "python" in Path(blender).name else [
            *self.start, "--factory-startup", "--python-exit-code", "3", "--python", *script, "--"]
        output = self.path / "output"
        output.mkdir()
        environment = {**os.environ, "PATH": f"{PROGRAM.parent}:{os.environ['PATH']}", **environment,
                       "PYTHONDONTWRITEBYTECODE": "1", "BLENDER_USER_RESOURCES": str(self.path / "user"),
                       "BLENDER_USER_SCRIPTS": str(self.path / "user"), "BLENDER_USER_CONFIG": str(self.path / "user")}
        run = subprocess.run([*self.before, blender, *start, case, self.pack(*wheel), output], env=environment,
                             check=False, capture_output=True, text=True)
        messages = run.stdout + run.stderr
        self.assertEqual(run.returncode, 0, messages)
        self.assertIn("as it must be", messages)
        self.assertNotIn("Traceback", messages)


class Blender(InBlender):
    """Installed into a Blender without a window, and used."""

    def test_picture(self):
        self.run_case("picture")

    def test_plain_worlds(self):
        self.run_case("plain_worlds")

    def test_animation(self):
        self.run_case("animation")

    def test_refused(self):
        self.run_case("refused")

    def test_missing_program(self):
        self.run_case("missing_program", PATH="/usr/bin:/bin")

    def test_own_program(self):
        """That of a wheel; nothing else of the wheel is in the add-on."""
        self.run_case("plain_worlds", self.wheel(covary=PROGRAM.read_bytes()), PATH="/usr/bin:/bin")

    def test_disabled(self):
        self.run_case("disabled")


class Window(InBlender):
    """In a window, on a display that nobody sees (xvfb-run)."""

    start = ("--window-geometry", "0", "0", "1000", "700")
    before = ("xvfb-run", "--auto-servernum", "--server-args", "-screen 0 1000x700x24")

    def test_alive_shown_and_cancelled(self):
        self.run_case("window")


if __name__ == "__main__":
    unittest.main()
