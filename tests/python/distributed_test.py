# SPDX-License-Identifier: Apache-2.0
"""covary.distributed on clusters of this machine: the bits of one machine, with workers that die, and without the files
of the scene."""
import contextlib
import io
import json
import os
import pickle
import select
import shutil
import signal
import subprocess
import sys
import unittest
from unittest import mock

import covary
import covary._program
import covary.distributed
import numpy
from common import ROOM, SOURCE, PackageTest
from render_test import OVERFLOW

SIZE = (72, 48)
SUITE = {"name": "tiny", "scenes": [{"name": "room", "file": "room.xml", "resolution": "32x24"}],
         "methods": [{"name": "pt", "options": ["--estimator", "none"]},
                     {"name": "iicv", "options": ["--estimator", "iicv"]}],
         "budgets": [{"spp": 24}], "seeds": 2, "common_options": ["--rfilter", "box"], "reference": {"spp": 32}}


class Parts(PackageTest):
    """What needs no cluster."""

    def test_tiles_cover_the_frame_once(self):
        for width, height, side in ((72, 48, 24), (50, 31, 16), (5, 5, 100)):
            covered = numpy.zeros((height, width), int)
            for x, y, w, h in covary.distributed._tiles(width, height, side):
                covered[y:y + h, x:x + w] += 1
            self.assertTrue((covered == 1).all())

    def test_parts_are_counted_once(self):
        film = covary.render(ROOM, 4, "none", crop=(0, 0, 4, 4)).films["independent"]
        canvas = covary.distributed._Canvas(4, 4)
        part = covary.distributed.Part((0, 0, 4, 4), 0, 0)
        rendered = covary.distributed.Rendered({"independent": film})
        canvas.add(part, rendered)
        self.assertIn("came twice", self.message_of(RuntimeError, canvas.add, part, rendered))
        self.assert_same_bits(canvas.films()["independent"].groups, film.groups)

    def test_films_go_through_pickle(self):
        film = covary.render(ROOM, 24, "iicv", crop=(3, 4, 20, 10)).films["crn"]
        other = pickle.loads(pickle.dumps(film))
        self.assert_same_bits(film.groups, other.groups)
        self.assertEqual((film.crop, film.frame, film.attributes), (other.crop, other.frame, other.attributes))
        self.assertTrue((film.counts == other.counts).all())
        with_aovs = covary.render(ROOM, 4, "none", crop=(0, 0, 4, 4), aovs=True).films["independent"]
        if with_aovs.aovs:
            self.assertIn("cannot be pickled", self.message_of(TypeError, pickle.dumps, with_aovs))

    def test_files_by_content(self):
        shutil.copy(ROOM, self.path / "a.xml")
        files = covary.distributed.SceneFiles(covary.Scene.load(self.path / "a.xml"))
        self.assertEqual(sorted(files.contents), ["a.xml"])
        folder = files.write(self.path / "worker")
        self.assertEqual((folder / "a.xml").read_bytes(), ROOM.read_bytes())
        self.assertEqual(files.write(self.path / "worker"), folder)
        (self.path / "a.xml").write_text(ROOM.read_text() + "<!-- other -->")
        self.assertNotEqual(covary.distributed.SceneFiles(covary.Scene.load(self.path / "a.xml")).hash, files.hash)

    def test_disk_that_takes_nothing(self):
        files = covary.distributed.SceneFiles(covary.Scene.load(ROOM))
        (self.path / "file").write_text("")
        message = self.message_of(covary.IoError, files.write, self.path / "file" / "folder")
        self.assertIn("a worker cannot write the scene's files", message)
        self.assertIn("--local-directory", message)

    def test_program_that_ends_with_its_process(self):
        """However that ends: of a worker that is killed nothing is left that takes processors."""
        end, other_end = os.pipe()
        self.addCleanup(os.close, end)
        script = self.path / "program"
        script.write_text(f"#!/bin/sh\necho started > /proc/self/fd/{other_end}\nexec sleep 100\n")
        script.chmod(0o755)
        code = "import covary._program; covary._program.run_program('experiment')"
        with subprocess.Popen([sys.executable, "-c", code], pass_fds=[other_end],
                              env={**os.environ, "COVARY_PROGRAM": str(script)}) as process:
            os.close(other_end)
            self.assertEqual(os.read(end, 100), b"started\n")
            process.kill()
        ready, _, _ = select.select([end], [], [], 50)
        self.assertEqual((ready, os.read(end, 100)), ([end], b""))  # nobody has the other end open

    def test_messages_of_the_program(self):
        exit_code, output, errors = covary._program.run_program("experiment", "--list")
        self.assertEqual((exit_code, errors), (0, ""))
        self.assertIn("iicv-table1", output)
        self.assertEqual(covary._program.run_program("experiment", "--lsit")[0], 2)

    def test_parts_on_disk(self):
        """With the same bits; one that is damaged, or of other settings, is not taken."""
        part = covary.distributed.Part((2, 1, 20, 10), 3, 0)
        made = covary.render(ROOM, 24, "iicv", seed=3, crop=part.crop, films_only=True, aovs=True)
        bad = covary.BadSample("crn", 2, 3, 4, (1.0, -2.0, 0.0), False, "covary render …")
        rendered = covary.distributed.Rendered(made.films, made.aovs, ("a warning",), 5, 6, (bad,))
        folder = covary._parts.PartFolder(str(self.path), {"scene": "a"})
        self.assertIsNone(folder.load(part))
        for _ in range(2):  # also in place of the same
            folder.keep(part, rendered)
        loaded = covary._parts.PartFolder(str(self.path), {"scene": "a"}).load(part)
        for name, film in made.films.items():
            self.assert_same_bits(film.groups, loaded.films[name].groups)
            self.assertEqual({**film.attributes, **loaded.films[name].attributes}, loaded.films[name].attributes)
        for name, image in made.aovs.items():
            self.assert_same_bits(image, loaded.aovs[name])
        self.assertEqual((loaded.warnings, loaded.not_finite_samples, loaded.negative_samples, loaded.bad_samples),
                         (("a warning",), 5, 6, (bad,)))
        self.assertEqual([path.name for path in folder.path.iterdir() if path.name.startswith(".part")], [])
        self.assertIsNone(covary._parts.PartFolder(str(self.path), {"scene": "b"}).load(part))
        self.assertIsNone(folder.load(covary.distributed.Part((2, 1, 20, 10), 4, 0)))
        file = folder.path / part.name / "film-crn.exr"
        content = bytearray(file.read_bytes())
        content[-7] ^= 1
        file.write_bytes(content)
        self.assertIsNone(folder.load(part))
        folder.keep(part, rendered)
        self.assertIsNotNone(folder.load(part))

    def test_disk_that_takes_no_parts(self):
        (self.path / "file").write_text("")
        self.assertIn("folder: cannot write into", self.message_of(
            covary.IoError, covary._parts.PartFolder, str(self.path / "file"), {}))

    def test_missing_dask(self):
        kept = sys.modules.get("distributed")
        sys.modules["distributed"] = None
        try:
            self.assertEqual(self.message_of(ImportError, covary.distributed.dask),
                             "covary.distributed needs Dask: pip install distributed")
        finally:
            if kept is None:
                del sys.modules["distributed"]
            else:
                sys.modules["distributed"] = kept


    def test_without_workers(self):
        """It is told, and those that come later are used."""
        from distributed import Client, LocalCluster
        told = []
        with LocalCluster(n_workers=0, processes=False, dashboard_address=None) as cluster, Client(cluster) as client:
            def warn(text, category, **_):
                told.append((text, category))
                cluster.scale(1)
            with mock.patch.object(covary._cluster, "_PATIENCE", 0.1), \
                    mock.patch.object(covary._cluster.warnings, "warn", warn):
                found = dict(covary._cluster.results(client, abs, [("a", (-1,)), ("b", (-2,))]))
        self.assertEqual(found, {"a": 1, "b": 2})
        self.assertRegex(told[0][0], "^2 parts wait for a worker: none is connected to inproc://")
        self.assertIs(told[0][1], RuntimeWarning)


class Cluster(PackageTest):
    @classmethod
    def setUpClass(cls):
        from distributed import Client, LocalCluster
        cls.cluster = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True)
        cls.addClassCleanup(cls.cluster.close)
        cls.client = Client(cls.cluster)
        cls.addClassCleanup(cls.client.close)

    def scene(self, **keywords):
        return covary.Scene.load(ROOM, resolution=SIZE, **keywords)

    def test_bits_of_one_machine(self):
        here = covary.render(self.scene(), 24, "iicv", seed=3)
        seen = []
        there = covary.distributed.render(self.client, self.scene(), 24, "iicv", seed=3, tile=20,
                                          progress=lambda done, total: seen.append((done, total)))
        self.assert_same_bits(here.image, there.image)
        self.assert_same_bits(here.std_error, there.std_error)
        self.assertEqual((seen[-1], there.parts, there.samples_per_pixel), ((12, 12), 12, 24))
        for name in ("crn", "independent"):
            self.assert_same_bits(here.films[name].groups, there.films[name].groups)

    def test_progress(self):
        """True writes lines, as in covary.render()."""
        shown = io.StringIO()
        with contextlib.redirect_stderr(shown):
            covary.distributed.render(self.client, self.scene(), 24, "iicv", tile=40, progress=True)
        self.assertIn("parts: 3 of 4\nparts: 4 of 4\n", shown.getvalue())

    def test_threads_of_workers(self):
        self.assertEqual(set(self.client.run(covary.set_threads, 1).values()), {None})
        self.client.run(covary.set_threads, 0)
        self.assertIn("n: found -1", self.message_of(ValueError, self.client.run, covary.set_threads, -1))

    def test_denoised(self):
        """With features that the workers render, and the denoiser of the frame, not of tiles."""
        here = covary.render(self.scene(), 48, "iicv", denoise="error", oidn="off")
        there = covary.distributed.render(self.client, self.scene(), 48, "iicv", tile=30, denoise="error", oidn="off")
        self.assert_same_bits(here.image, there.image)
        self.assert_same_bits(here.std_error, there.std_error)
        self.assertEqual(here.estimator, there.estimator)

    def test_the_default_is_that_of_one_machine(self):
        for keywords in ({}, {"estimator": "none"}, {"estimator": "none", "denoise": "bias"}):
            with self.subTest(keywords):
                if keywords.get("estimator") is None or "denoise" in keywords:
                    keywords = {**keywords, "oidn": "off"}
                here = covary.render(self.scene(), 16, seed=3, **keywords)
                there = covary.distributed.render(self.client, self.scene(), 16, seed=3, tile=30, **keywords)
                self.assert_same_bits(here.image, there.image)
                self.assertEqual(list(here.films), list(there.films))
                self.assertEqual((here.estimator, here.predicted_relmse, here.predicted_bounds, here.samples_per_pixel),
                                 (there.estimator, there.predicted_relmse, there.predicted_bounds,
                                  there.samples_per_pixel))
        self.assertIn("window: is not an argument of estimator 'mixture'",
                      self.message_of(covary.UsageError, covary.distributed.render, self.client, self.scene(), 16,
                                      window=3))

    def test_ranges_of_samples(self):
        films = [covary.render(self.scene(), 8, "none", seed=seed).films["independent"] for seed in (5, 6, 7)]
        images = []
        there = covary.distributed.render(self.client, self.scene(), 24, "none", seed=5, sample_ranges=3, tile=40,
                                          on_image=images.append, image_seconds=0)
        self.assert_same_bits(covary.merge_films(films).mean, there.image)
        self.assertEqual(images[-1].shape, there.image.shape)

    def test_workers_that_die(self):
        """One is killed in the middle; what it had is rendered again, on the one that takes its place, too."""
        here = covary.render(self.scene(), 48, "iicv", seed=4)
        killed = []

        def kill(done, total):
            if done in (3, 9):
                pid = next(iter(self.client.run(os.getpid).values()))
                killed.append(pid)
                os.kill(pid, signal.SIGKILL)
        there = covary.distributed.render(self.client, self.scene(), 48, "iicv", seed=4, tile=12, progress=kill)
        self.assertEqual(len(killed), 2)
        self.assert_same_bits(here.image, there.image)

    def test_frames(self):
        """Bits of one machine, though a worker is killed; complete frames are not rendered again."""
        words = ["--resolution", "48x32", "--spp", "8", "--estimator", "none", "--groups", "4", "--threads", "1"]
        self.run_program("render", str(ROOM), "-o", "here_#.exr", "--frames", "1-4", "--no-preview", "--quiet", *words)
        killed = []

        def kill(done, total):
            if done == 1:
                killed.append(next(iter(self.client.run(os.getpid).values())))
                os.kill(killed[-1], signal.SIGKILL)
        before = os.getcwd()
        self.addCleanup(os.chdir, before)
        os.chdir(self.path)
        files = covary.distributed.frames(self.client, ROOM, "there_#.exr", 1, 4, words, progress=kill)
        self.assertEqual([path.name for path in files], [f"there_{n}.exr" for n in range(1, 5)])
        self.assertEqual(len(killed), 1)
        for n, path in enumerate(files, 1):
            for layer in ("", "group03"):
                self.assert_same_bits(covary.read_image(f"here_{n}.exr", layer), covary.read_image(path, layer))
        times = [path.stat().st_mtime_ns for path in files]
        covary.distributed.frames(self.client, ROOM, "there_#.exr", 1, 4, words)
        self.assertEqual([path.stat().st_mtime_ns for path in files], times)
        words[3] = "4"
        waves = covary.distributed.frames(self.client, ROOM, "wave_#.exr", 1, 2, words, waves=2, seed=5,
                                           progress=kill)
        self.assertEqual([path.name for path in waves], [f"wave_{n}-{k}.exr" for n in (1, 2) for k in (1, 2)])
        self.assertEqual(len(killed), 2)
        for k in (1, 2):
            self.run_program("render", str(ROOM), "-o", f"seed{k}_#.exr", "--frames", "1-2", "--seed", str(k + 4),
                             "--no-preview", "--quiet", *words)
        for n in (1, 2):
            for k in (1, 2):
                self.assert_same_bits(covary.read_image(f"seed{k}_{n}.exr"), covary.read_image(f"wave_{n}-{k}.exr"))
        self.assertIn("seed=", self.message_of(covary.UsageError, covary.distributed.frames, self.client, ROOM,
                                               "f_#.exr", 1, 2, ["--seed", "3"], waves=2))
        for options, message in ((["--history", "on"], "--history makes each frame of the one before"),
                                 (["--spp", "x"], "frame ")):
            self.assertIn(message, self.message_of(covary.UsageError, covary.distributed.frames, self.client, ROOM,
                                                   "f_#.exr", 1, 2, options))

    def test_experiment(self):
        """The numbers of one machine, whose commands are named; a second time nothing is run."""
        (self.path / "suite.json").write_text(json.dumps(SUITE))
        words = ("--scenes", str(SOURCE / "scenes"), "--threads", "1")
        self.run_program("experiment", "suite.json", "-o", "here", *words)
        seen = []
        report = covary.distributed.experiment(self.client, self.path / "suite.json", self.path / "there", words,
                                               progress=lambda done, total: seen.append((done, total)))
        self.assertTrue(report.exists())
        self.assertEqual(seen[-1], (4, 4))
        here, there = (json.loads((self.path / out / "results.json").read_text()) for out in ("here", "there"))
        self.assertEqual([[run["relmse"] for run in cell["runs"]] for cell in here["cells"]],
                         [[run["relmse"] for run in cell["runs"]] for cell in there["cells"]])
        self.assertEqual([[run["command"] for run in cell["runs"]] for cell in here["cells"]],
                         [[run["command"] for run in cell["runs"]] for cell in there["cells"]])
        images = {key.parent.name: key for key in (self.path / "here" / "cache" / "runs").glob("*/image.exr")}
        self.assertEqual(len(images), 6)
        for key, image in images.items():
            other = self.path / "there" / "cache" / "runs" / key / "image.exr"
            self.assert_same_bits(covary.read_image(image), covary.read_image(other))
        covary.distributed.experiment(self.client, self.path / "suite.json", self.path / "there", words,
                                      progress=lambda done, total: seen.append((done, total)))
        self.assertEqual(len(seen), 4)

    def test_experiment_by_its_address(self):
        (self.path / "suite.json").write_text(json.dumps({**SUITE, "seeds": 1}))
        for start in (["-m", "covary.distributed"], ["-c", "import covary._main; covary._main.main()"]):
            command = [sys.executable, *start, "experiment", self.path / "suite.json", "-o", self.path / "out",
                       "--cluster", self.cluster.scheduler_address, "--scenes", SOURCE / "scenes"]
            run = subprocess.run(command, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertEqual(run.stdout, f"{self.path / 'out' / 'report.html'}\n")
        run = subprocess.run([*command, "--spp", "x"], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 2, run.stderr)
        self.assertIn("--spp", run.stderr)

    def test_experiment_that_fails(self):
        suite = {**SUITE, "methods": [*SUITE["methods"], {"name": "wrong", "options": ["--estimator", "iicv",
                                                                            "--groups", "2"]}], "seeds": 1}
        (self.path / "suite.json").write_text(json.dumps(suite))
        message = self.message_of(covary.Error, covary.distributed.experiment, self.client, self.path / "suite.json",
                                  self.path / "out", ["--scenes", str(SOURCE / "scenes")])
        self.assertIn("of the experiment's parts failed", message)
        self.assertEqual(len(list((self.path / "out" / "cache" / "runs").glob("*/run.json"))), 4)

    def test_refused(self):
        def refused(*arguments, **keywords):
            return self.message_of(covary.UsageError, covary.distributed.render, self.client, *arguments, **keywords)
        self.assertIn("looks at other pixels", refused(self.scene(), 24, "dependent-tests"))
        self.assertIn("the ranges divide the samples", refused(self.scene(), 25, sample_ranges=2))
        for options in ({"adaptive": True}, {"settings": {"adaptive": True}}):
            self.assertIn("looks at the whole frame", refused(self.scene(), 24, **options))
        self.assertIn("use path", refused(self.scene(integrator="bdpt"), 24))

    def test_clients_of_no_cluster(self):
        """scale() of a cluster returns None, and Client(None) starts workers here without being asked."""
        from distributed import Client
        message = self.message_of(TypeError, covary.distributed.render, self.cluster.scale(2), self.scene(), 24)
        self.assertIn("client: found None (NoneType); expected a dask.distributed.Client: cluster = ", message)
        with Client(None, n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None,
                    set_as_default=False) as client:
            for call in (lambda: covary.distributed.render(client, self.scene(), 24),
                         lambda: covary.distributed.experiment(client, "iicv-table1", self.path / "out")):
                self.assertIn("made without a cluster, so that it started workers on this machine",
                              self.message_of(covary.UsageError, call))
        with Client(self.cluster.scheduler_address, set_as_default=False) as client:
            covary._cluster.CLIENT("client", client)

    def test_nothing_is_rendered_with_wrong_options(self):
        """They are found before a part is given to a worker, or the scene's files."""
        given = self.client.register_plugin, self.client.submit
        self.client.register_plugin = self.client.submit = None
        try:
            for keywords, text in (({"windo": 3}, "did you mean 'window'?"), ({"k": 0.5}, "k: found 0.5"),
                                   ({"settings": {"groups": 2}}, "2 groups are too few"),
                                   ({"denoise": "error", "oidn": "/nowhere"}, "/nowhere"),
                                   ({"settings": {"output": "x.exr"}},
                                    "settings: found 'output'; expected one of filter"),
                                   ({"settings": {"sampling": "crn"}}, "sampling is an option of estimator none"),
                                   ({"window": 4}, "window '4': expected an odd whole number")):
                self.assertIn(text, self.message_of(covary.UsageError, covary.distributed.render, self.client,
                                                    self.scene(), 24, "iicv", **keywords))
        finally:
            self.client.register_plugin, self.client.submit = given

    def test_bad_samples(self):
        """Are told as by one machine, with the caller's name of the scene."""
        file = self.path / "strong.xml"
        file.write_text(OVERFLOW)
        with self.assertWarns(covary.BadSamplesWarning):
            here = covary.render(file, 8, "none", seed=2)
        with self.assertWarns(covary.BadSamplesWarning) as warned:
            there = covary.distributed.render(self.client, file, 8, "none", seed=2, tile=2)
        self.assertEqual(warned.filename, __file__)
        self.assertEqual(there.not_finite_samples, here.not_finite_samples)
        self.assertEqual([(bad.x, bad.y, bad.sample) for bad in here.bad_samples],
                         [(bad.x, bad.y, bad.sample) for bad in there.bad_samples])
        self.assertTrue(there.bad_samples[0].replay.startswith(f"covary render {file} "))

    def test_other_versions(self):
        kept, covary._covary.version = covary._covary.version, "0.0.9"
        try:
            message = self.message_of(covary.UsageError, covary.distributed.render, self.client, self.scene(), 24)
        finally:
            covary._covary.version = kept
        self.assertIn("versions differ: here are covary 0.0.9", message)

    def test_errors_of_workers(self):
        """Reach the caller as they are: here the one machine that cannot read the scene's file."""
        file = self.path / "room.xml"
        shutil.copy(ROOM, file)
        plan, spoilt = covary.distributed._plan, ROOM.read_text().replace("<scene", "<scen")

        def spoil(*arguments):
            made = plan(*arguments)
            file.write_text(spoilt)
            return made
        covary.distributed._plan = spoil
        try:
            self.message_of(covary.InputError, covary.distributed.render, self.client, file, 24)
        finally:
            covary.distributed._plan = plan


DIES = """
import os, signal, sys
import covary, covary.distributed
from distributed import Client

def die(done, total):
    if done == 5:
        os.kill(os.getpid(), signal.SIGKILL)

if __name__ == "__main__":
    scene = covary.Scene.load(sys.argv[2], resolution=(72, 48))
    covary.distributed.render(Client(sys.argv[1]), scene, 24, "iicv", seed=6, tile=20, folder=sys.argv[3], progress=die,
                              denoise="error", oidn="off")
"""


class Kept(PackageTest):
    def test_client_that_dies(self):
        """What it had is on the disk; another one renders the rest, with the bits of one machine."""
        from distributed import Client, LocalCluster
        scene = covary.Scene.load(ROOM, resolution=SIZE)
        folder = self.path / "parts"
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
            run = subprocess.run([sys.executable, "-c", DIES, cluster.scheduler_address, ROOM, folder], check=False,
                                 capture_output=True, text=True)
            self.assertEqual(run.returncode, -signal.SIGKILL, run.stderr)
            with Client(cluster) as client:
                seen = []

                def call(seed, **more):
                    return covary.distributed.render(client, scene, 24, "iicv", seed=seed, tile=20, folder=folder,
                                                     denoise="error", oidn="off", **more)
                there = call(6, progress=lambda done, total: seen.append(done))
                again, other = call(6), call(7)
        here = covary.render(scene, 24, "iicv", seed=6, denoise="error", oidn="off")
        self.assertEqual((there.parts, there.parts_kept, seen[0]), (12, 5, 5))
        self.assertEqual((again.parts_kept, other.parts_kept), (12, 0))
        for made in (there, again):
            self.assert_same_bits(here.image, made.image)
            self.assert_same_bits(here.std_error, made.std_error)


    def test_scheduler_that_dies(self):
        """A sentence says what is kept; workers wait for nothing, and a new scheduler gets the rest."""
        from distributed import Client, LocalCluster
        scene = covary.Scene.load(ROOM, resolution=SIZE)
        for folder, told in ((None, "without folder= they are lost"), (self.path / "parts", "they are kept in ")):
            address = str(self.path / f"{folder is None}.json")
            common = ("--scheduler-file", address, "--no-dashboard")
            scheduler = self.start("scheduler", "--port", 0, *common)
            self.start("worker", "--nthreads", 1, "--no-nanny", "--local-directory", self.path, *common)

            def kill(done, total, scheduler=scheduler):
                if done == 2:
                    scheduler.kill()
            with Client(scheduler_file=address, set_as_default=False) as client:
                client.wait_for_workers(1, timeout=60)
                message = self.message_of(covary.IoError, covary.distributed.render, client, scene, 24, tile=20,
                                          folder=folder, progress=kill)
            self.assertRegex(message, "^Dask's scheduler tcp://.* is gone after [0-9]+ of 12 parts; ")
            self.assertIn(told, message)
        with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster, \
                Client(cluster) as client:
            there = covary.distributed.render(client, scene, 24, tile=20, folder=self.path / "parts")
        self.assertGreaterEqual(there.parts_kept, 2)
        self.assert_same_bits(covary.render(scene, 24).image, there.image)

    def start(self, kind, *words):
        """A scheduler or worker of Dask."""
        log = (self.path / f"{kind}.log").open("a")
        self.addCleanup(log.close)
        process = subprocess.Popen([sys.executable, "-m", f"distributed.cli.dask_{kind}", *map(str, words)],
                                   stdout=log, stderr=log)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process


if __name__ == "__main__":
    assert (SOURCE / "scenes").exists()
    unittest.main()
