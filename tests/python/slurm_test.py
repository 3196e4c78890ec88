# SPDX-License-Identifier: Apache-2.0
"""covary.distributed on a real Slurm of one node, by dask-jobqueue, and parts of an experiment as an array of jobs."""
import json
import os
import subprocess
import sys
import unittest

import covary
import covary.distributed
from common import PROGRAM, ROOM, SOURCE, PackageTest

SUITE = {"name": "tiny", "scenes": [{"name": "room", "file": "room.xml", "resolution": "32x24"}],
         "methods": [{"name": "pt", "options": ["--estimator", "none"]},
                     {"name": "iicv", "options": ["--estimator", "iicv"]}],
         "budgets": [{"spp": 24}], "seeds": 2, "common_options": ["--rfilter", "box"], "reference": {"spp": 32}}


class Slurm(PackageTest):
    def setUp(self):
        super().setUp()
        node = [SOURCE / "scripts" / "slurm"]
        self.addCleanup(subprocess.run, [*node, "stop", self.path / "slurm"], check=True)
        subprocess.run([*node, "start", self.path / "slurm"], check=True)
        os.environ["SLURM_CONF"] = str(self.path / "slurm" / "slurm.conf")
        self.addCleanup(os.environ.pop, "SLURM_CONF")

    def cluster(self, **keywords):
        from dask_jobqueue import SLURMCluster
        names = ("PYTHONPATH", "COVARY_PROGRAM")
        return SLURMCluster(cores=1, memory="1 GB", walltime="00:10:00", interface="lo", python=sys.executable,
                            scheduler_options={"dashboard_address": None}, log_directory=str(self.path),
                            local_directory=str(self.path), job_script_prologue=[
                                f"export {name}={os.environ[name]}" for name in names], **keywords)

    def test_jobs_as_workers(self):
        """Bits of one machine, though one of the jobs is cancelled in the middle."""
        from distributed import Client
        scene = covary.Scene.load(ROOM, resolution=(72, 48))
        here = covary.render(scene, 48, "iicv", seed=4)
        with self.cluster() as cluster, Client(cluster) as client:
            cluster.adapt(minimum_jobs=2, maximum_jobs=2, interval="200ms")
            client.wait_for_workers(2, timeout=100)
            jobs = self.jobs()
            self.assertEqual(len(jobs), 2)

            def cancel(done, total):
                if done == 3:
                    subprocess.run(["scancel", "--signal=KILL", "--full", jobs[0]], check=True)
            there = covary.distributed.render(client, scene, 48, "iicv", seed=4, tile=12, progress=cancel)
            self.assertNotIn(jobs[0], self.jobs())
            report = covary.distributed.experiment(client, self.suite(), self.path / "out",
                                                   ["--scenes", str(SOURCE / "scenes")])
        self.assert_same_bits(here.image, there.image)
        self.assertTrue(report.exists())

    def jobs(self):
        return subprocess.run(["squeue", "-h", "-o", "%A"], capture_output=True, text=True, check=True).stdout.split()

    def suite(self):
        (self.path / "suite.json").write_text(json.dumps(SUITE))
        return self.path / "suite.json"

    def test_parts_of_an_experiment(self):
        words = ["experiment", self.suite(), "-o", "out", "--scenes", SOURCE / "scenes"]
        line = " ".join(map(str, (PROGRAM, *words, "--part", "$SLURM_ARRAY_TASK_ID/4")))
        subprocess.run(["sbatch", "--quiet", "--wait", "--array=1-4", "--output=job-%a", f"--chdir={self.path}",
                        "--wrap", line], check=True)
        runs = self.path / "out" / "cache" / "runs"
        self.assertEqual(len(list(runs.glob("*/run.json"))), 2 + 2 * 2)
        self.run_program(*words)
        self.assertEqual(len(list(runs.glob("*/run.json"))), 2 + 2 * 2)
        self.assertTrue((self.path / "out" / "report.html").exists())


if __name__ == "__main__":
    unittest.main()
