#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The house rules hold in this project, and each of them finds violations planted into a small tree."""
import os
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
import layers  # noqa: E402

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
SPDX = "// SPDX-License-Identifier: Apache-2.0\n"


class Repository(unittest.TestCase):
    """Every check passes on the project itself."""

    def test_all_checks(self):
        for check in layers.CHECKS:
            with self.subTest(check.__name__):
                self.assertEqual([], check(ROOT))

    def test_sees_the_sources(self):
        """The checks above would also pass if they looked into the wrong folder."""
        self.assertGreater(len(list(layers.files(ROOT, ["src"], layers.CPP))), 20)


class Planted(unittest.TestCase):
    """A clean tree gives no problem; each violation gives exactly one, at its place."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.write("src/core/vec.h", SPDX)
        self.write("src/scene/scene.h", SPDX + '#include "core/vec.h"\n#include <vector>\n')
        self.write("src/integrators/path.cpp", SPDX + '#include "scene/scene.h"\n#include "core/vec.h"\n')
        self.write("src/integrators/path_test.cpp", SPDX + '#include "statistics/chi2.h"\n#include "io/load_scene.h"\n')
        self.write("src/integrators/CMakeLists.txt",
                   "covary_module(integrators SOURCES path.cpp DEPENDS covary_scene covary_film)\n")
        self.write("tests/statistics/chi2.h", SPDX)
        self.write("docs/references.bib", "@article{Veach1995,\n}\n")
        self.write("README.md", "# Small\n")
        self.write("docs/architecture.md", "      src/\n        core/\n        scene/        ──► settings\n"
                   "        integrators/  ──► passes, sampling\n")
        self.write("docs/scene-format.md", "# Scenes\n## Reflectance (`bsdfs`)\n")

    def write(self, path, text):
        full = os.path.join(self.folder.name, path)
        os.makedirs(os.path.dirname(full), exist_ok=True)
        with open(full, "w", encoding="utf-8") as file:
            file.write(text)

    def expect(self, check, *problems):
        found = check(self.folder.name)
        self.assertEqual(len(problems), len(found), found)
        for expected, actual in zip(problems, found):
            self.assertIn(expected, actual)

    def test_clean_tree(self):
        for check in layers.CHECKS:
            self.expect(check)

    def test_long_line(self):
        self.write("docs/page.md", f"{'word ' * 24}\n{'word ' * 24}x\nhttps://{'x' * 200}\n")
        self.write("docs/page.bib", "x" * 200)
        self.expect(layers.lines_fit, "docs/page.md:2: 121 columns; at most 120")

    def test_long_line_of_a_script(self):
        self.write("scripts/run", f"#!/bin/sh\necho {'x' * 120}\n")
        self.write(".gitignore", "x" * 200)
        self.expect(layers.lines_fit, "scripts/run:2: 125 columns; at most 120")

    def test_long_file(self):
        self.write("src/film/film.cpp", "\n" * 401)
        self.write("src/film/film_test.cpp", "\n" * 401)
        self.write("src/film/film.h", "\n" * 400)
        self.expect(layers.files_fit, "src/film/film.cpp:401: 401 lines; at most 400")

    def test_long_function(self):
        body = "  if (a) { f('}', \"}\"); }  // }\n" * 58
        self.write("src/film/film.cpp", f"{SPDX}namespace covary {{\nclass Film {{\n public:\n  void fits() {{\n{body}"
                   f"  }}\n  int does_not(int a,\n    int b) const {{\n{body}  }}\n}};\nint k[] = {{\n{body}}};\n}}\n")
        self.write("src/film/film_test.cpp", f"{SPDX}void test() {{\n{body}\n\n}}\n")
        line = "    pass\n"
        self.write("python/covary/film.py", f"# {SPDX}def f():\n{40 * line}    def g():\n{19 * ('    ' + line)}"
                   f"def h():\n    '''\n{60 * line}    '''\n    pass\n")
        self.expect(layers.functions_fit,
                    "src/film/film.cpp:65: 61 lines of 'int does_not(int a, int b) const'; at most 60",
                    "python/covary/film.py:2: 61 lines of 'f'; at most 60")

    def test_long_module(self):
        for name in ("a", "b", "c_test"):
            self.write(f"src/film/{name}.cpp", "\n" * 2501)
        self.expect(layers.modules_fit, "src/film:1: 5002 lines; at most 5000")

    def test_include_against_an_arrow(self):
        self.write("src/film/film.cpp", SPDX + '#include "core/vec.h"\n#include "scene/scene.h"\n')
        self.expect(layers.includes_follow_arrows, "src/film/film.cpp:3: film may not include 'scene/scene.h'")

    def test_every_missing_arrow_is_refused(self):
        """All pairs of modules: an include is accepted exactly when the arrows lead there."""
        for module in layers.ARROWS:
            for target in layers.ARROWS:
                with self.subTest(module=module, target=target):
                    self.write(f"src/{module}/x.h", SPDX + f'  #  include "{target}/y.h"\n')
                    refused = [f"src/{module}/x.h:2"] if target not in layers.visible_modules(module) else []
                    self.expect(layers.includes_follow_arrows, *refused)
            self.write(f"src/{module}/x.h", SPDX)

    def test_arrows_have_no_cycle_and_known_directions(self):
        for module in layers.ARROWS:
            for target in layers.visible_modules(module) - {module}:
                self.assertNotIn(module, layers.visible_modules(target))
        below = {"core", "settings", "imageio", "film", "filters", "estimators"}
        self.assertEqual(below, layers.visible_modules("estimators"))
        self.assertNotIn("film", layers.visible_modules("io"))
        self.assertNotIn("bsdfs", layers.visible_modules("integrators"))

    def test_drawing_differs_from_arrows(self):
        self.write("docs/architecture.md",
                   "        core/   ──► scene\n        scene/  ──► settings\n        utils/  ──► core\n")
        self.expect(layers.architecture_draws_the_arrows, "architecture.md:1: lacks src/integrators",
                    "architecture.md:1: core has arrows to nothing",
                    "architecture.md:3: draws src/utils, which there is not")

    def test_circle_of_python_files(self):
        self.write("python/covary/a.py", "# SPDX-License-Identifier: Apache-2.0\nfrom . import b, other\n")
        self.write("python/covary/b.py", "# SPDX-License-Identifier: Apache-2.0\ndef f():\n    from .c import g\n")
        self.write("python/covary/c.py", "# SPDX-License-Identifier: Apache-2.0\n")
        self.expect(layers.python_has_no_circle)
        self.write("python/covary/c.py", "# SPDX-License-Identifier: Apache-2.0\nif T:\n    from .a import h\n")
        self.expect(layers.python_has_no_circle, "a.py:1: imports itself: a -> b -> c -> a",
                    "b.py:1: imports itself: b -> c -> a -> b", "c.py:1: imports itself: c -> a -> b -> c")

    def test_include_by_climbing(self):
        self.write("src/core/a.h", SPDX + '#include "../scene/scene.h"\n')
        self.expect(layers.includes_follow_arrows, "src/core/a.h:2: '../scene/scene.h' climbs out")

    def test_include_without_room(self):
        self.write("src/core/a.cpp", SPDX + '#include "vec.h"\n')
        self.expect(layers.includes_follow_arrows, "src/core/a.cpp:2: 'vec.h' does not name a module")

    def test_include_of_a_test_helper(self):
        self.write("src/core/a.cpp", SPDX + '#include "statistics/chi2.h"\n')
        self.expect(layers.includes_follow_arrows, "src/core/a.cpp:2: 'statistics/chi2.h' is for tests only")

    def test_unknown_room(self):
        self.write("src/utils/a.cpp", SPDX)
        self.expect(layers.includes_follow_arrows, "src/utils is not a module")

    def test_link_against_an_arrow(self):
        self.write("src/film/CMakeLists.txt", "covary_module(film\n  SOURCES film.cpp\n"
                   "  DEPENDS covary_core covary_io\n  TESTS film_test.cpp)\n")
        self.expect(layers.links_follow_arrows, "film may not depend on covary_io")

    def test_constant_that_hides_another(self):
        self.write("src/io/CMakeLists.txt", "covary_module(io TOGETHER\n  SOURCES a.cpp b.cpp)\n")
        self.write("src/io/a.cpp", SPDX + "namespace covary {\nnamespace {\n\nconstexpr int kMax = 3, kMin = 1;\n\n"
                   "}  // namespace\n}\n")
        self.write("src/io/b.cpp", SPDX + "int all() { return kMax + Path::kMin; }\n")
        self.write("src/io/c.cpp", SPDX + "int all() {\n  constexpr int kMax = 2;\n  return kMax;\n}\n")
        self.expect(layers.together_hides_no_constant, "src/io/b.cpp:1: kMax would be that of src/io/a.cpp")
        self.write("src/io/CMakeLists.txt", "covary_module(io\n  SOURCES a.cpp b.cpp)\n")
        self.expect(layers.together_hides_no_constant)

    def test_missing_licence(self):
        self.write("src/core/a.cpp", "#include <vector>\n")
        self.write("scripts/run", "#!/bin/sh\necho\n")
        self.expect(layers.licence_lines, "src/core/a.cpp:1", "scripts/run:1")

    def test_leftovers(self):
        self.write("src/core/a.cpp", SPDX + "#if 0\n#endif\n// TODO tidy\n// TODO(#12) tidy\n")
        self.write("src/core/a_test.cpp", SPDX + "TEST(A, DISABLED_b) {\n  GTEST_SKIP();\n}\n")
        self.expect(layers.no_leftovers, "src/core/a.cpp:2: disabled code", "src/core/a.cpp:4: a note for later",
                    "src/core/a_test.cpp:2: a test that does not run",
                    "src/core/a_test.cpp:3: a test that does not run")

    def test_citation_without_entry(self):
        self.write("src/core/a.cpp", SPDX + "// [Veach1995] Eq. (3)\n// [Heitz2018] listing 1\n")
        self.expect(layers.citations_have_entries, "src/core/a.cpp:3: [Heitz2018]")

    def test_registry_and_page_differ(self):
        self.write("src/bsdfs/registry.cpp", SPDX + '{"diffuse", make_diffuse}, {"plastic", make_plastic},  '
                   '// {"old", x}\n')
        self.write("docs/scene-format.md", "## Reflectance (`bsdfs`)\n### `diffuse`\n### `velvet`, `cloth`\n"
                   "## Other\n### `plastic`\n")
        self.expect(layers.documented_names_match_registries, "lacks 'plastic'", "describes 'cloth'",
                    "describes 'velvet'")

    def test_parameter_without_documentation(self):
        self.write("src/bsdfs/diffuse.cpp", SPDX +
                   'f(parameters.get_texture("reflectance", 1), parameters.get_bool("new", 1));\n')
        self.write("docs/scene-format.md", "| `reflectance` |\n")
        self.write("src/formats/pbrt_view.cpp", SPDX + 'p.get_float("fov", 1);\n')
        self.write("docs/pbrt.md", "| nothing |\n")
        self.expect(layers.documented_parameters, "lacks the parameter 'new' of src/bsdfs/diffuse.cpp:2",
                    "docs/pbrt.md:1: lacks the parameter 'fov' of src/formats/pbrt_view.cpp:2")

    def test_command_without_documentation(self):
        self.write("apps/render.cpp", SPDX + 'auto* a = app.add_subcommand("render", "Render a scene");\n')
        self.write("apps/merge.cpp", SPDX + 'auto* a = app.add_subcommand("merge", "Merge films");\n')
        self.write("README.md", "| `covary render SCENE` |\n")
        self.expect(layers.documented_commands, "lacks the command 'covary merge' of apps/merge.cpp:2")

    def test_suite_that_is_not_run(self):
        self.write("tests/cli/CMakeLists.txt", "suites(A a First)\nrun(${DIR}/b_test.py)\nrun(c_test.py word)\n")
        suite = "class {}(Test):\n    def test_it(self):\n        pass\n"
        self.write("tests/cli/a_test.py", suite.format("First") + suite.format("Second"))
        self.write("tests/cli/b_test.py", suite.format("Third"))
        self.write("tests/cli/c_test.py", suite.format("Fourth") + "class Base(Test):\n    pass\n")
        self.expect(layers.suites_are_run, "a_test.py:4: tests/cli/CMakeLists.txt does not run Second")

    def test_long_file_is_reported(self):
        self.write("src/core/a.cpp", SPDX + "\n" * layers.LONG_FILE)
        self.assertEqual([f"src/core/a.cpp: {layers.LONG_FILE + 1} lines; would it be two files?"],
                         layers.length_report(self.folder.name))


if __name__ == "__main__":
    unittest.main()
