# SPDX-License-Identifier: Apache-2.0
"""The installation for every x86-64 processor: all that holds for the library of one processor, and the loader takes
the level that fits. Levels above that of this machine cannot be tested here; v2 and v3 can on most."""
import re
import subprocess
import unittest
from pathlib import Path

import package_test
from package_test import BUILD, CMAKE, ROOM, SOURCE, rgb, run

LOADER = "/lib64/ld-linux-x86-64.so.2"
LEVELS = ("x86-64-v4", "x86-64-v3")  # v2 is what remains


def levels_of_machine():
    listed = run(LOADER, "--help", folder="/")
    return [level for level in LEVELS if re.search(rf"{level} \(supported, searched\)", listed)]


def error_between(a, b):
    """Mean squared difference relative to the square of the mean."""
    pairs = [(x, y) for p, q in zip(a, b) for x, y in zip(p, q)]
    mean = sum(x for x, _ in pairs) / len(pairs)
    return sum((x - y) ** 2 for x, y in pairs) / len(pairs) / mean ** 2


class Levels(package_test.Package):
    @classmethod
    def build_folder(cls):
        """What plain `cmake` builds; kept between runs."""
        build = BUILD / "portable"
        run(CMAKE, "-G", "Ninja", "-S", SOURCE, "-B", build, "-DCOVARY_TESTS=OFF", "-DCOVARY_BENCHMARKS=OFF",
            folder=SOURCE)
        run(CMAKE, "--build", build, "-j", run(SOURCE / "scripts" / "jobs", folder=SOURCE).strip(), folder=SOURCE)
        return build

    def with_level(self, level, *command, debug):
        """Runs a program as if the machine had this level and none above; returns what the loader says of its work."""
        result = subprocess.run([LOADER, "--glibc-hwcaps-mask", level, *map(str, command)], cwd=self.work, text=True,
                                capture_output=True, env={"LD_DEBUG": debug})
        self.assertEqual(result.returncode, 0, result.stderr[-2000:])
        return result.stderr

    def library_folder(self, level):
        return self.prefix / "lib" / "glibc-hwcaps" / level if level else self.prefix / "lib"

    def test_the_loader_takes_the_highest_level(self):
        for level in [*levels_of_machine(), ""]:
            for program in (self.prefix / "bin" / "covary", self.examples / "render_scene"):
                arguments = [ROOM, "x.exr"] if program.name == "render_scene" else ["--version"]
                said = self.with_level(level or "none", program, *arguments, debug="libs")
                taken = re.findall(r"calling init: (\S*/libcovary\.so\S*)", said)
                self.assertEqual([Path(path).resolve().parent for path in taken],
                                 [self.library_folder(level).resolve()])

    def test_levels_render_the_same_picture(self):
        pictures = {}
        for level in [*levels_of_machine(), ""]:
            name = f"picture{level}.exr"
            self.with_level(level or "none", self.prefix / "bin" / "covary", "render", ROOM, "-o", name, "--resolution",
                            "60x40", "--spp", 48, "--no-preview", "--quiet", debug="")
            pictures[level] = rgb(self.work / name)
        for level, picture in pictures.items():
            self.assertLess(error_between(picture, pictures[""]), 1e-3, level)

    def test_the_library_calls_its_own_functions(self):
        """Not the program's copies of inline functions, which are made for every processor."""
        said = self.with_level("none", self.examples / "render_scene", ROOM, "x.exr", debug="bindings")
        program = str(self.examples / "render_scene")
        bound = re.findall(r"binding file (\S+) \[0\] to (\S+) \[0\]: normal symbol `(\w+)'", said)
        self.assertGreater(len(bound), 100)
        taken = [symbol for source, target, symbol in bound if "/libcovary.so" in source and target == program]
        self.assertEqual([symbol for symbol in taken if re.match(r"_Z(?!T[VISN]|GV|Z)", symbol)], [])


if __name__ == "__main__":
    unittest.main()
