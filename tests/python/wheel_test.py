# SPDX-License-Identifier: Apache-2.0
"""A wheel for this machine, in a fresh virtual environment and without the environment of the build. Needs PyPI."""
import json
import subprocess
import tarfile
import unittest
import zipfile

from common import SOURCE, PackageTest, examples_of_page

LINES = """
import covary
scene = covary.Scene.load(covary.scenes.path("room"), resolution=(60, 40))
result = covary.render(scene, 24, "iicv")
again = covary.combine(result.films["crn"].groups, result.films["independent"].groups)
assert (again.image == result.image).all()
result.save("room.png")
assert "<iframe" in covary.view([result.image])._repr_html_()
"""


class Wheel(PackageTest):
    def bare(self, *command):
        """Runs without variables that name parts of the build."""
        return subprocess.run(list(map(str, command)), cwd=self.path, capture_output=True, text=True, check=True,
                              env={"PATH": "/usr/bin:/bin", "HOME": str(self.path)}).stdout

    def check_sources(self, archive):
        """All that the repository has, but pictures of the documentation."""
        with tarfile.open(archive) as file:
            names = {name.partition("/")[2] for name in file.getnames()}
        self.assertIn("PKG-INFO", names)
        if (SOURCE / ".git").exists():
            tracked = subprocess.run(["git", "ls-files"], cwd=SOURCE, capture_output=True, text=True, check=True)
            left_out = set(tracked.stdout.splitlines()) - names
            self.assertEqual([name for name in left_out if not name.startswith((".ci/", "docs/images/"))], [])

    def check_metadata(self, wheel):
        """What an index shows of it."""
        with zipfile.ZipFile(wheel) as archive:
            name, = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
            facts = archive.read(name).decode().partition("\n\n")[0].splitlines()
        cited = (SOURCE / "CITATION.cff").read_text()
        author = next(line.removeprefix("Author: ") for line in facts if line.startswith("Author: "))
        self.assertIn(f"name: {author}", cited)
        self.assertGreater(len([line for line in facts if line.startswith("Classifier: ")]), 5)
        self.assertIn("License-Expression: Apache-2.0 AND BSD-3-Clause", facts)
        self.assertIn("License-File: src/emitters/data/LICENSE.hosek_wilkie", facts)

    def check_licences(self, wheel):
        """Each package that the lists of parts name has its licence in the wheel, and the metadata name it."""
        with zipfile.ZipFile(wheel) as archive:
            names = archive.namelist()
            info = next(name for name in names if name.endswith(".dist-info/METADATA")).removesuffix("METADATA")
            facts = archive.read(info + "METADATA").decode()
            lists = [json.loads(archive.read(name)) for name in names if name.startswith(info + "sboms/")]
        packages = {part["name"] for parts in lists for part in parts["components"]} - {"covary"}
        libraries = {name.partition("-")[0] for name in names if name.startswith("covary.libs/")}
        self.assertEqual(len(lists), 2)
        self.assertGreaterEqual(len(packages), 12)
        self.assertTrue({"covary.libs/libembree3", "covary.libs/libembree4"} & libraries)  # Debian 12, 13
        for package in packages:
            self.assertIn(f"{info}licenses/{package}/copyright", names)
            self.assertIn(f"License-File: {package}/copyright\n", facts)

    def test_wheel(self):
        subprocess.run([SOURCE / "scripts" / "wheel", "native", self.path / "dist"], check=True, capture_output=True)
        wheel, = (self.path / "dist").glob("covary-*-cp310-abi3-manylinux_*_x86_64.whl")
        self.assertLess(wheel.stat().st_size, 40e6)
        sources, = (self.path / "dist").glob("covary-*.tar.gz")
        self.check_sources(sources)
        self.bare("/usr/bin/python3", "-m", "venv", "fresh")
        self.bare("fresh/bin/pip", "install", "-q", f"{wheel}[oidn]")
        self.bare("fresh/bin/python", "-c", LINES)
        self.bare("fresh/bin/python", "-c", "\n".join(examples_of_page()))
        self.assertTrue((self.path / "room.png").exists())
        self.assertIn("covary ", self.bare("fresh/bin/covary", "--version"))
        self.assertIn("room.xml", self.bare("fresh/bin/covary", "experiment", "quick", "--print"))
        self.assertIn("Open Image Denoise 2.5.1\n", self.bare("fresh/bin/covary", "denoise", "--check"))
        for module in (self.path / "fresh").glob("lib/python*/site-packages/covary/lib/covary/libcovary_imageio.so"):
            module.unlink()  # as where OpenImageIO is not installed, which it needs
        self.bare("fresh/bin/covary", "convert", "room.png", "again.exr")
        with self.assertRaises(subprocess.CalledProcessError) as refused:
            self.bare("fresh/bin/covary", "convert", "room.png", "again.tif")
        self.assertIn("without OpenImageIO only EXR, PNG, JPEG and HDR are read", refused.exception.stderr)
        self.check_metadata(wheel)
        self.check_licences(wheel)
        linked = self.bare("ldd", *(self.path / "fresh").glob("lib/python*/site-packages/covary/_covary*.so"))
        self.assertNotIn("not found", linked)
        self.assertNotIn("/usr/lib/x86_64-linux-gnu/libembree", linked)


if __name__ == "__main__":
    unittest.main()
