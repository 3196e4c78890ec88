# SPDX-License-Identifier: Apache-2.0
"""The package as such: what importing it costs, its types, and the examples of its page and notebooks."""
import json
import os
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

import covary
import numpy
from common import ROOM, SOURCE, PackageTest, examples_of_page, noisy


class Import(PackageTest):
    def test_brings_no_numpy(self):
        """Which alone takes as long as all else; calls import it."""
        code = "import covary, sys; print(sorted({'numpy', 'tqdm', 'mitsuba', 'dask'} & set(sys.modules)))"
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        self.assertEqual(run.stdout, "[]\n")

    def test_version_and_program(self):
        run = subprocess.run([covary.program(), "--version"], capture_output=True, text=True, check=True)
        self.assertIn(f"covary {covary.__version__}", run.stdout)

    def test_missing_program(self):
        """Names what to do, and is found on the search path."""
        code = "import covary; print(covary.program())"
        environment = {**os.environ, "PATH": str(self.path)}
        del environment["COVARY_PROGRAM"]
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
        self.assertIn("the program 'covary' is not installed", run.stderr)
        shutil.copy(os.environ["COVARY_PROGRAM"], self.path / "covary")
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
        self.assertEqual(run.stdout, f"{self.path / 'covary'}\n")

    def test_scenes(self):
        """Those of the repository, with their files; the program finds them beside itself, as in a wheel."""
        self.assertEqual(covary.scenes.names(), sorted(file.stem for file in self.files()))
        self.assertIn("spheres", covary.scenes.names())  # a pbrt scene
        for file in self.files():
            loaded = covary.Scene.load(file.stem)
            self.assertEqual(loaded.path, str(covary.scenes.path(file.stem)))
            self.assertEqual(loaded.content_hash, covary.Scene.load(file).content_hash)

    def files(self):
        return [file for file in (SOURCE / "scenes").iterdir() if file.suffix in (".xml", ".pbrt")]

    def test_all_names_exist(self):
        for name in covary.__all__:
            self.assertTrue(hasattr(covary, name), name)


GOOD = """
import covary
import covary.blender
import covary.distributed
import covary.mitsuba
import numpy
from numpy.typing import NDArray
a: NDArray[numpy.float32] = numpy.zeros((3, 4, 4, 3), numpy.float32)
image: NDArray[numpy.float32] = covary.iicv(a, a, k=9, penalty="sample").image
covary.combine(a, a, "cv-baseline")
error: float = covary.metrics.flip(image, image)
covary.render(covary.Scene.load("x.xml"), 4, "none", filter="box").films["independent"].save("x")
covary.combine(a, a, k=9, penalty="sample", paper=True)
for step in covary.render_progressively("x.xml", until=1e-3, sampler="sobol", progress=False):
    print(step.samples_per_pixel)
covary.mitsuba.render("x.xml", 64, denoise="bias", oidn="off", progress=True)
covary.blender.render(None, 64, estimator="iicv", window=7)
covary.distributed.render(None, "x.xml", 64, denoise="none", progress=print)
"""
WRONG = {
    'covary.iicv(a, a, penalty="smple")': "arg-type",
    "covary.iicv(a, a, windw=3)": "call-arg",
    'covary.combine(a, a, "polynomials")': "arg-type",
    'covary.render("x.xml", filter="bx")': "arg-type",
    'covary.render("x.xml", smapler="sobol")': "call-arg",
    'covary.render("x.xml", max_spp="64")': "arg-type",
    'covary.render("x.xml", max_depth=3)': "call-arg",  # of Scene.load()
    'covary.render_frames("x_#.xml", "o_#.exr", "1-2", aov=True)': "call-arg",
    "covary.combine(a, a, widow=7)": "call-arg",
    'covary.combine(a, a, k="9")': "arg-type",
    'covary.render_progressively("x.xml", untl=1e-3)': "call-arg",
    'covary.mitsuba.render("x.xml", 64, denois="bias")': "call-arg",
    'covary.mitsuba.render("x.xml", 64, denoise="biased")': "arg-type",
    'covary.blender.render(None, 64, penalty="smple")': "arg-type",
    'covary.distributed.render(None, "x.xml", 64, windw=7)': "call-arg",
}


class Types(PackageTest):
    def mypy(self, *words):
        return subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", self.path / "cache", *words],
                              capture_output=True, text=True, check=False,
                              env={**os.environ, "MYPYPATH": str(Path(covary.__file__).parent.parent)})

    def test_package(self):
        run = self.mypy("-p", "covary")
        self.assertEqual(run.returncode, 0, run.stdout)

    def test_mistakes_are_found(self):
        program = self.path / "use.py"
        program.write_text(GOOD)
        self.assertEqual(self.mypy(program).returncode, 0, self.mypy(program).stdout)
        program.write_text(GOOD + "".join(f"{line}\n" for line in WRONG))
        found = re.findall(r"use.py:(\d+): error: .*\[([a-z-]+)\]", self.mypy(program).stdout)
        first = GOOD.count("\n") + 1
        self.assertEqual(found, [(str(first + i), kind) for i, kind in enumerate(WRONG.values())])


class Documentation(PackageTest):
    def test_examples(self):
        """In the order of the page, in one namespace, with no files but those of the package."""
        blocks = examples_of_page()
        self.assertGreater(len(blocks), 5)
        before = Path.cwd()
        os.chdir(self.path)
        self.addCleanup(os.chdir, before)
        names = {}
        for number, block in enumerate(blocks):
            exec(compile(block, f"docs/python.md, example {number}", "exec"), names)
        self.assertTrue((self.path / "compare.html").exists())
        self.assertLess(names["combined"].predicted_relmse, 0.05)


class Notebook(PackageTest):
    def test_view(self):
        image, reference = noisy(1, False)[0], noisy(2, False)[0]
        page = covary.view({"mine": image}, reference, title="Some title").page
        self.assertIn("Some title", page)
        self.assertIn('"mine"', page)
        html = covary.view([image, image], small=True)._repr_html_()
        self.assertTrue(html.startswith('<iframe srcdoc="&lt;!'), html[:60])
        self.assertRegex(repr(covary.view([image, image], small=True)), r"^<covary.View, a page of \d\.\d MB: shown ")
        self.assertIn("found the name 'a/b'", self.message_of(ValueError, covary.view, {"a/b": image}))
        self.assertIn("missing.exr", self.message_of(covary.Error, covary.view, ["missing.exr"]))

    def test_notebooks(self):
        """Their cells, one after the other; the last shows a page."""
        before = Path.cwd()
        os.chdir(self.path)
        self.addCleanup(os.chdir, before)
        notebooks = sorted((SOURCE / "docs" / "notebooks").glob("*.ipynb"))
        self.assertEqual(len(notebooks), 2)
        for notebook in notebooks:
            cells = json.loads(notebook.read_text())["cells"]
            names = {"numpy": numpy}
            sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
            for source in sources[:-1]:
                exec(compile(source, notebook.name, "exec"), names)
            self.assertIn("<iframe", eval(sources[-1], names)._repr_html_())


if __name__ == "__main__":
    unittest.main()
