# SPDX-License-Identifier: Apache-2.0
"""docs/examples/{render,frames}_on_slurm.sh: by a stand-in for sbatch that runs jobs at once, and by Slurm itself."""
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

COVARY, SOURCE = Path(os.environ["COVARY"]), Path(os.environ["SOURCE"])
ROOM = SOURCE / "scenes" / "room.xml"
SCRIPT, FRAMES = (SOURCE / "docs" / "examples" / f"{what}_on_slurm.sh" for what in ("render", "frames"))
SMALL = ("--resolution", "48x32")
TASKS = 3

# Jobs run before sbatch returns. $KILLED is the task that is killed once it has written a film. A job that depends on
# one that failed is dropped, as by --kill-on-invalid-dep.
SBATCH = """#!/usr/bin/env bash
while [[ $1 = --* ]]; do
  case $1 in
    --array=*) first=${1#*=} first=${first%-*} tasks=${1##*-};;
    --output=*) log=${1#*=};;
    --dependency=afterok:*) [ ! -e failed ] || exit 0;;
  esac
  shift
done
rm -f failed
for task in $(seq ${first:-1} ${tasks:-1}); do
  export SLURM_ARRAY_TASK_ID=$task
  if [ "$KILLED" = "$task" ]; then
    "$@" > "${log/\\%a/$task}" 2>&1 &
    until [ -s "$4/${FILM:-$task}.exr" ]; do sleep 0.01; done
    kill -9 $!
    touch failed
  else
    "$@" >> "${log/\\%a/$task}" 2>&1 || touch failed
  fi
done
echo 1
"""


class Cluster(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)
        self.environment = dict(os.environ, PATH=f"{self.path}/bin:{COVARY.parent}:{os.environ['PATH']}")

    def run_in_folder(self, *command, code=0, **environment):
        result = subprocess.run(list(map(str, command)), cwd=self.path, capture_output=True, text=True, timeout=300,
                                env=self.environment | environment, check=False)
        self.assertEqual(result.returncode, code, result.stderr + result.stdout)
        return result.stdout + result.stderr

    def render(self, samples, *options, tasks=TASKS, **keywords):
        return self.run_in_folder(SCRIPT, ROOM, "out.exr", samples, tasks, *SMALL, *options, **keywords)

    def check_result(self, samples):
        """The mean has the bits of one machine; out.exr knows the features."""
        films = [f"{seed}.exr" for seed in range(1, TASKS + 1)]
        for seed, film in enumerate(films, 1):
            self.run_in_folder(COVARY, "render", ROOM, "-o", film, "--estimator", "none", "--aovs", "--seed", seed,
                               "--spp", samples, *SMALL)
        self.run_in_folder(COVARY, "merge", *films, "-o", "mean.exr")
        facts = self.run_in_folder(COVARY, "compare", "out.mean.exr", "--reference", "mean.exr", "--json", "-")
        self.assertEqual(json.loads(facts.splitlines()[0])["relmse"], 0)
        log = (self.path / "out.parts/join.log").read_text()
        self.assertIn(f"of {TASKS} renders, guided by albedo and normal", log)
        self.assertTrue((self.path / "out.exr").exists())

    def render_frames(self, samples, *options, frames="1-3", **keywords):
        path = SOURCE / "scenes" / "room-path.json"
        return self.run_in_folder(FRAMES, ROOM, "out_##.exr", frames, samples, *SMALL, "--camera-path", path, *options,
                                  **keywords)

    def check_frames(self, samples, *options, waves=1):
        """The bits of one machine."""
        path = SOURCE / "scenes" / "room-path.json"
        films = [f"film_#-{wave}.exr" for wave in range(waves)]
        groups = ["--groups", 4] if waves == 1 else []
        for seed, film in enumerate(films):
            self.run_in_folder(COVARY, "render", ROOM, "-o", film, "--frames", "1-3", "--estimator", "none", "--aovs",
                               "--spp", samples, "--seed", seed, "--camera-path", path, *groups, *SMALL, *options)
        self.run_in_folder(COVARY, "denoise", *films, "-o", "here_##.exr")
        for frame in (1, 2, 3):
            facts = self.run_in_folder(COVARY, "compare", f"out_0{frame}.exr", "--reference", f"here_0{frame}.exr",
                                       "--metric", "mse", "--json", "-")
            self.assertEqual(json.loads(facts.splitlines()[0])["mse"], 0)


class StandIn(Cluster):
    def setUp(self):
        super().setUp()
        (self.path / "bin").mkdir()
        (self.path / "bin" / "sbatch").write_text(SBATCH)
        (self.path / "bin" / "sbatch").chmod(0o755)


class Script(StandIn):
    def test_parts_are_joined(self):
        self.render(8)
        self.check_result(8)

    def test_a_killed_task_is_resumed(self):
        self.render(200, "--checkpoint", "0.02", KILLED="2")
        self.assertFalse((self.path / "out.exr").exists())
        self.assertIn("complete: false", self.run_in_folder(COVARY, "info", "out.parts/2.exr"))
        self.render(200)
        self.check_result(200)

    def test_wrong_options_are_found_before_there_are_jobs(self):
        self.assertIn("did you mean '--integrator'", self.render(8, "--integrater", "path", code=2))
        self.assertIn("two or more TASKS", self.render(8, tasks=1, code=2))
        self.assertFalse((self.path / "out.parts" / "1.log").exists())


class WithoutSlurm(Cluster):
    def test_is_told_before_anything_is_written(self):
        commands = self.path / "commands"  # all but sbatch
        commands.mkdir()
        for name in ("bash", "env", "realpath", "mkdir", "seq", "sed"):
            (commands / name).symlink_to(shutil.which(name))
        path = f"{COVARY.parent}:{commands}"
        for script, output, frames in ((SCRIPT, "out.exr", ()), (FRAMES, "out_#.exr", ("1-3",))):
            message = self.run_in_folder(script, ROOM, output, *frames, 8, *(() if frames else (3,)), code=1, PATH=path)
            self.assertIn("no program sbatch here; run this where Slurm takes jobs", message)
        self.assertEqual([p.name for p in self.path.iterdir()], ["commands"])


class Frames(StandIn):
    """docs/examples/frames_on_slurm.sh."""

    def test_frames_are_denoised_with_history(self):
        self.render_frames(8)
        self.check_frames(8)

    def test_a_killed_task_costs_its_frame_alone(self):
        """Task 5 is the second wave of frame 2."""
        self.render_frames("2x100", "--checkpoint", "0.02", KILLED="5", FILM="2-2")
        self.assertFalse((self.path / "out_02.exr").exists())
        self.assertIn("complete: false", self.run_in_folder(COVARY, "info", "out_.parts/2-2.exr"))
        others = [self.path / f"out_.parts/{film}.exr" for film in ("1-1", "1-2", "2-1", "3-1", "3-2")]
        times = [film.stat().st_mtime_ns for film in others]
        self.render_frames("2x100", "--checkpoint", "0.02")
        self.check_frames(100, "--checkpoint", "0.02", waves=2)
        self.assertEqual([film.stat().st_mtime_ns for film in others], times)

    def test_wrong_options_are_found_before_there_are_jobs(self):
        self.assertIn("did you mean '--integrator'", self.render_frames(8, "--integrater", "path", code=2))
        self.assertIn("FIRST-LAST", self.render_frames(8, frames="3", code=2))


class Slurm(Cluster):
    SAMPLES = 2000

    def setUp(self):
        super().setUp()
        if not shutil.which("slurmctld") or os.geteuid() != 0:
            self.skipTest("needs slurmctld, munge and root")
        self.node = self.path / "slurm"
        self.addCleanup(subprocess.run, [SOURCE / "scripts" / "slurm", "stop", self.node], check=True)
        subprocess.run([SOURCE / "scripts" / "slurm", "start", self.node], check=True)
        self.environment |= {"SLURM_CONF": str(self.node / "slurm.conf"), "SBATCH_CPUS_PER_TASK": "1"}

    def queue(self):
        """State and number of each job."""
        lines = self.run_in_folder("squeue", "--array", "--noheader", "--format=%T %i").splitlines()
        return [line.split() for line in lines]

    def wait(self, done):
        for _ in range(1500):
            if done():
                return
            time.sleep(0.2)
        self.fail(f"not within five minutes; the queue is {self.queue()}")

    def running(self):
        return [job for state, job in self.queue() if state == "RUNNING"]

    def film_is_there(self):
        return any((self.path / "out.parts").glob("?.exr"))

    def kill_scheduler(self):
        os.kill(int((self.node / "slurmctld.pid").read_text()), signal.SIGKILL)

    def test_a_task_and_the_scheduler_are_killed(self):
        self.render(self.SAMPLES, "--checkpoint", "0.2")
        self.wait(self.film_is_there)
        self.kill_scheduler()
        self.assertIn("Unable to contact slurm controller", self.render(self.SAMPLES, code=1))
        self.run_in_folder("slurmctld")
        self.wait(self.running)
        self.run_in_folder("scancel", "--full", "--signal=KILL", self.running()[0])
        self.wait(lambda: not self.queue())
        self.assertFalse((self.path / "out.exr").exists(), "joined though a task was killed")
        self.render(self.SAMPLES)
        self.wait(lambda: not self.queue())
        self.check_result(self.SAMPLES)

    def test_a_wave_of_a_frame_is_killed(self):
        films = self.path / "out_.parts"
        self.render_frames(f"2x{self.SAMPLES}", "--checkpoint", "0.2")
        self.wait(lambda: any(films.glob("2-?.exr")))
        self.run_in_folder("scancel", "--full", "--signal=KILL", self.running()[0])
        self.wait(lambda: not self.queue())
        self.assertFalse((self.path / "out_01.exr").exists(), "joined though a task was killed")
        self.render_frames(f"2x{self.SAMPLES}", "--checkpoint", "0.2")
        self.wait(lambda: not self.queue())
        self.check_frames(self.SAMPLES, "--checkpoint", "0.2", waves=2)


if __name__ == "__main__":
    unittest.main()
