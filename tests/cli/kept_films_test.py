# SPDX-License-Identifier: Apache-2.0
"""Films that `covary render` made or found are lost by nothing: a later call, an error, a full disk, a kill."""
import os
import signal
import unittest

from exr_reader import read_exr
from render_outputs_test import ROOM, SMALL, RenderTest

RENDER = ("render", ROOM, *SMALL, "-o", "out.exr", "--spp", "24")


class FilmsTest(RenderTest):
    def tree(self, folder="."):
        """All that is under the folder: bytes of files, where links lead."""
        return {str(p.relative_to(self.path)): os.readlink(p) if p.is_symlink() else p.read_bytes()
                for p in sorted((self.path / folder).rglob("*")) if p.is_symlink() or p.is_file()}

    def interrupt(self, *arguments, film, sent=signal.SIGINT):
        """A render that got a signal once all of its films had been written with samples in them."""
        process = self.start("-o", "out.exr", "--spp", "1000000", "--checkpoint", "0.05", "--quiet", "--no-preview",
                             *arguments)
        path, written = self.path / film, set()

        def has_samples():
            if path.exists():
                written.add(path.stat().st_mtime_ns)
            return len(written) >= 3
        self.wait_for(has_samples, process)
        code, _, errors = self.stop(process, sent)
        return code, errors


class EarlierFilms(FilmsTest):
    """A render without --passes finds films in the folder that would be its own."""

    def refused(self, message, *arguments):
        """The command fails, tells the two ways out, and leaves everything as it is."""
        before = self.tree()
        text = self.bad(1, message, *arguments).stderr
        self.assertIn("--resume", text)
        self.assertIn("--overwrite", text)
        self.assertEqual(self.tree(), before)

    def test_finished_films_of_passes(self):
        self.good(*RENDER, "--passes", "out.passes")
        films = self.tree("out.passes")
        self.assertEqual(sorted(films), [f"out.passes/{name}" for name in ("crn.exr", "crn.json", "independent.exr",
                                                                           "independent.json")])
        for more in ((), ("--seed", "7"), ("--estimator", "iduw"), ("--max-depth", "2")):
            self.refused("'out.passes/", *RENDER, *more)
        # Continued, they are kept: they belong to the render that named the folder.
        before = (self.path / "out.exr").read_bytes()
        self.good(*RENDER, "--resume")
        self.assertEqual(self.tree("out.passes"), films)
        self.assertEqual(read_exr((self.path / "out.exr").read_bytes()), read_exr(before))
        # Replaced, they are temporary like any others.
        self.good(*RENDER, "--seed", "7", "--overwrite")
        self.assertEqual(self.attributes("out.exr")["covary:seed"], "7")
        self.assertFalse((self.path / "out.passes" / "crn.exr").exists())

    def test_an_interrupted_render(self):
        code, errors = self.interrupt(film="out.passes/independent.exr")
        self.assertEqual(code, 130, errors)
        self.refused("'out.passes/", *RENDER)
        self.good(*RENDER, "--overwrite")
        self.assertNotIn("covary:complete", self.attributes("out.exr"))
        self.assertFalse((self.path / "out.passes").exists())

    def test_an_interrupted_film(self):
        plain = ("--estimator", "none")
        code, errors = self.interrupt(*plain, film="out.exr")
        self.assertEqual(code, 130, errors)
        self.refused("'out.exr' is the film of an interrupted render", *RENDER, *plain)
        self.refused("'out.exr' is the film of an interrupted render", *RENDER)
        self.good(*RENDER, *plain, "--overwrite")
        self.assertEqual(self.attributes("out.exr")["covary:complete"], "true")
        self.good(*RENDER, *plain)  # a finished film is an image like any other

    def test_files_that_are_no_films(self):
        (self.path / "out.passes").mkdir()
        for name, data in (("notes.txt", b"mine"), ("crn.json", b"{}"), (".lock", b"1")):
            (self.path / "out.passes" / name).write_bytes(data)
        mine = self.tree("out.passes")
        self.good(*RENDER)
        self.assertEqual(self.tree("out.passes"), mine)
        self.image("out.passes/crn.exr", (1, 2, 3))
        mine = self.tree("out.passes")
        self.refused("'out.passes/crn.exr' is there already", *RENDER)
        for overwrite in ("--overwrite", "--resume"):
            self.assertEqual(self.run_covary(*RENDER, overwrite).returncode, 1)
            self.assertEqual(self.tree("out.passes"), mine)
        self.bad(1, "and is no film", *RENDER, "--overwrite")

    def test_a_linked_folder(self):
        self.good("render", ROOM, *SMALL, "-o", "else.exr", "--spp", "24", "--passes", "elsewhere")
        (self.path / "out.passes").symlink_to("elsewhere")
        self.refused("'out.passes/", *RENDER)
        films = self.tree("elsewhere")
        self.good(*RENDER, "--resume")
        self.assertEqual(self.tree("elsewhere"), films)
        self.assertTrue((self.path / "out.passes").is_symlink())
        (self.path / "elsewhere" / "crn.exr").unlink()
        (self.path / "elsewhere" / "independent.exr").unlink()
        self.good(*RENDER)
        self.assertTrue((self.path / "out.passes").is_symlink())
        self.assertTrue((self.path / "elsewhere").is_dir())

    def test_a_linked_film(self):
        self.good("render", ROOM, *SMALL, "-o", "else.exr", "--spp", "24", "--passes", "elsewhere")
        (self.path / "out.passes").mkdir()
        (self.path / "out.passes" / "crn.exr").symlink_to("../elsewhere/crn.exr")
        before = self.tree()
        for more in ((), ("--overwrite",), ("--resume",)):
            self.bad(1, "'out.passes/crn.exr' is ", *RENDER, *more)
            self.assertEqual(self.tree(), before)
        self.bad(1, "is a link, which films are not written through", *RENDER, "--overwrite")


if __name__ == "__main__":
    unittest.main()
