# SPDX-License-Identifier: Apache-2.0
"""The installed library: docs/examples/library is built outside the tree and gives the numbers of the program."""
import array
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CMAKE, BUILD, SOURCE = os.environ["CMAKE"], Path(os.environ["BUILD"]), Path(os.environ["SOURCE"])
CXX, VERSION = os.environ["CXX"], os.environ["VERSION"]
EXAMPLES = SOURCE / "docs" / "examples" / "library"
ROOM = SOURCE / "scenes" / "room.xml"
GROUPS = 12

sys.dont_write_bytecode = True
sys.path.insert(0, str(SOURCE / "tests" / "cli"))
from exr_reader import read_exr  # noqa: E402

TEXTURED = """<scene version="3.0.0">
  <integrator type="path"/>
  <sensor type="perspective"><transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><rfilter type="box"/></film></sensor>
  <emitter type="constant"/>
  <shape type="rectangle"><bsdf type="diffuse">
    <texture name="reflectance" type="bitmap"><string name="filename" value="two.ppm"/></texture></bsdf></shape>
</scene>"""


def run(*command, folder, **environment):
    result = subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True,
                            env={**os.environ, **environment})
    if result.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}: {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout


def install_and_move(build, work):
    """Installs, and takes the prefix to another place, where everything must still work."""
    run(CMAKE, "--install", build, "--prefix", work / "first", folder=work)
    (work / "first").rename(work / "prefix")
    return work / "prefix"


def build_examples(prefix, work):
    said = run(CMAKE, "-G", "Ninja", "-S", EXAMPLES, "-B", work / "examples", f"-DCMAKE_PREFIX_PATH={prefix}",
               f"-DCMAKE_CXX_COMPILER={CXX}", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", folder=work)
    if "does not exist" in said:  # of files that nothing needs
        raise AssertionError(said)
    run(CMAKE, "--build", work / "examples", folder=work)
    return work / "examples"


def rgb(path):
    channels = read_exr(path.read_bytes())
    return [list(channels[c]) for c in "RGB"]


def write_groups(film, path):
    """The group means of a film as plain floats, [pixel][group][rgb]."""
    channels = read_exr(film.read_bytes())
    columns = [channels[f"group{group:02}.{c}"] for group in range(GROUPS) for c in "RGB"]
    path.write_bytes(array.array("f", (value for pixel in zip(*columns) for value in pixel)).tobytes())


class Package(unittest.TestCase):
    """The library of this build."""
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.work = Path(folder.name)
        cls.prefix = install_and_move(cls.build_folder(), cls.work)
        cls.examples = build_examples(cls.prefix, cls.work)

    @classmethod
    def build_folder(cls):
        return BUILD

    def run_in_folder(self, *command):
        return run(*command, folder=self.work)

    def test_denoising_arrays_is_close_to_the_program(self):
        """Which knows more of its own files, such as their counts and features behind glass."""
        for seed in (1, 2):
            self.run_in_folder(self.prefix / "bin" / "covary", "render", ROOM, "-o", f"mine{seed}.exr", "--resolution",
                               "48x32", "--spp", 16, "--seed", seed, "--estimator", "none", "--aovs", "--no-preview",
                               "--quiet")
        renders = ("mine1.exr", "mine2.exr")
        printed = self.run_in_folder(self.examples / "denoise_arrays", *renders, "own.exr")
        self.assertRegex(printed, r"^predicted relMSE 0\.\d+")
        self.run_in_folder(self.prefix / "bin" / "covary", "denoise", *renders, "-o", "arrays.exr", "--quiet")
        columns = zip(*(c for path in ("own.exr", "arrays.exr") for c in rgb(self.work / path)))
        errors = [sum((a - b) ** 2 / (b * b + 0.01) for a, b in zip(pixel[:3], pixel[3:])) / 3 for pixel in columns]
        self.assertLess(sum(errors) / len(errors), 0.02)
        with self.assertRaisesRegex(AssertionError, r"denoise_arrays: .*none\.exr"):
            self.run_in_folder(self.examples / "denoise_arrays", "none.exr", *renders)

    def test_a_film_is_denoised_as_a_render_is(self):
        printed = self.run_in_folder(self.examples / "denoise_render", ROOM, "noisy.exr", "later.exr")
        predicted = float(re.fullmatch(r"predicted relMSE (0\.\d+)\n", printed)[1])
        self.run_in_folder(self.prefix / "bin" / "covary", "render", ROOM, "-o", "once.exr", "--resolution", "120x80",
                           "--spp", 24, "--groups", 12, "--quiet")
        later, once = rgb(self.work / "later.exr"), rgb(self.work / "once.exr")
        self.assertEqual(later, once)
        self.assertNotEqual(rgb(self.work / "noisy.exr"), later)
        self.assertGreater(predicted, 0)

    def test_combining_arrays_gives_the_image_of_the_program(self):
        self.run_in_folder(self.prefix / "bin" / "covary", "render", ROOM, "-o", "out.exr", "--resolution", "48x32",
                           "--spp", 4 * GROUPS, "--groups", GROUPS, "--estimator", "iicv", "--passes", "passes",
                           "--no-preview", "--quiet")
        for name in ("crn", "independent"):
            write_groups(self.work / "passes" / f"{name}.exr", self.work / name)
        printed = self.run_in_folder(self.examples / "combine_arrays", 48, 32, GROUPS, "crn", "independent", "out")
        self.assertRegex(printed, r"^relMSE by the standard errors 0\.\d+\n$")
        values = array.array("f", (self.work / "out").read_bytes())
        self.assertEqual(rgb(self.work / "out.exr"), [list(values[c::3]) for c in range(3)])

    def test_combining_arrays_reports_errors(self):
        (self.work / "short").write_bytes(b"1234")
        with self.assertRaisesRegex(AssertionError, "combine_arrays: short: not 108 floats"):
            self.run_in_folder(self.examples / "combine_arrays", 3, 3, 4, "short", "short", "out")
        for given, message in (((-6, 3, 4), "WIDTH '-6': expected a whole number from 1 on"),
                               ((3, 3, "x4"), "GROUPS 'x4': expected a whole number from 1 on")):
            with self.assertRaisesRegex(AssertionError, message):
                self.run_in_folder(self.examples / "combine_arrays", *given, "short", "short", "out")

    def test_combining_files_gives_the_image_of_the_program(self):
        """A pair of films, and two independent renders."""
        covary, small = self.prefix / "bin" / "covary", ("--resolution", "48x32", "--no-preview", "--quiet")
        self.run_in_folder(covary, "render", ROOM, "-o", "pair.exr", *small, "--spp", 2 * GROUPS, "--groups", GROUPS,
                           "--estimator", "iicv", "--passes", "pair")
        films = ("pair/independent.exr", "--crn", "pair/crn.exr")
        printed = self.run_in_folder(self.examples / "combine_files", "own.exr", *films)
        self.assertRegex(printed, rf"^{GROUPS} \+ {GROUPS} groups, predicted relMSE 0\.\d+( \(unsure\))?\n$")
        self.run_in_folder(covary, "combine", "--independent", *films, "--error", "-o", "program.exr", "--quiet")
        self.assertEqual(rgb(self.work / "own.exr"), rgb(self.work / "program.exr"))
        for seed in (1, 2):
            self.run_in_folder(covary, "render", ROOM, "-o", f"{seed}.exr", *small, "--spp", 8, "--seed", seed,
                               "--estimator", "none")
        printed = self.run_in_folder(self.examples / "combine_files", "own.exr", "1.exr", "2.exr")
        self.assertRegex(printed, r"^0 \+ 2 groups, predicted relMSE 0\.\d+( \(unsure\))?\n$")
        self.run_in_folder(covary, "denoise", "1.exr", "2.exr", "-o", "denoised.exr", "--quiet")
        self.assertEqual(rgb(self.work / "own.exr"), rgb(self.work / "denoised.exr"))
        with self.assertRaisesRegex(AssertionError, r"combine_files: .*none\.exr"):
            self.run_in_folder(self.examples / "combine_files", "own.exr", "none.exr", "1.exr")

    def test_rendering_gives_the_image_of_the_program(self):
        self.run_in_folder(self.prefix / "bin" / "covary", "render", ROOM, "-o", "a.exr", "--resolution", "120x80",
                           "--spp", 24, "--no-preview", "--quiet")
        printed = self.run_in_folder(self.examples / "render_scene", ROOM, "b.exr")
        self.assertRegex(printed, r"^24 samples per pixel in .* predicted relMSE 0\.\d+\n$")
        self.assertEqual(rgb(self.work / "a.exr"), rgb(self.work / "b.exr"))

    def test_an_integrator_of_the_caller_renders(self):
        """Radiance 1 everywhere and albedo 1/2: after n reflections, 1 + 1/2 + ... + 1/2^n in every sample."""
        furnace = (SOURCE / "scenes" / "furnace.xml").read_text()
        own = '<integrator type="reflections"><integer name="max_reflections" value="2"/></integrator>'
        (self.work / "furnace.xml").write_text(re.sub("<integrator.*?</integrator>", own, furnace, flags=re.S))
        program = self.examples / "own_integrator"
        for given, expected in (((), 1.75), (("max-reflections=0",), 1), (("max-reflections=5",), 1.96875)):
            printed = self.run_in_folder(program, "furnace.xml", *given)
            self.assertAlmostEqual(float(printed.removeprefix("mean ")), expected, 5)
        printed = self.run_in_folder(program, SOURCE / "scenes" / "furnace.xml", "max-reflections=3")
        self.assertAlmostEqual(float(printed.removeprefix("mean ")), 1.875, 5)
        with self.assertRaisesRegex(AssertionError, "`max-reflections` 'x': expected a whole number from 0 to 1000"):
            self.run_in_folder(program, "furnace.xml", "max-reflections=x")
        with self.assertRaisesRegex(AssertionError, r"2\nexpected: own_integrator SCENE.xml \[max-reflections=N"):
            self.run_in_folder(program, "furnace.xml", "maxreflections=3")

    def test_an_integrator_of_the_caller_renders_every_scene(self):
        """Every reflectance model: what one vertex needs does not add up along paths."""
        shutil.copytree(SOURCE / "scenes", self.work / "scenes")
        for name in ("box", "glossy-box", "room", "materials", "veil", "caustic"):
            with self.subTest(name):
                scene = self.work / "scenes" / f"{name}.xml"
                text = scene.read_text()
                for of, value in (("width", 24), ("height", 16), ("spp", 4)):
                    text = re.sub(rf'(<default name="{of}" value=)"[^"]*"', rf'\1"{value}"', text)
                scene.write_text(text)
                printed = self.run_in_folder(self.examples / "own_integrator", scene, "max-reflections=8")
                self.assertGreaterEqual(float(printed.removeprefix("mean ")), 0 if name == "caustic" else 0.01)

    def test_textures_are_read(self):
        """Through libcovary_imageio.so, which the library finds beside itself."""
        (self.work / "two.ppm").write_bytes(b"P6\n2 1\n255\n\xff\x00\x00\xff\x00\x00")
        (self.work / "textured.xml").write_text(TEXTURED)
        self.run_in_folder(self.examples / "render_scene", "textured.xml", "textured.exr")
        red, green, _ = rgb(self.work / "textured.exr")
        middle = 40 * 120 + 60
        self.assertAlmostEqual(red[middle], 1, delta=0.05)
        self.assertAlmostEqual(green[middle], 0, delta=0.05)

    def test_programs_are_compiled_for_every_processor(self):
        commands = json.loads((self.examples / "compile_commands.json").read_text())
        self.assertEqual(len(commands), 6)
        for command in commands:
            self.assertNotRegex(command["command"], r"\s-(m|f(?!sanitize)|O|W)")

    def test_headers_are_complete_and_the_same_for_every_processor(self):
        include = self.prefix / "include"
        headers = sorted(str(p.relative_to(include)) for p in include.rglob("*.h"))
        self.assertGreater(len(headers), 20)
        for header in headers:
            text = (include / header).read_text()
            for name in re.findall(r'#\s*include "([^"]+)"', text):
                self.assertIn(name, headers, header)
            for name in re.findall(r"#\s*include <([^>]+)>", text):
                self.assertRegex(name, r"^[a-z_]+$", f"{header}: only the standard library's headers")
            self.assertNotRegex(text, r"__(AVX|SSE|FMA)|vector_size|intrin", header)
        (self.work / "all.cpp").write_text("".join(f"#include <{header}>\n" for header in headers))
        self.run_in_folder(CXX, "-std=c++20", "-Wall", "-Wextra", "-Wno-missing-field-initializers", "-Werror",
                           "-fsyntax-only", "-I", include, "all.cpp")

    def test_package_names_no_folder_of_this_machine(self):
        files = list((self.prefix / "lib").rglob("cmake/covary/*.cmake"))
        self.assertEqual(len(files), 4)
        for file in files:
            for folder in (self.work, BUILD, SOURCE):
                self.assertNotIn(str(folder), file.read_text(), file)

    def test_pkg_config(self):
        """Compiles the examples without CMake, and names no folder of this machine."""
        file = next((self.prefix / "lib").rglob("covary.pc"))
        for folder in (self.work, BUILD, SOURCE):
            self.assertNotIn(str(folder), file.read_text())

        def pkg_config(*words):
            return run("pkg-config", *words, "covary", folder=self.work, PKG_CONFIG_PATH=str(file.parent)).split()
        self.assertEqual(pkg_config("--modversion"), [VERSION])
        self.assertIn(f"-I{file.parent}", " ".join(pkg_config("--cflags")))
        self.run_in_folder(CXX, "-std=c++20", "-o", "with_pkg_config", EXAMPLES / "render_scene.cpp",
                           *os.environ.get("CXXFLAGS", "").split(), *pkg_config("--cflags", "--libs"))
        library = str(next((self.prefix / "lib").rglob("libcovary.*")).parent)
        images = []
        for program in ("with_pkg_config", self.examples / "render_scene"):
            run(self.work / program, ROOM, "image.exr", folder=self.work, LD_LIBRARY_PATH=library)
            images.append(rgb(self.work / "image.exr"))
        self.assertEqual(*images)

    def test_versions_with_other_interfaces_are_refused(self):
        major, minor, patch = map(int, VERSION.split("."))
        file = next((self.prefix / "lib").rglob("covaryConfigVersion.cmake"))
        script = self.work / "version.cmake"
        script.write_text("include(${FILE})\nmessage(STATUS \"${PACKAGE_VERSION_COMPATIBLE}\")\n")
        for wanted, accepted in ((VERSION, "TRUE"), (f"{major}.{minor + 1}.0", "FALSE"), (f"{major + 1}.0.0", "FALSE")):
            numbers = zip(("", "_MAJOR", "_MINOR", "_PATCH"), (wanted, *wanted.split(".")))
            defines = [f"-DPACKAGE_FIND_VERSION{name}={value}" for name, value in numbers]
            self.assertIn(accepted, self.run_in_folder(CMAKE, *defines, f"-DFILE={file}", "-P", script), wanted)

    def test_page_shows_the_examples(self):
        page = (SOURCE / "docs" / "library.md").read_text()
        for file in EXAMPLES.iterdir():
            lines = [line for line in file.read_text().splitlines() if "SPDX" not in line]
            self.assertIn("\n".join(["", *lines, "```"]), page, file)


if __name__ == "__main__":
    unittest.main()
