# SPDX-License-Identifier: Apache-2.0
"""Films that `covary render` made or found are lost by nothing: a later call, an error, a full disk, a kill."""
import fcntl
import functools
import os
import random
import resource
import shutil
import signal
import subprocess
import time
import unittest

from cli_test import COVARY, SLOWDOWN
from exr_reader import header, read_exr
from render_outputs_test import ROOM, SMALL, RenderTest

IICV = ("--estimator", "iicv")
PLAIN = ("render", ROOM, *SMALL, "-o", "out.exr", "--spp", "24")
RENDER = (*PLAIN, *IICV)


class FilmsTest(RenderTest):
    def tree(self, folder="."):
        """All that is under the folder: bytes of files, where links lead."""
        return {str(p.relative_to(self.path)): os.readlink(p) if p.is_symlink() else p.read_bytes()
                for p in sorted((self.path / folder).rglob("*")) if p.is_symlink() or p.is_file()}

    def interrupt(self, *arguments, film, sent=signal.SIGINT):
        """A render that got a signal once all of its films had been written with samples in them."""
        process = self.start("-o", "out.exr", "--spp", "1000000", "--checkpoint", "0.05", "--quiet", "--no-preview",
                             *arguments)
        self.wait_until_written(film, 3, process)
        code, _, errors = self.stop(process, sent)
        return code, errors

    def wait_until_written(self, film, times, process):
        path, written = self.path / film, set()

        def often_enough():
            if path.exists():
                written.add(path.stat().st_mtime_ns)
            return len(written) >= times
        self.wait_for(often_enough, process)


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
        for more in ((), ("--seed", "7"), ("--max-depth", "2")):
            self.refused("'out.passes/", *RENDER, *more)
        self.refused("'out.passes/", *PLAIN, "--estimator", "iduw")
        self.refused("'out.passes/", *PLAIN)
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
        code, errors = self.interrupt(*IICV, film="out.passes/independent.exr")
        self.assertEqual(code, 130, errors)
        self.refused("'out.passes/", *RENDER)
        self.good(*RENDER, "--overwrite")
        self.assertNotIn("covary:complete", self.attributes("out.exr"))
        self.assertFalse((self.path / "out.passes").exists())

    def test_an_interrupted_film(self):
        plain = ("--estimator", "none")
        code, errors = self.interrupt(*plain, film="out.exr")
        self.assertEqual(code, 130, errors)
        self.refused("'out.exr' is the film of an interrupted render", *PLAIN, *plain)
        self.refused("'out.exr' is the film of an interrupted render", *RENDER)
        self.good(*PLAIN, *plain, "--overwrite")
        self.assertEqual(self.attributes("out.exr")["covary:complete"], "true")
        self.good(*PLAIN, *plain)  # a finished film is an image like any other

    def test_files_that_are_no_films(self):
        (self.path / "out.passes").mkdir()
        for name, data in (("notes.txt", b"mine"), ("crn.json", b"{}"), (".lock", b"1")):
            (self.path / "out.passes" / name).write_bytes(data)
        mine = self.tree("out.passes")
        self.good(*RENDER)
        self.assertEqual(self.tree("out.passes"), mine)
        self.image("out.passes/crn.exr", (1, 2, 3))
        mine = self.tree("out.passes")
        self.refused("'out.passes/crn.exr' ", *RENDER)
        for overwrite in ("--overwrite", "--resume"):
            self.assertEqual(self.run_covary(*RENDER, overwrite).returncode, 1)
            self.assertEqual(self.tree("out.passes"), mine)
        self.bad(1, "and is not a film", *RENDER, "--overwrite")

    def test_a_linked_folder(self):
        self.good("render", ROOM, *SMALL, "-o", "else.exr", "--spp", "24", *IICV, "--passes", "elsewhere")
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
        self.good("render", ROOM, *SMALL, "-o", "else.exr", "--spp", "24", *IICV, "--passes", "elsewhere")
        (self.path / "out.passes").mkdir()
        (self.path / "out.passes" / "crn.exr").symlink_to("../elsewhere/crn.exr")
        before = self.tree()
        for more in ((), ("--overwrite",), ("--resume",)):
            self.bad(1, "'out.passes/crn.exr' ", *RENDER, *more)
            self.assertEqual(self.tree(), before)
        self.bad(1, "is a symbolic link; films are not written through links", *RENDER, "--overwrite")


class Checkpoints(FilmsTest):
    """The disk is full, as far as the films are concerned."""
    LIMIT = 200 << 10  # bytes of a file: an image fits, the film of a pass does not

    def limited(self):
        return functools.partial(resource.setrlimit, resource.RLIMIT_FSIZE, (self.LIMIT, resource.RLIM_INFINITY))

    def test_one_that_cannot_be_written_is_a_warning(self):
        command = [*RENDER, "--checkpoint", "0.001"]
        self.good(*command)
        whole = read_exr((self.path / "out.exr").read_bytes())
        result = self.good(*command, preexec_fn=self.limited())
        self.assertIn("warning: the films could not be kept: cannot write out.passes/crn.exr: File too large; "
                      "rendering continues, and the next checkpoint tries again\n", result.stderr)
        self.assertEqual(read_exr((self.path / "out.exr").read_bytes()), whole)
        self.assertEqual([p.name for p in self.path.rglob("*.part")], [])

    def test_the_next_one_tries_again(self):
        process = subprocess.Popen([COVARY, "render", ROOM, *SMALL, "-o", "out.exr", "--spp", "1000000",
                                    *IICV, "--checkpoint", "0.05"], cwd=self.path, stderr=subprocess.PIPE, text=True,
                                   preexec_fn=self.limited())
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        self.assertIn("the films could not be kept", process.stderr.readline())
        self.assertFalse((self.path / "out.passes" / "crn.exr").exists())
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        self.wait_until_written("out.passes/independent.exr", 2, process)
        process.send_signal(signal.SIGKILL)
        process.communicate(timeout=60 * SLOWDOWN)
        self.good("info", "out.passes/crn.exr")

    def test_the_image_where_its_films_find_no_room(self):
        result = self.run_covary(*RENDER, "--passes", "films", preexec_fn=self.limited())
        self.assertEqual(result.returncode, 1)
        self.assertIn("covary: cannot write films/crn.exr: File too large\n", result.stderr)
        self.good("info", "out.exr")


class LeftOver(FilmsTest):
    """Unfinished files, which are named .OUTPUT.PROCESS-NUMBER.part."""

    def dead(self):
        process = subprocess.Popen(["true"])
        process.wait()
        return process.pid

    def test_of_the_dead_and_of_the_living(self):
        dead = self.dead()
        ours, others = f".out.exr.{dead}-0.part", f".else.exr.{dead}-0.part"
        living, held, odd = f".out.exr.{os.getpid()}-0.part", f".out.exr.{dead}-1.part", ".out.exr.x-0.part"
        for name in (ours, others, living, held, odd):
            self.write(name, b"half")
        with open(self.path / held, "rb") as file:  # on another machine its process may well live
            fcntl.flock(file, fcntl.LOCK_SH)
            self.good(*RENDER)
        self.assertEqual(sorted(p.name for p in self.path.glob(".*.part")), sorted((others, living, held, odd)))

    def test_of_a_killed_render(self):
        parts = []
        for _ in range(100):
            process = self.start("-o", "out.exr", "--spp", "1000000", "--checkpoint", "0.001", "--quiet",
                                 "--no-preview", "--estimator", "none", "--groups", "64", "--max-depth", "1",
                                 "--overwrite")
            self.wait_for(lambda: list(self.path.glob(".*.part")), process)
            self.stop(process, signal.SIGKILL)
            parts = list(self.path.glob(".*.part"))
            if parts:
                break
        self.assertNotEqual(parts, [])
        self.good(*RENDER, "--overwrite")
        self.assertEqual(list(self.path.glob(".*.part")), [])

    def test_none_of_a_render_that_is_told_twice_to_end(self):
        for _ in range(10):  # where it is when the second signal comes is left to chance
            process = self.start("-o", "out.exr", "--spp", "1000000", "--checkpoint", "0.001", "--quiet",
                                 "--no-preview", "--estimator", "none", "--groups", "64", "--max-depth", "1",
                                 "--overwrite")
            self.wait_for(lambda: list(self.path.glob(".*.part")), process)
            process.send_signal(signal.SIGINT)
            code, _, errors = self.stop(process)
            self.assertEqual(code, 130, errors)
            self.assertEqual(list(self.path.glob(".*.part")), [])


class WantedError(FilmsTest):
    """--until decides on samples in rounds, and takes the same ones after an interruption."""
    UNTIL = ("--until", "relmse=0.003", "--quiet", "--no-preview")

    def test_interrupted_and_resumed(self):
        # Of each film: of 24 in the first round, and of 120 in the last.
        self.check((*IICV, *self.UNTIL), "crn", (12, 84), ((signal.SIGKILL, -9), (signal.SIGTERM, 143)))

    def test_denoised(self):
        self.check(("--oidn", "off", "--until", "relmse=0.0015", *self.UNTIL[2:]), "independent", (12, 108),
                   ((signal.SIGTERM, 143),))

    def check(self, options, film, all_samples, ends):
        self.good("render", ROOM, *SMALL, *options, "-o", "whole.exr")
        whole = read_exr((self.path / "whole.exr").read_bytes())
        for sent, code in ends:
            for samples in all_samples:
                with self.subTest(code=code, samples=samples):
                    process = self.start("-o", "out.exr", *options, "--checkpoint", "0.01", "--overwrite",
                                         "--threads", "1")
                    self.wait_for(lambda: self.samples(f"out.passes/{film}.exr") >= samples, process)
                    self.assertEqual(self.stop(process, sent)[0], code)
                    self.good("render", ROOM, *SMALL, *options, "-o", "out.exr", "--resume")
                    self.assertEqual(read_exr((self.path / "out.exr").read_bytes()), whole)

    def samples(self, film):
        path = self.path / film
        if not path.exists():
            return 0
        return float(header(path.read_bytes())[0]["covary:samples"].decode())


class Kills(FilmsTest):
    """Nightly: whenever a render is killed, what is left continues to the bits of one that never was."""
    KILLS = 75

    def test_at_any_time(self):
        chance = random.Random(75)
        renders = (IICV, ("--oidn", "off", "--integrator", "bdpt", "--set", "light-tracing=on"),
                   ("--estimator", "none", "--sampler", "sobol"))
        for number, options in enumerate(renders):
            command = (*PLAIN[:-1], "96", "--passes", f"films{number}", "--checkpoint", "0.02", *options)
            begun = time.monotonic()
            self.good(*command)
            seconds, whole = time.monotonic() - begun, self.finished(number)
            for _ in range(self.KILLS // len(renders)):
                process = subprocess.Popen([COVARY, *command, "--resume"], cwd=self.path, stderr=subprocess.PIPE)
                try:
                    errors = process.communicate(timeout=chance.uniform(0, seconds))[1]
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.communicate()
                    continue
                self.assertEqual(process.returncode, 0, errors)
                self.assertEqual(self.finished(number), whole)
                shutil.rmtree(self.path / f"films{number}")
                (self.path / "out.exr").unlink()
            self.good(*command, "--resume")
            self.assertEqual(self.finished(number), whole)
            self.assertEqual([name for name in self.tree() if ".part" in name], [])

    def finished(self, number):
        """Pixels of the image and the films."""
        files = sorted((self.path / f"films{number}").glob("*.exr"))
        self.assertTrue(files)
        return [read_exr(path.read_bytes()) for path in (self.path / "out.exr", *files)]


if __name__ == "__main__":
    unittest.main()
